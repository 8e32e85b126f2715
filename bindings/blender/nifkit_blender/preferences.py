"""Where the program `nif` is, and the asset that a scene works with."""
import os
import shutil
from pathlib import Path

import bpy
from bpy.props import PointerProperty, StringProperty

from .bake_job import BakeError


class NifkitPreferences(bpy.types.AddonPreferences):
    bl_idname = __package__

    program: StringProperty(
        name="Program nif",
        description="The program that bakes. Empty: the environment variable NIF_PROGRAM, else where the system looks",
        subtype="FILE_PATH",
    )

    def draw(self, context: bpy.types.Context) -> None:
        self.layout.prop(self, "program")
        try:
            self.layout.label(text=f"Found: {find_program(context)}", icon="CHECKMARK")
        except BakeError as error:
            self.layout.label(text=str(error), icon="ERROR")


class NifkitScene(bpy.types.PropertyGroup):
    asset: StringProperty(name="Asset", description="The .nif file that is shown", subtype="FILE_PATH")


def find_program(context: bpy.types.Context) -> str:
    """The program `nif`. Raises BakeError if there is none."""
    addon = context.preferences.addons.get(__package__)
    chosen = addon.preferences.program if addon else ""
    # What is given by name must be right; it is not replaced by another one.
    for given, where in ((bpy.path.abspath(chosen), "the add-on's preferences"), (os.environ.get("NIF_PROGRAM"), "NIF_PROGRAM")):
        if given:
            if not os.access(given, os.X_OK) or Path(given).is_dir():
                raise BakeError(f"{given} is not a program; it is named by {where}")
            return given
    found = shutil.which("nif")
    if not found:
        raise BakeError("The program nif is not installed; name it in the add-on's preferences")
    return found


def register() -> None:
    bpy.utils.register_class(NifkitPreferences)
    bpy.utils.register_class(NifkitScene)
    bpy.types.Scene.nifkit = PointerProperty(type=NifkitScene)


def unregister() -> None:
    del bpy.types.Scene.nifkit
    bpy.utils.unregister_class(NifkitScene)
    bpy.utils.unregister_class(NifkitPreferences)
