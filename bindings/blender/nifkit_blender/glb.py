"""Writes geometry as a binary glTF, for `nif bake` to read. Blender's own exporter needs numpy, and takes long for large
meshes. Coordinates are Blender's: z points up, where glTF's own convention would have y."""
from __future__ import annotations

import json
import math
import struct
import sys
from array import array
from pathlib import Path

from .geometry import Geometry

FLOAT, UINT = 5126, 5125
LIMIT = 2**32 - 1  # lengths in a GLB are 32 bits


class Unfit(Exception):
    """What a GLB cannot hold, in one sentence."""


def as_utf8(name: str) -> str:
    """A name of Blender's may have bytes that are no text."""
    return name.encode("utf-8", "replace").decode()


def write(geometry: Geometry, path: Path) -> None:
    """Raises Unfit, or OSError."""
    views, accessors, meshes, payloads = [], [], [], []

    def store(values: array, component: int, kind: str, count: int) -> int:
        """An accessor of these values; all have 4 bytes."""
        offset = views[-1]["byteOffset"] + views[-1]["byteLength"] if views else 0
        views.append({"buffer": 0, "byteOffset": offset, "byteLength": 4 * len(values)})
        accessors.append({"bufferView": len(views) - 1, "componentType": component, "type": kind, "count": count})
        payloads.append(values)
        return len(accessors) - 1

    for part in geometry.parts:
        position = store(part.vertices, FLOAT, "VEC3", len(part.vertices) // 3)
        indices = store(part.triangles, UINT, "SCALAR", len(part.triangles))
        meshes.append({"name": as_utf8(part.name), "primitives": [{"attributes": {"POSITION": position}, "indices": indices}]})
    nodes = []
    for placement in geometry.placements:
        matrix = [value for column in zip(*placement.matrix) for value in column]
        if not all(map(math.isfinite, matrix)):
            raise Unfit(f"{as_utf8(placement.name)}: its place, turn or scale in the world is not finite")
        nodes.append({"name": as_utf8(placement.name), "mesh": placement.part, "matrix": matrix})
    size = sum(view["byteLength"] for view in views)
    head = {
        "asset": {"version": "2.0", "generator": "nifkit for Blender"},
        "scene": 0,
        "scenes": [{"nodes": list(range(len(nodes)))}],
        "nodes": nodes,
        "meshes": meshes,
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": size}],
    }
    text = json.dumps(head, separators=(",", ":"), allow_nan=False).encode()
    text += b" " * (-len(text) % 4)
    if 12 + 8 + len(text) + 8 + size > LIMIT:
        raise Unfit(f"{geometry.triangle_count():,} triangles are more than fit into one file for the bake (4 GiB)")
    with open(path, "wb") as file:
        file.write(struct.pack("<4sII", b"glTF", 2, 12 + 8 + len(text) + 8 + size))
        file.write(struct.pack("<I4s", len(text), b"JSON") + text)
        file.write(struct.pack("<I4s", size, b"BIN\0"))
        for values in payloads:
            if sys.byteorder == "big":
                values = array(values.typecode, values)
                values.byteswap()
            file.write(values)
