"""Rays from the vertices of a mesh into the half space above it, and Blender's own answers about them. Needs numpy."""
from __future__ import annotations

from typing import Any

import bpy
import numpy as np
from mathutils.bvhtree import BVHTree

from .geometry import Geometry

GOLDEN = (5**0.5 - 1) / 2


def surface(mesh: bpy.types.Mesh, matrix: Any) -> tuple[Any, Any]:
    """Points [n, 3] and normals [n, 3], of length 1, of a mesh's vertices in the world."""
    count = len(mesh.vertices)
    points, normals = np.empty((count, 3), np.float32), np.empty((count, 3), np.float32)
    mesh.vertices.foreach_get("co", points.ravel())
    mesh.vertices.foreach_get("normal", normals.ravel())
    matrix = np.array(matrix, np.float64)
    # Of a flat matrix there is no inverse; the adjugate's transpose does the same for normals, but for a mirrored one's sign.
    rows = matrix[:3, :3].T
    turn = np.stack([np.cross(rows[1], rows[2]), np.cross(rows[2], rows[0]), np.cross(rows[0], rows[1])], axis=1)
    turn *= np.sign(np.linalg.det(matrix[:3, :3])) or 1
    normals = normals @ turn.T
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = np.where(length > 0, normals / np.where(length > 0, length, 1), (0, 0, 1))
    return points @ matrix[:3, :3].T + matrix[:3, 3], normals


def hemispheres(normals: Any, count: int, first: int) -> Any:
    """Directions [n, count, 3] around normals [n, 3], as many where more light would come from (cosine). Each vertex has
    the same directions, turned by an angle of its own; `first` is the number of the first one. The same every time."""
    number = np.arange(count)
    height = np.sqrt(1 - (number + 0.5) / count)
    around = np.sqrt(1 - height**2)
    turn = (np.arange(first, first + len(normals)) * GOLDEN)[:, None]
    angle = 2 * np.pi * (number * GOLDEN + turn)
    # Two axes beside each normal, without a place where they jump to nothing (Duff et al. 2017).
    x, y, z = normals.T
    sign = np.where(z < 0, -1.0, 1.0)
    a = -1 / (sign + z)
    b = x * y * a
    side = np.stack([1 + sign * x * x * a, sign * b, -sign * x], axis=1)
    other = np.stack([b, sign + y * y * a, -y], axis=1)
    return (
        (around * np.cos(angle))[..., None] * side[:, None]
        + (around * np.sin(angle))[..., None] * other[:, None]
        + height[:, None] * normals[:, None]
    )


def triangles_of(geometry: Geometry) -> BVHTree:
    """All triangles in the world, for Blender's own rays."""
    corners, numbers, count = [], [], 0
    for placement in geometry.placements:
        part = geometry.parts[placement.part]
        matrix = np.array(placement.matrix, np.float64)
        points = np.frombuffer(part.vertices, np.float32).reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]
        corners += points.tolist()
        numbers += (np.frombuffer(part.triangles, np.int32).reshape(-1, 3) + count).tolist()
        count += len(points)
    return BVHTree.FromPolygons(corners, numbers, all_triangles=True)


def visible(tree: BVHTree, origins: Any, directions: Any, distance: float) -> Any:
    """Blender's answers, [n] of bool; as `Asset.visible`."""
    cast = tree.ray_cast
    answers = (cast(o, d, distance)[3] is None for o, d in zip(origins.tolist(), directions.tolist()))
    return np.fromiter(answers, bool, len(origins))


def box(geometry: Geometry) -> tuple[Any, Any]:
    """Lowest and highest corner, in the world, of the boxes of all placements, as a scene of the asset has them: a part's box
    in its own space, placed."""
    lows, highs = [], []
    for placement in geometry.placements:
        points = np.frombuffer(geometry.parts[placement.part].vertices, np.float32).reshape(-1, 3)
        ends = np.stack([points.min(axis=0), points.max(axis=0)]).astype(np.float64)
        matrix = np.array(placement.matrix, np.float64)
        corners = np.stack(np.meshgrid(*ends.T), axis=-1).reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]
        lows.append(corners.min(axis=0))
        highs.append(corners.max(axis=0))
    return np.min(lows, axis=0), np.max(highs, axis=0)
