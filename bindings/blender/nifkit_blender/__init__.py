"""nifkit for Blender 3.4 and later: bakes the selected objects to a .nif asset, and shows what the asset answers.

Nothing here imports numpy or the C library before an operator needs them, so the add-on also starts where these are missing.
"""
bl_info = {
    "name": "nifkit",
    "author": "nifkit contributors",
    "version": (0, 1, 0),
    "blender": (3, 4, 0),
    "location": "3D View > Sidebar > nifkit",
    "description": "Bakes meshes to small assets that answer shadow rays, and shows what they answer",
    "category": "Object",
}

from . import bake_operator, panel, preferences, show_operators

PARTS = (preferences, bake_operator, show_operators, panel)


def register() -> None:
    for part in PARTS:
        part.register()


def unregister() -> None:
    for part in reversed(PARTS):
        part.unregister()
