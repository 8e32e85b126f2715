"""The operators that show on a mesh what its asset answers, beside Blender's own rays: errors, and ambient occlusion."""
from typing import Any, Iterator, Optional

import bpy
from bpy.props import BoolProperty, FloatProperty, IntProperty

from .asset import Asset, package
from .geometry import collect
from .long_operator import Failure, LongOperator
from .paint import ASSET, BLENDER, ERRORS, canvas, color_of_share, paint, show

CHUNK = 1 << 15  # rays between two looks at the window: some hundredths of a second
FAR = 1e30


class Measured(LongOperator):
    """Sends rays from each vertex of the active object into the half space above it, through the asset and through the
    triangles of the selected objects, which the asset was baked from."""

    rays: IntProperty(name="Rays", description="Rays from each vertex", default=32, min=1, max=4096)
    distance: FloatProperty(
        name="Distance", description="How far the rays go; 0: without end", default=0, min=0, subtype="DISTANCE"
    )

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        thing = context.object
        if thing is None or thing.type != "MESH" or not thing.select_get():
            cls.poll_message_set("Select the objects that the asset was baked from; the active one is shown, and is a mesh")
            return False
        return context.mode == "OBJECT"

    def work(self, context: bpy.types.Context) -> Iterator[tuple[float, str]]:
        yield 0, "triangles"
        package()  # says what is missing, before anything else needs it
        import numpy as np

        from . import sampling

        # By its name: while this works, the user may delete it, undo what made it, or edit it.
        name = context.object.name if context.object else ""
        thing = mesh_object(context, name)
        depsgraph = context.evaluated_depsgraph_get()
        with Asset(bpy.path.abspath(context.scene.nifkit.asset)) as asset:
            geometry = collect(depsgraph, context.selected_objects)
            if not geometry.placements:
                raise Failure("The selected objects have no faces")
            same_box(asset, sampling.box(geometry))
            tree = sampling.triangles_of(geometry)
            evaluated = thing.evaluated_get(depsgraph)
            points, normals = sampling.surface(evaluated.data, evaluated.matrix_world)
            del geometry, thing, depsgraph, evaluated
            shares = {kind: np.zeros(len(points)) for kind in (ASSET, BLENDER, ERRORS)}
            step = max(CHUNK // self.rays, 1)
            for first in range(0, len(points), step):
                part = slice(first, first + step)
                directions = sampling.hemispheres(normals[part], self.rays, first).reshape(-1, 3)
                origins = np.repeat(points[part] + asset.bias * normals[part], self.rays, axis=0)
                # Both are asked about the same numbers, in single precision.
                origins, directions = origins.astype(np.float32), directions.astype(np.float32)
                by_asset = asset.visible(origins, directions, self.distance or FAR)
                by_blender = sampling.visible(tree, origins, directions, self.distance or FAR)
                for kind, seen in ((ASSET, by_asset), (BLENDER, by_blender), (ERRORS, by_asset != by_blender)):
                    shares[kind][part] = seen.reshape(-1, self.rays).mean(axis=1)
                yield first / len(points), "rays"
        wrong = 100 * shares[ERRORS].mean()
        self.show(context, mesh_object(context, name, len(points)), shares)
        self.report({"INFO"}, f"{wrong:.3f} % of {len(points) * self.rays:,} rays answered otherwise than by Blender's own")

    def show(self, context: bpy.types.Context, thing: bpy.types.Object, shares: dict[str, Any]) -> None:
        raise NotImplementedError


def mesh_object(context: bpy.types.Context, name: str, vertices: Optional[int] = None) -> bpy.types.Object:
    """The mesh of this name, if it is still there, with as many vertices, and can be coloured. Raises Failure."""
    thing = context.view_layer.objects.get(name)
    if thing is None or thing.type != "MESH":
        raise Failure(f"{name or 'The active object'} is not there any more")
    if context.mode != "OBJECT":
        raise Failure(f"{name} cannot be coloured in this mode; start again in object mode")
    evaluated = thing.evaluated_get(context.evaluated_depsgraph_get())
    if vertices not in (None, len(evaluated.data.vertices)):
        raise Failure(f"{name} has other vertices than before; start again")
    return thing


def same_box(asset: Asset, box: tuple[Any, Any]) -> None:
    """Refuses an asset that cannot be of these objects. Its own box is a little larger."""
    import numpy as np

    low, high = box
    asset_low, asset_high = np.array(asset.bounds, np.float64)
    size = (high - low).max()
    if ((low < asset_low - 0.001 * size) | (high > asset_high + 0.001 * size)).any() or (
        asset_high - asset_low > high - low + 0.1 * size
    ).any():
        raise Failure("The asset was not baked from the selected objects: it lies elsewhere, or has another size")


class NIFKIT_OT_show_errors(Measured, bpy.types.Operator):
    """Show where the asset answers otherwise than Blender's own rays, as colours of the active object's vertices"""

    bl_idname = "nifkit.show_errors"
    bl_label = "Show Errors"
    bl_options = {"REGISTER", "UNDO"}

    scale: FloatProperty(
        name="Red at", description="Share of wrong answers that is shown in full red", default=0.1, min=0.001, max=1, subtype="FACTOR"
    )

    def show(self, context: bpy.types.Context, thing: bpy.types.Object, shares: dict[str, Any]) -> None:
        with canvas(context, thing) as target:
            paint(target.data, ERRORS, color_of_share(shares[ERRORS] / self.scale))
            show(context, [(target, ERRORS)])


class NIFKIT_OT_show_asset(Measured, bpy.types.Operator):
    """Show how much of the sky each vertex of the active object sees, by the asset and by Blender's own rays"""

    bl_idname = "nifkit.show_asset"
    bl_label = "Show What It Sees"
    bl_options = {"REGISTER", "UNDO"}

    beside: BoolProperty(name="Blender's rays beside", description="Put a copy next to it, with the colours by Blender's own rays", default=True)

    def show(self, context: bpy.types.Context, thing: bpy.types.Object, shares: dict[str, Any]) -> None:
        import numpy as np

        with canvas(context, thing) as target:
            for name in (ASSET, BLENDER):
                paint(target.data, name, np.repeat(shares[name][:, None], 3, axis=1))
            shown = [(target, ASSET)]
            if self.beside:
                copy = target.copy()
                copy.data = target.data.copy()
                copy.name = f"{target.name} by Blender"
                context.collection.objects.link(copy)
                copy.matrix_world.translation.x += 1.2 * target.dimensions.x
                shown.append((copy, BLENDER))
            show(context, shown)


CLASSES = (NIFKIT_OT_show_errors, NIFKIT_OT_show_asset)


def register() -> None:
    for kind in CLASSES:
        bpy.utils.register_class(kind)


def unregister() -> None:
    for kind in reversed(CLASSES):
        bpy.utils.unregister_class(kind)
