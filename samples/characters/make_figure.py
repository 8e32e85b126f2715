#!/usr/bin/env python3
"""Makes a small character that bends, and a place to walk in: make_figure.py FOLDER writes figure.glb and plaza.glb there.

The figure has a skin of 17 joints with four weights a vertex, and the clip `walk`. It faces +z, y points up, the unit is the
metre. The same bytes each time. Needs nothing but Python.
"""
import json
import math
import struct
import sys
from pathlib import Path

# Joints: name, parent, and where they are at rest relative to it.
JOINTS = [
    ("hips", None, (0, 0.93, 0)),
    ("spine", "hips", (0, 0.16, 0)),
    ("chest", "spine", (0, 0.2, 0)),
    ("neck", "chest", (0, 0.22, -0.01)),
    ("head", "neck", (0, 0.09, 0.015)),
]
for side, sign in (("left", 1), ("right", -1)):
    JOINTS += [
        (f"{side} arm", "chest", (0.185 * sign, 0.14, 0)),
        (f"{side} forearm", f"{side} arm", (0.03 * sign, -0.28, 0)),
        (f"{side} hand", f"{side} forearm", (0.02 * sign, -0.26, 0.01)),
        (f"{side} leg", "hips", (0.1 * sign, -0.05, 0)),
        (f"{side} shin", f"{side} leg", (0, -0.42, 0.01)),
        (f"{side} foot", f"{side} shin", (0, -0.4, -0.02)),
    ]
NUMBER = {name: number for number, (name, _, _) in enumerate(JOINTS)}
MATERIALS = [
    ("skin", (0.72, 0.47, 0.34)),
    ("shirt", (0.75, 0.21, 0.12)),
    ("trousers", (0.1, 0.15, 0.27)),
    ("shoes", (0.06, 0.045, 0.04)),
    ("hair", (0.09, 0.05, 0.03)),
]
SECONDS, KEYS = 1.0, 24  # of the clip


def place(name):
    """Where a joint is at rest."""
    _, parent, offset = JOINTS[NUMBER[name]]
    above = place(parent) if parent else (0, 0, 0)
    return tuple(a + b for a, b in zip(above, offset))


def mix(a, b, share):
    return tuple((1 - share) * x + share * y for x, y in zip(a, b))


def smooth(share):
    share = min(max(share, 0), 1)
    return share * share * (3 - 2 * share)


class Mesh:
    """Closed tubes, each of one material."""

    def __init__(self):
        self.positions, self.weights, self.triangles = [], [], {}

    def tube(self, material, rings, sides=18):
        """rings: middle, two half-axes as vectors, and a list of (joint, weight). Both ends get a vertex in the middle."""
        first = len(self.positions)
        triangles = self.triangles.setdefault(material, [])
        for middle, across, along, weights in rings:
            for side in range(sides):
                angle = 2 * math.pi * side / sides
                self.positions.append(
                    tuple(m + math.cos(angle) * a + math.sin(angle) * b for m, a, b in zip(middle, across, along))
                )
                self.weights.append(weights)
        for ring in (0, len(rings) - 1):
            self.positions.append(tuple(rings[ring][0]))
            self.weights.append(rings[ring][3])
        low, high = len(self.positions) - 2, len(self.positions) - 1
        for side in range(sides):
            following = (side + 1) % sides
            last = first + sides * (len(rings) - 1)
            triangles.append((low, first + following, first + side))
            triangles.append((high, last + side, last + following))
            for ring in range(len(rings) - 1):
                a, b = first + sides * ring, first + sides * (ring + 1)
                triangles.append((a + side, a + following, b + following))
                triangles.append((a + side, b + following, b + side))


def profile(points, at):
    """A smooth curve through (place, value) pairs, at a place between the first and the last."""
    for (x0, y0), (x1, y1) in zip(points, points[1:]):
        if at <= x1:
            return y0 + smooth((at - x0) / (x1 - x0)) * (y1 - y0)
    return points[-1][1]


def limb(mesh, material, joints, points, begin, end, steps, flat=1.0):
    """A tube along a chain of joints. Its place is counted in bones: from 1 to 2 it follows the second bone. points: radii."""
    places = [place(name) for name in joints]
    rings = []
    for step in range(steps + 1):
        # The ends are round: rings get closer to each other as they get smaller.
        at = begin + (end - begin) * (1 - math.cos(math.pi * step / steps)) / 2
        bone = min(int(max(at, 0)), len(places) - 2)
        middle = mix(places[bone], places[bone + 1], at - bone)
        radius = profile(points, at)
        # Around a joint both bones have a share.
        joint = min(max(round(at), 1), len(joints) - 1)
        share = smooth((at - joint) / 0.36 + 0.5)
        weights = [(joints[joint - 1], 1 - share), (joints[joint], share)]
        rings.append((middle, (0, 0, radius * flat), (radius, 0, 0), weights))
    mesh.tube(material, rings[::-1])


def round_tube(mesh, material, joint, middle, axis, radii, steps=12):
    """An ellipsoid that one joint moves, along an axis (1: y, 2: z). radii: along x, y, z."""
    rings = []
    other = 3 - axis
    for step in range(1, steps):
        angle = math.pi * step / steps
        at = list(middle)
        at[axis] -= math.cos(angle) * radii[axis]
        across, along = [0, 0, 0], [0, 0, 0]
        across[0], along[other] = math.sin(angle) * radii[0], math.sin(angle) * radii[other]
        # So that the tube's outside is outside.
        rings.append((at, along, across, [(joint, 1)]) if axis == 1 else (at, across, along, [(joint, 1)]))
    mesh.tube(material, rings)


def figure():
    mesh = Mesh()
    # The trunk: by height, half its width, half its depth.
    trunk = [(0.8, 0.05, 0.05), (0.86, 0.15, 0.1), (0.95, 0.165, 0.115), (1.08, 0.135, 0.095), (1.22, 0.155, 0.105),
             (1.36, 0.19, 0.115), (1.44, 0.17, 0.095), (1.5, 0.075, 0.06)]
    spine = ["hips", "spine", "chest", "neck"]
    heights = [place(name)[1] for name in spine]

    def ring(height):
        width = profile([(y, x) for y, x, _ in trunk], height)
        depth = profile([(y, z) for y, _, z in trunk], height)
        above = next((k for k in range(1, 4) if height < heights[k]), 3)
        share = smooth((height - heights[above - 1]) / (heights[above] - heights[above - 1]))
        return (0, height, -0.01), (0, 0, depth), (width, 0, 0), [(spine[above - 1], 1 - share), (spine[above], share)]

    mesh.tube("trousers", [ring(0.8 + 0.19 * k / 8) for k in range(9)], 24)
    mesh.tube("shirt", [ring(0.95 + 0.55 * k / 20) for k in range(21)], 24)
    neck = place("neck")
    mesh.tube("skin", [((0, neck[1] - 0.06 + 0.03 * k, -0.005), (0, 0, 0.052), (0.055, 0, 0),
                        [("neck", 1 - smooth(k / 6)), ("head", smooth(k / 6))]) for k in range(7)])
    head = place("head")
    round_tube(mesh, "skin", "head", (0, head[1] + 0.1, 0.01), 1, (0.085, 0.125, 0.105))
    round_tube(mesh, "skin", "head", (0, head[1] + 0.085, 0.113), 1, (0.014, 0.025, 0.022), 6)  # a nose
    round_tube(mesh, "hair", "head", (0, head[1] + 0.135, -0.015), 1, (0.094, 0.105, 0.107))
    for side in ("left", "right"):
        arm = [f"{side} arm", f"{side} forearm", f"{side} hand"]
        sleeve = [(-0.25, 0.01), (-0.12, 0.062), (0.1, 0.07), (0.8, 0.053), (1, 0.05), (1.12, 0.049)]
        limb(mesh, "shirt", arm, sleeve, -0.25, 1.12, 18)
        limb(mesh, "skin", arm, [(0.9, 0.042), (1.25, 0.042), (1.9, 0.028), (2, 0.026)], 0.9, 2, 14)
        hand = place(arm[2])
        round_tube(mesh, "skin", arm[2], (hand[0], hand[1] - 0.07, hand[2] + 0.01), 1, (0.024, 0.085, 0.045))
        leg = [f"{side} leg", f"{side} shin", f"{side} foot"]
        cloth = [(-0.2, 0.01), (-0.1, 0.07), (0.1, 0.092), (0.9, 0.064), (1.05, 0.062), (1.3, 0.064), (1.93, 0.048)]
        limb(mesh, "trousers", leg, cloth, -0.2, 1.93, 26)
        foot = place(leg[2])
        round_tube(mesh, "shoes", leg[2], (foot[0], foot[1] - 0.03, foot[2] + 0.055), 2, (0.048, 0.048, 0.135))
    return mesh


def turned(axis, angle):
    """A quaternion, as glTF has it."""
    sine = math.sin(angle / 2)
    return (sine if axis == 0 else 0, sine if axis == 1 else 0, sine if axis == 2 else 0, math.cos(angle / 2))


def walk(phase):
    """Rotations by joint, and how high the hips are, at a phase from 0 to 2 pi."""
    pose = {}
    for side, sign in (("left", 1), ("right", -1)):
        swing = math.sin(phase) * sign
        lift = max(0, math.cos(phase) * sign)  # the leg that comes forward
        pose[f"{side} leg"] = turned(0, -0.42 * swing - 0.1 * lift)
        pose[f"{side} shin"] = turned(0, 0.12 + 0.85 * lift**1.5)
        pose[f"{side} foot"] = turned(0, -0.1 - 0.14 * swing + 0.1 * lift)
        pose[f"{side} arm"] = turned(0, 0.5 * swing)
        pose[f"{side} forearm"] = turned(0, -0.35 - 0.25 * max(0, -swing))
    pose["hips"] = turned(1, 0.1 * math.sin(phase))
    pose["spine"] = turned(0, 0.04)
    pose["chest"] = turned(1, -0.22 * math.sin(phase))
    pose["head"] = turned(1, 0.12 * math.sin(phase))
    return pose, -0.03 + 0.022 * math.cos(2 * phase)


class Glb:
    """A binary glTF that grows by accessors."""

    def __init__(self):
        self.binary, self.views, self.accessors = b"", [], []

    def add(self, rows, kind, component=5126, bounds=False):
        flat = [value for row in rows for value in (row if isinstance(row, (tuple, list)) else (row,))]
        letter = {5126: "f", 5125: "I", 5121: "B"}[component]
        data = struct.pack(f"<{len(flat)}{letter}", *flat)
        self.views.append({"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(data)})
        self.binary += data + bytes(-len(data) % 4)
        accessor = {"bufferView": len(self.views) - 1, "componentType": component, "count": len(rows), "type": kind}
        if bounds:
            single = [struct.unpack("<f", struct.pack("<f", value))[0] for value in flat]
            width = len(flat) // len(rows)
            accessor["min"] = [min(single[k::width]) for k in range(width)]
            accessor["max"] = [max(single[k::width]) for k in range(width)]
        self.accessors.append(accessor)
        return len(self.accessors) - 1

    def write(self, path, document):
        document = {"asset": {"version": "2.0", "generator": "samples/characters/make_figure.py"}, "scene": 0, **document}
        document.update(accessors=self.accessors, bufferViews=self.views, buffers=[{"byteLength": len(self.binary)}])
        text = json.dumps(document, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        length = 12 + 8 + len(text) + 8 + len(self.binary)
        path.write_bytes(
            struct.pack("<4sIII4s", b"glTF", 2, length, len(text), b"JSON") + text + struct.pack("<I4s", len(self.binary), b"BIN\0")
            + self.binary
        )


def material(name, colour):
    return {"name": name, "pbrMetallicRoughness": {"baseColorFactor": [*colour, 1], "metallicFactor": 0}}


def write_figure(path):
    mesh, glb = figure(), Glb()
    weights, joints = [], []
    for pairs in mesh.weights:
        kept = [(name, weight) for name, weight in pairs if weight > 0]
        kept += [(kept[0][0], 0)] * (4 - len(kept))
        joints.append(tuple(NUMBER[name] for name, _ in kept))
        weights.append(tuple(weight for _, weight in kept))
    attributes = {
        "POSITION": glb.add(mesh.positions, "VEC3", bounds=True),
        "JOINTS_0": glb.add(joints, "VEC4", 5121),
        "WEIGHTS_0": glb.add(weights, "VEC4"),
    }
    names = [name for name, _ in MATERIALS]
    primitives = [
        {"attributes": attributes, "material": names.index(name),
         "indices": glb.add([corner for triangle in triangles for corner in triangle], "SCALAR", 5125)}
        for name, triangles in mesh.triangles.items()
    ]
    nodes = []
    for name, _, offset in JOINTS:
        children = [number for number, (_, parent, _) in enumerate(JOINTS) if parent == name]
        nodes.append({"name": name, "translation": offset, **({"children": children} if children else {})})
    nodes.append({"name": "figure", "mesh": 0, "skin": 0})
    inverses = []  # column by column
    for name, _, _ in JOINTS:
        x, y, z = place(name)
        inverses.append((1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, -x, -y, -z, 1))
    times = [SECONDS * key / KEYS for key in range(KEYS + 1)]
    poses = [walk(2 * math.pi * key / KEYS) for key in range(KEYS + 1)]
    clock = glb.add(times, "SCALAR", bounds=True)
    samplers, channels = [], []

    def animate(name, what, rows, kind):
        samplers.append({"input": clock, "output": glb.add(rows, kind), "interpolation": "LINEAR"})
        channels.append({"sampler": len(samplers) - 1, "target": {"node": NUMBER[name], "path": what}})

    for name in poses[0][0]:
        animate(name, "rotation", [pose[name] for pose, _ in poses], "VEC4")
    x, y, z = JOINTS[0][2]
    animate("hips", "translation", [(x, y + rise, z) for _, rise in poses], "VEC3")
    glb.write(path, {
        "scenes": [{"nodes": [0, len(nodes) - 1]}],
        "nodes": nodes,
        "meshes": [{"name": "figure", "primitives": primitives}],
        "materials": [material(name, colour) for name, colour in MATERIALS],
        "skins": [{"joints": list(range(len(JOINTS))), "inverseBindMatrices": glb.add(inverses, "MAT4")}],
        "animations": [{"name": "walk", "samplers": samplers, "channels": channels}],
    })


def box(low, high):
    corners = [tuple((high if corner >> axis & 1 else low)[axis] for axis in range(3)) for corner in range(8)]
    return corners, [(0, 2, 3), (0, 3, 1), (4, 5, 7), (4, 7, 6), (0, 1, 5), (0, 5, 4), (2, 6, 7), (2, 7, 3), (0, 4, 6), (0, 6, 2),
                     (1, 3, 7), (1, 7, 5)]


def column(x, z, radius, low, high, sides=16):
    """A round column that is a little thicker in the middle of its lower half."""
    levels = [(low, 0), (low, 1.25), (low + 0.12, 1.25), (low + 0.14, 1), (low + 0.35 * (high - low), 1.04), (high - 0.2, 0.82),
              (high - 0.18, 1.15), (high, 1.25), (high, 0)]
    corners, triangles = [], []
    for y, size in levels:
        for side in range(sides):
            angle = 2 * math.pi * side / sides
            corners.append((x + radius * size * math.sin(angle), y, z + radius * size * math.cos(angle)))
    for level in range(len(levels) - 1):
        for side in range(sides):
            a, b = sides * level + side, sides * level + (side + 1) % sides
            if levels[level][1]:
                triangles.append((a, b, b + sides))
            if levels[level + 1][1]:
                triangles.append((a, b + sides, a + sides))
    return corners, triangles


def write_plaza(path):
    """A paved square with steps in the middle and a colonnade around a half of it."""
    parts = [("pavement", (0.42, 0.4, 0.36), [box((-16, -0.4, -16), (16, 0, 16))])]
    tiles = []
    for i in range(-8, 8):
        for k in range(-8, 8):
            if (i + k) % 2:
                tiles.append(box((2 * i + 0.03, -0.1, 2 * k + 0.03), (2 * i + 1.97, 0.015, 2 * k + 1.97)))
    parts.append(("tiles", (0.52, 0.47, 0.4), tiles))
    halves = [2.6 - 0.4 * k for k in range(5)]
    steps = [box((-half, 0, -half), (half, 0.16 * (k + 1), half)) for k, half in enumerate(halves)]
    parts.append(("steps", (0.6, 0.57, 0.5), steps))
    parts.append(("obelisk", (0.55, 0.25, 0.17), [box((-0.5, 0.8, -0.5), (0.5, 1.5, 0.5)), column(0, 0, 0.34, 1.5, 5.2, 8)]))
    columns, beams = [], []
    count, radius = 15, 10.5
    for k in range(count):
        angle = math.pi * (0.98 + 1.04 * k / (count - 1))
        columns.append(column(radius * math.cos(angle), radius * math.sin(angle), 0.36, 0, 4.2))
    corners, triangles = [], []
    steps = 48
    for k in range(steps + 1):
        angle = math.pi * (0.96 + 1.08 * k / steps)
        for reach, y in ((radius - 0.5, 4.2), (radius + 0.5, 4.2), (radius + 0.5, 4.9), (radius - 0.5, 4.9)):
            corners.append((reach * math.cos(angle), y, reach * math.sin(angle)))
    for k in range(steps):
        for side in range(4):
            a, b = 4 * k + side, 4 * k + (side + 1) % 4
            triangles += [(a, a + 4, b + 4), (a, b + 4, b)]
    end = 4 * steps
    triangles += [(0, 1, 2), (0, 2, 3), (end, end + 2, end + 1), (end, end + 3, end + 2)]
    beams.append((corners, triangles))
    parts += [("columns", (0.72, 0.68, 0.6), columns), ("beam", (0.72, 0.68, 0.6), beams)]
    glb, meshes, nodes = Glb(), [], []
    for number, (name, _, shapes) in enumerate(parts):
        corners, triangles = [], []
        for shape, faces in shapes:
            triangles += [len(corners) + corner for face in faces for corner in face]
            corners += shape
        meshes.append({"name": name, "primitives": [{
            "attributes": {"POSITION": glb.add(corners, "VEC3", bounds=True)}, "material": number,
            "indices": glb.add(triangles, "SCALAR", 5125)}]})
        nodes.append({"name": name, "mesh": number})
    glb.write(path, {"scenes": [{"nodes": list(range(len(nodes)))}], "nodes": nodes, "meshes": meshes,
                     "materials": [material(name, colour) for name, colour, _ in parts]})


if __name__ == "__main__":
    if len(sys.argv) != 2 or sys.argv[1].startswith("-"):
        print(__doc__.strip(), file=sys.stderr if len(sys.argv) != 2 else sys.stdout)
        sys.exit(0 if sys.argv[1:] in (["--help"], ["-h"]) else 2)
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    write_figure(folder / "figure.glb")
    write_plaza(folder / "plaza.glb")
