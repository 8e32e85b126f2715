#!/usr/bin/env python3
"""Writes what fuzz_scene starts with; the first byte says what the rest is (tests/fuzz/fuzz_scene.cpp).

    tests/corpus/make_scene.py FOLDER
"""
import pathlib
import struct
import sys
import zlib

MANIFEST, RECORD, SCENE, ENVIRONMENT, CHECKPOINT = range(5)

MANIFEST_TEXT = '''output = "out/{folder}/{stem}.nif"
state = "state"
[defaults]
preset = "fast"
resolution = 24
[[asset]]
mesh = ["a.ply", "b/**"]
exclude = "b/c/*"
merge = true
merge-nodes = ["x*", "y"]
[[asset]]
mesh = "b/c/e.obj.gz"
output = "{name}.nif"
seed = 7
max-error = 0.002
'''

RECORD_TEXT = ('{"schema":"nifkit.batch-record/1","name":"a.nif","version":"0.1.0","options":["--seed=1"],'
               '"asset":{"path":"a.nif","size":7,"modified":0,"hash":"00"},'
               '"sources":[{"path":"a.ply","size":1,"modified":0,"hash":"01"}],"report":{"sources":["a.ply"]}}')

SCENE_TEXT = '''up = "z"
[picture]
width = 64
height = 48
samples = 4
bounces = 2
seed = 9
exposure = 1.5
ground_level = 0.5
background = [0.1, 0.2, 0.3]
[[object]]
mesh = "a.ply"
nif = "a.nif"
primary = true
translate = [1, 2, 3]
rotate = [0, 90, 0]
scale = 2
albedo = 0.5
mirror = true
[ground]
albedo = [0.2, 0.3, 0.4]
height = -1
size = 4
[[light]]
type = "sun"
direction = [1, 1, 0]
irradiance = 3
angle = 0.5
[[light]]
type = "sky"
radiance = [1, 1, 1.5]
glow = { direction = [0, 1, 0], radiance = 10, angle = 20 }
sampling = "uniform"
[[light]]
type = "area"
corner = [0, 4, 0]
edge_u = [1, 0, 0]
edge_v = [0, 0, 1]
radiance = 5
[[light]]
type = "point"
position = [0, 1, 0]
intensity = 2
[[light]]
type = "spot"
position = [0, 1, 0]
direction = [0, -1, 0]
intensity = 2
inner_angle = 10
outer_angle = 30
[[camera]]
name = "front"
fov = 45
position = [0, 0, 5]
target = [0, 0, 0]
[[camera]]
azimuth = 10
elevation = 30
fill = 0.9
'''


def radiance():
    row = b"\x02\x02\x00\x08" + b"".join(bytes([136, value]) for value in (10, 20, 30, 129))
    return b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 8\n" + row + row


def flat_radiance():
    return b"#?RGBE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 3\n" + bytes([1, 2, 3, 128] * 3)


def exr(compression, pack):
    """Three pixels in two rows of half precision."""
    def attribute(name, kind, value):
        return name + b"\0" + kind + b"\0" + struct.pack("<i", len(value)) + value

    channels = b"".join(name + b"\0" + struct.pack("<iBxxxii", 1, 0, 1, 1) for name in (b"B", b"G", b"R")) + b"\0"
    box = struct.pack("<iiii", 0, 0, 2, 1)
    header = (b"\x76\x2f\x31\x01" + struct.pack("<I", 2) + attribute(b"channels", b"chlist", channels)
              + attribute(b"compression", b"compression", bytes([compression]))
              + attribute(b"dataWindow", b"box2i", box) + attribute(b"displayWindow", b"box2i", box)
              + attribute(b"lineOrder", b"lineOrder", b"\0") + attribute(b"pixelAspectRatio", b"float", struct.pack("<f", 1))
              + attribute(b"screenWindowCenter", b"v2f", struct.pack("<ff", 0, 0))
              + attribute(b"screenWindowWidth", b"float", struct.pack("<f", 1)) + b"\0")
    row = pack(struct.pack("<9e", 0.5, 1, 2, 0.25, 0.5, 0.75, 1, 1, 1))
    first = len(header) + 16
    return (header + struct.pack("<QQ", first, first + 8 + len(row)) + struct.pack("<ii", 0, len(row)) + row
            + struct.pack("<ii", 1, len(row)) + row)


def zipped(row):
    """As OpenEXR's ZIPS does it: even bytes, odd bytes, differences, zlib; as it is where that is not smaller."""
    mixed = bytearray(row[0::2] + row[1::2])
    for i in range(len(mixed) - 1, 0, -1):
        mixed[i] = (mixed[i] - mixed[i - 1] + 128) & 255
    packed = zlib.compress(bytes(mixed))
    return packed if len(packed) < len(row) else row


def checkpoint():
    """Two trainings of a bake: one that has ended, one in the middle."""
    return struct.pack("<Q", 2) + b"".join(
        struct.pack("<Q", len(name)) + name + struct.pack("<BQ", ended, len(state)) + state
        for name, ended, state in ((b"ball", 1, bytes(range(24))), (b"box", 0, bytes(40))))


def main(folder):
    folder.mkdir(parents=True, exist_ok=True)
    for name, kind, content in (("manifest", MANIFEST, MANIFEST_TEXT.encode()), ("record", RECORD, RECORD_TEXT.encode()),
                                ("scene", SCENE, SCENE_TEXT.encode()), ("hdr", ENVIRONMENT, radiance()),
                                ("flat-hdr", ENVIRONMENT, flat_radiance()),
                                ("exr", ENVIRONMENT, exr(0, lambda row: row)), ("zip-exr", ENVIRONMENT, exr(2, zipped)),
                                ("checkpoint", CHECKPOINT, checkpoint())):
        (folder / name).write_bytes(bytes([kind]) + content)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(pathlib.Path(sys.argv[1]))
