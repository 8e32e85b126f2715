"""Compares pictures of equal size, and puts them side by side. Blender runs it, because it can read pictures:

    blender -b --factory-startup -P compare.py -- FIRST.png OTHER.png... BESIDE.png

Prints "psnr OTHER N" for each other picture, in decibels over 8-bit values ("inf": equal), and writes all to BESIDE.png.
"""
import array
import math
import os
import sys

import bpy


def pixels(path: str) -> tuple[list[int], array.array]:
    """Size, and red, green, blue, alpha of each pixel, row by row from the bottom; 0 to 1, as in the file."""
    image = bpy.data.images.load(os.path.abspath(path))
    values = array.array("f", bytes(4 * len(image.pixels)))
    image.pixels.foreach_get(values)
    return list(image.size), values


def psnr(first: array.array, other: array.array) -> float:
    # Alpha is the same in all pictures, so it is ignored.
    squares = math.fsum((a - b) ** 2 for k, (a, b) in enumerate(zip(first, other)) if k % 4 != 3)
    return math.inf if squares == 0 else -10 * math.log10(squares / (len(first) // 4 * 3))


def beside(size: list[int], pictures: list[array.array], path: str) -> None:
    width, height = size
    image = bpy.data.images.new("beside", width * len(pictures), height)
    joined = array.array("f")
    for row in range(height):
        for picture in pictures:
            joined.extend(picture[4 * width * row : 4 * width * (row + 1)])
    image.pixels.foreach_set(joined)
    image.file_format, image.filepath_raw = "PNG", os.path.abspath(path)
    image.save()


def main() -> None:
    *paths, out = sys.argv[sys.argv.index("--") + 1 :]
    read = [pixels(path) for path in paths]
    size, first = read[0]
    for path, (other_size, other) in zip(paths[1:], read[1:]):
        if other_size != size:
            raise ValueError(f"{path} differs in size from {paths[0]}")
        print(f"psnr {os.path.basename(path)} {psnr(first, other):.2f}")
    beside(size, [picture for _, picture in read], out)


try:
    main()
except Exception as error:  # else Blender would end with 0
    print(f"compare.py: {error}", file=sys.stderr)
    sys.exit(1)
