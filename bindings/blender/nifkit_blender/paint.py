"""Colours of a mesh's vertices, and the view that shows them."""
from __future__ import annotations

from contextlib import contextmanager
from typing import Any, Iterator

import bpy

ASSET, BLENDER, ERRORS = "nifkit asset", "nifkit Blender", "nifkit errors"


@contextmanager
def canvas(context: bpy.types.Context, thing: bpy.types.Object) -> Iterator[bpy.types.Object]:
    """The object whose vertices are coloured: `thing`, or, where modifiers change its vertices, a new one in its place that
    has them applied; then `thing` is hidden at the end. If something goes wrong before, the new one is removed."""
    evaluated = thing.evaluated_get(context.evaluated_depsgraph_get())
    if len(evaluated.data.vertices) == len(thing.data.vertices):
        yield thing
        return
    mesh = bpy.data.meshes.new_from_object(evaluated)
    result = bpy.data.objects.new(f"{thing.name} nifkit", mesh)
    try:
        result.matrix_world = thing.matrix_world
        context.collection.objects.link(result)
        yield result
        thing.hide_set(True)
    except BaseException:
        bpy.data.objects.remove(result)
        bpy.data.meshes.remove(mesh)
        raise


def paint(mesh: bpy.types.Mesh, name: str, colors: Any) -> None:
    """Gives each vertex a colour: [n, 3], linear, 0 to 1. Replaces those of an earlier time."""
    import numpy as np

    attribute = mesh.color_attributes.get(name)
    if attribute is None or attribute.domain != "POINT":
        if attribute is not None:
            mesh.color_attributes.remove(attribute)
        attribute = mesh.color_attributes.new(name, "FLOAT_COLOR", "POINT")
    values = np.ones((len(colors), 4), np.float32)
    values[:, :3] = colors
    attribute.data.foreach_set("color", values.ravel())
    mesh.update()


def color_of_share(share: Any) -> Any:
    """Colours [n, 3] of shares [n]: grey for 0, over yellow, to red for 1 and more."""
    import numpy as np

    stops = (0, 0.5, 1)
    return np.stack([np.interp(share, stops, values) for values in ((0.6, 1, 0.8), (0.6, 0.7, 0), (0.6, 0, 0))], axis=1)


def show(context: bpy.types.Context, things: list[tuple[bpy.types.Object, str]]) -> None:
    """Makes these colours the active ones of their meshes, and has the 3D views show them as they are."""
    for thing, name in things:
        colors = thing.data.color_attributes
        colors.active_color = colors[name]
        colors.render_color_index = colors.active_color_index
    for area in context.screen.areas if context.screen else ():
        if area.type == "VIEW_3D":
            shading = area.spaces.active.shading
            shading.type, shading.light, shading.color_type = "SOLID", "FLAT", "VERTEX"
