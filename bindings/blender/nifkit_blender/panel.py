"""The panel in the sidebar of the 3D view."""
from __future__ import annotations

import bpy

from .bake_operator import NIFKIT_OT_bake
from .show_operators import NIFKIT_OT_show_asset, NIFKIT_OT_show_errors


class NIFKIT_PT_panel(bpy.types.Panel):
    bl_label = "nifkit"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "nifkit"

    def draw(self, context: bpy.types.Context) -> None:
        self.layout.operator(NIFKIT_OT_bake.bl_idname, icon="EXPORT")
        self.layout.prop(context.scene.nifkit, "asset")
        for operator in (NIFKIT_OT_show_errors, NIFKIT_OT_show_asset):
            self.layout.operator(operator.bl_idname)


def register() -> None:
    bpy.utils.register_class(NIFKIT_PT_panel)


def unregister() -> None:
    bpy.utils.unregister_class(NIFKIT_PT_panel)
