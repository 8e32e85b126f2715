"""What of a Blender scene is baked: the triangles of the selected objects with their modifiers, each mesh once, and where it
is placed. Needs no numpy: arrays are Python's own."""
from __future__ import annotations

from array import array
from dataclasses import dataclass, field
from typing import Iterator, Optional

import bpy
from mathutils import Matrix

KINDS = {"MESH", "CURVE", "SURFACE", "FONT", "META"}


@dataclass
class Part:
    """A mesh in its own space: `vertices` has x, y, z of each, `triangles` three numbers of vertices for each."""

    name: str
    vertices: array
    triangles: array


@dataclass
class Placement:
    """A part in the world."""

    part: int
    name: str
    matrix: Matrix


@dataclass
class Geometry:
    parts: list[Part] = field(default_factory=list)
    placements: list[Placement] = field(default_factory=list)

    def triangle_count(self) -> int:
        """Of all placements."""
        return sum(len(self.parts[placement.part].triangles) // 3 for placement in self.placements)


def collect(depsgraph: bpy.types.Depsgraph, selected: list[bpy.types.Object]) -> Geometry:
    """The geometry of these objects and of what they instance, as the viewport shows it. Objects that share a mesh, and
    instances, share a part. What has no triangles is left out."""
    chosen = {thing.original.as_pointer() for thing in selected}
    geometry = Geometry()
    numbers: dict[tuple, Optional[int]] = {}
    for instance in depsgraph.object_instances:
        thing = instance.object
        owner = instance.parent if instance.is_instance else thing
        if owner.original.as_pointer() not in chosen or thing.type not in KINDS:
            continue
        if not instance.is_instance and not instance.show_self:
            continue
        # Modifiers make a mesh of its own for each object. Data of other kinds may be shared by objects that differ.
        key = (thing.type, (thing.data if thing.type == "MESH" else thing.original).as_pointer())
        if key not in numbers:
            part = part_of(thing)
            numbers[key] = None if part is None else len(geometry.parts)
            if part is not None:
                geometry.parts.append(part)
        number = numbers[key]
        if number is not None:
            geometry.placements.append(Placement(number, thing.name, instance.matrix_world.copy()))
    return geometry


def part_of(thing: bpy.types.Object) -> Optional[Part]:
    """The triangles of an evaluated object; None if it has none."""
    try:
        mesh = thing.to_mesh()
    except RuntimeError:  # e.g. the members of a family of metaballs but one
        return None
    if mesh is None:
        return None
    try:
        mesh.calc_loop_triangles()
        if not mesh.loop_triangles:
            return None
        vertices = array("f", bytes(12 * len(mesh.vertices)))
        mesh.vertices.foreach_get("co", vertices)
        triangles = array("i", bytes(12 * len(mesh.loop_triangles)))
        mesh.loop_triangles.foreach_get("vertices", triangles)
        return Part(thing.data.name, vertices, triangles)
    finally:
        thing.to_mesh_clear()


