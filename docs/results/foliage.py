#!/usr/bin/env python3
"""Rounds each leaf of a tree of `nif mesh generate` to so many bits, to find out how many bits a leaf needs.

    docs/results/foliage.py TREE.ply ROUNDED.ply PLACE DIRECTION ROLL SIZE

All leaves of such a tree have one shape: four vertices, turned, scaled and moved. So a leaf is a place, the direction of its rib, the angle
around it, and a size. Writes the tree with these rounded to the given bits (a place and a direction have so many for each of their three and
two numbers), and prints one JSON object: leaves, their bits, and the bytes of all, without those that the order of leaves would take.
"""
from __future__ import annotations

import array
import json
import math
import sys
from pathlib import Path

Vector = tuple[float, float, float]
# Base and end of the rib, left and right, as the two upper and the two lower triangles use them.
LEAF = ((0, 1, 2), (0, 3, 1), (0, 2, 3), (1, 3, 2))


def add(a: Vector, b: Vector, by: float = 1.0) -> Vector:
    return (a[0] + by * b[0], a[1] + by * b[1], a[2] + by * b[2])


def dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vector, b: Vector) -> Vector:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def unit(a: Vector) -> Vector:
    size = math.sqrt(dot(a, a))
    return (a[0] / size, a[1] / size, a[2] / size)


def rounded(x: float, low: float, high: float, bits: int) -> float:
    steps = (1 << bits) - 1
    at = round((min(max(x, low), high) - low) / (high - low) * steps)
    return low + at / steps * (high - low)


def octahedral(n: Vector, bits: int) -> Vector:
    """The direction that is stored as two numbers of so many bits."""
    size = abs(n[0]) + abs(n[1]) + abs(n[2])
    x, y = n[0] / size, n[1] / size
    if n[2] < 0:
        x, y = math.copysign(1 - abs(y), x), math.copysign(1 - abs(x), y)
    x, y = rounded(x, -1, 1, bits), rounded(y, -1, 1, bits)
    z = 1 - abs(x) - abs(y)
    if z < 0:
        x, y = math.copysign(1 - abs(y), x), math.copysign(1 - abs(x), y)
    return unit((x, y, z))


def frame(rib: Vector) -> tuple[Vector, Vector]:
    """Two directions across a rib, from which its roll is counted."""
    x = unit(cross(rib, (0.0, 1.0, 0.0) if abs(rib[1]) < 0.9 else (1.0, 0.0, 0.0)))
    return x, cross(rib, x)


def main() -> int:
    if len(sys.argv) != 7:
        print(__doc__, file=sys.stderr)
        return 2
    source, target = Path(sys.argv[1]), Path(sys.argv[2])
    place_bits, direction_bits, roll_bits, size_bits = map(int, sys.argv[3:])
    data = source.read_bytes()
    end = data.index(b"end_header\n") + len(b"end_header\n")
    counts = [int(line.split()[2]) for line in data[:end].decode().splitlines() if line.startswith("element")]
    positions = array.array("f", data[end : end + 12 * counts[0]])
    faces = data[end + 12 * counts[0] :]

    def corner(face: int, k: int) -> int:
        at = 13 * face + 1 + 4 * k
        return int.from_bytes(faces[at : at + 4], "little")

    first = 0  # of the leaves, which come last
    for face in range(counts[1] - 4, -1, -4):
        rib = corner(face, 0)
        if any(corner(face + t, k) != rib + LEAF[t][k] for t in range(4) for k in range(3)):
            first = face + 4
            break
    leaves = (counts[1] - first) // 4

    def vertex(number: int) -> Vector:
        return (positions[3 * number], positions[3 * number + 1], positions[3 * number + 2])

    # The shape: where left and right are, along the rib, across it and above it, in lengths of the rib.
    ribs = [corner(first + 4 * leaf, 0) for leaf in range(leaves)]
    one = [vertex(ribs[0] + k) for k in range(4)]
    along = add(one[1], one[0], -1)
    size = math.sqrt(dot(along, along))
    across = unit(add(one[2], one[3], -1))
    above = cross(unit(along), across)
    side = add(one[2], one[0], -1)
    shape = (dot(side, unit(along)) / size, dot(side, across) / size, dot(side, above) / size)

    sizes = []
    for rib in ribs:
        along = add(vertex(rib + 1), vertex(rib), -1)
        sizes.append(math.sqrt(dot(along, along)))
    box = [(min(positions[a::3]), max(positions[a::3])) for a in range(3)]
    smallest, largest = min(sizes), max(sizes)
    odd = 0  # leaves of another shape
    for rib, size in zip(ribs, sizes):
        base = vertex(rib)
        along = unit(add(vertex(rib + 1), base, -1))
        across = unit(add(vertex(rib + 2), vertex(rib + 3), -1))
        exact = place(base, along, across, size, shape)
        offs = [add(exact[k], vertex(rib + k), -1) for k in range(4)]
        odd += max(dot(off, off) for off in offs) > (0.01 * size) ** 2
        x, y = frame(along)
        roll = math.atan2(dot(across, y), dot(across, x))
        base = (
            rounded(base[0], *box[0], place_bits),
            rounded(base[1], *box[1], place_bits),
            rounded(base[2], *box[2], place_bits),
        )
        along = octahedral(along, direction_bits)
        x, y = frame(along)
        roll = rounded(roll, -math.pi, math.pi, roll_bits)
        across = add(tuple(c * math.cos(roll) for c in x), y, math.sin(roll))  # type: ignore[arg-type]
        size = rounded(size, smallest, largest, size_bits)
        for k, p in enumerate(place(base, along, across, size, shape)):
            positions[3 * (rib + k) : 3 * (rib + k) + 3] = array.array("f", p)
    if odd > leaves // 1000:
        print(f"{source}: {odd} of {leaves} leaves have another shape", file=sys.stderr)
        return 1
    target.write_bytes(data[:end] + positions.tobytes() + faces)
    bits = 3 * place_bits + 2 * direction_bits + roll_bits + size_bits
    order = math.lgamma(leaves + 1) / math.log(2)
    print(
        json.dumps(
            {
                "leaves": leaves,
                "bits": bits,
                "bytes": round((leaves * bits - order) / 8),
                "other_triangles": first,
            }
        )
    )
    return 0


def place(base: Vector, along: Vector, across: Vector, size: float, shape: Vector) -> list[Vector]:
    """The vertices of a leaf."""
    above = cross(along, across)
    middle = add(add(base, along, shape[0] * size), above, shape[2] * size)
    return [
        base,
        add(base, along, size),
        add(middle, across, shape[1] * size),
        add(middle, across, -shape[1] * size),
    ]


if __name__ == "__main__":
    sys.exit(main())
