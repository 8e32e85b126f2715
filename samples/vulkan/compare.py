#!/usr/bin/env python3
"""Prints how much two PNG pictures differ, as the PSNR in decibels of means over 4 x 4 pixels.

    samples/vulkan/compare.py FIRST.png SECOND.png

Means, because edges and noise matter less than light. Reads 8-bit RGB without interlacing, with nothing but the standard library.
"""
from __future__ import annotations

import math
import struct
import sys
import zlib

SIDE = 4


def read(path: str) -> tuple[int, int, list[bytearray]]:
    with open(path, "rb") as file:
        data = file.read()
    if data[:8] != b"\x89PNG\r\n\x1a\n":
        raise ValueError(f"{path} is not a PNG")
    at, packed, size = 8, b"", None
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at:at + 8])
        body = data[at + 8:at + 8 + length]
        if kind == b"IHDR":
            size = struct.unpack(">IIBBBBB", body)
        elif kind == b"IDAT":
            packed += body
        at += length + 12
    if size is None or size[2:4] != (8, 2) or size[6] != 0:
        raise ValueError(f"{path} is not an 8-bit RGB picture")
    width, height = size[:2]
    stride, raw, rows = 3 * width, zlib.decompress(packed), []
    above = bytearray(stride)
    for y in range(height):
        how = raw[y * (stride + 1)]
        row = bytearray(raw[y * (stride + 1) + 1:(y + 1) * (stride + 1)])
        for i in range(stride):
            left, up, corner = (row[i - 3], above[i], above[i - 3]) if i >= 3 else (0, above[i], 0)
            if how == 1:
                guess = left
            elif how == 2:
                guess = up
            elif how == 3:
                guess = (left + up) // 2
            elif how == 4:
                guess = min((left, up, corner), key=lambda value: abs(left + up - corner - value))
            else:
                guess = 0
            row[i] = row[i] + guess & 255
        rows.append(row)
        above = row
    return width, height, rows


def psnr(first: str, second: str) -> float:
    (width, height, a), (other_width, other_height, b) = read(first), read(second)
    if (width, height) != (other_width, other_height):
        raise ValueError("the pictures differ in size")
    squares, count = 0.0, 0
    for top in range(0, height - SIDE + 1, SIDE):
        for left in range(0, width - SIDE + 1, SIDE):
            for channel in range(3):
                difference = sum(a[top + v][3 * (left + u) + channel] - b[top + v][3 * (left + u) + channel]
                                 for v in range(SIDE) for u in range(SIDE))
                squares += (difference / SIDE**2 / 255) ** 2
                count += 1
    return -10 * math.log10(squares / count) if squares else math.inf


def main() -> int:
    if len(sys.argv) != 3:
        print(__doc__, file=sys.stderr)
        return 2
    print(f"{psnr(sys.argv[1], sys.argv[2]):.1f}")
    return 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except (OSError, ValueError, struct.error, zlib.error) as error:
        print(f"compare.py: {error}", file=sys.stderr)
        sys.exit(1)
