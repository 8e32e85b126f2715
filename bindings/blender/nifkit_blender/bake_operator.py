"""The operator that bakes the selected objects."""
import os
import shlex
import time
from typing import Iterator, Optional

import bpy
from bpy.props import EnumProperty, StringProperty
from bpy_extras.io_utils import ExportHelper

from .bake_job import BakeError, BakeJob
from .geometry import collect
from .long_operator import Failure, LongOperator
from .preferences import find_program

POLL = 0.02  # seconds


class NIFKIT_OT_bake(LongOperator, bpy.types.Operator, ExportHelper):
    """Bake the selected objects to a .nif asset, with their modifiers. Objects that share a mesh stay instances"""

    bl_idname = "nifkit.bake"
    bl_label = "Bake to .nif"
    bl_options = {"REGISTER"}

    filename_ext = ".nif"
    filter_glob: StringProperty(default="*.nif", options={"HIDDEN"})
    encoding: EnumProperty(
        name="Encoding",
        description="How the asset answers rays",
        items=[
            ("auto", "Automatic", "Exact for small meshes, learned for large ones"),
            ("segment", "Learned", "Small; a small part of its answers is wrong"),
            ("exact", "Exact", "No answer is wrong"),
            ("bvh", "Triangles", "No answer is wrong; triangles alone"),
        ],
        default="auto",
    )
    preset: EnumProperty(
        name="Preset",
        description="How much time a learned asset is given. Ignored for triangles",
        items=[("fast", "Fast", ""), ("balanced", "Balanced", ""), ("high", "High", "")],
        default="balanced",
    )
    options: StringProperty(name="More", description="More options of nif bake, e.g. --max-error 0.5%")

    job: Optional[BakeJob] = None

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        if not context.selected_objects:
            cls.poll_message_set("Select objects")
            return False
        return context.mode == "OBJECT"

    def work(self, context: bpy.types.Context) -> Iterator[tuple[float, str]]:
        yield 0, "triangles"
        output = bpy.path.abspath(self.filepath)
        # By its name: it may be gone when the bake is done, and another one be shown.
        scene = context.scene.name
        try:
            options = shlex.split(self.options)
        except ValueError as error:
            raise Failure(f"More: {error}") from None
        if self.encoding != "bvh":
            options = ["--preset", self.preset, *options]
        geometry = collect(context.evaluated_depsgraph_get(), context.selected_objects)
        triangles = geometry.triangle_count()
        try:
            self.job = BakeJob(find_program(context), geometry, output, ["--encoding", self.encoding, *options])
            del geometry
            while not self.job.done():
                left = f"   {self.job.left}" if self.job.left else ""
                yield self.job.fraction, self.job.text + left
                time.sleep(POLL)
            report = self.job.result()
        except BakeError as error:
            raise Failure(str(error)) from None
        baked = bpy.data.scenes.get(scene)
        if baked is not None:
            baked.nifkit.asset = output
        errors = [entry["error"] for entry in report.get("sets", {}).values()]
        worst = f", at most {100 * max(errors):.2f} % of answers wrong" if errors else ""
        self.report({"INFO"}, f"{os.path.basename(output)}: {triangles:,} triangles in {report['bytes']['file']:,} bytes{worst}")

    def undo(self) -> None:
        if self.job:
            self.job.cancel()


def register() -> None:
    bpy.utils.register_class(NIFKIT_OT_bake)


def unregister() -> None:
    bpy.utils.unregister_class(NIFKIT_OT_bake)
