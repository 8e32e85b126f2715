#!/usr/bin/env python3
"""A mesh in, a picture of its ambient occlusion out: baked, viewed and lit only through nifkit.

    samples/python/ambient_occlusion.py MESH [-o PICTURE.png]      a mesh in any format that `nif bake` reads, or a .nif file

With matplotlib the picture has a second half: how much of each pixel is proven. In cells, for notebooks (`# %%`).
"""
import argparse
import importlib.util
import struct
import sys
import tempfile
import time
import zlib
from pathlib import Path

import numpy as np

import nifkit

# %% Options
parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("mesh", type=Path, help="a mesh, or an asset (.nif)")
parser.add_argument("-o", "--output", type=Path, default=Path("ambient_occlusion.png"), help="the picture, a PNG")
parser.add_argument("--width", type=int, default=720, help="pixels (720)")
parser.add_argument("--samples", type=int, default=64, help="rays per pixel (64)")
parser.add_argument("--up", choices="yz", default="y", help="the axis that points up (y)")
parser.add_argument("--preset", default="fast", help="of the bake (fast)")
parser.add_argument("--plain", action="store_true", help="do not use matplotlib")
arguments = parser.parse_args()
if not (1 <= arguments.width <= 10_000 and 1 <= arguments.samples <= 100_000):
    parser.error("--width takes 1 to 10000, --samples 1 to 100000")


def say(text: str) -> None:
    print(text, file=sys.stderr)


# %% The asset: loaded, or baked
def load(path: Path) -> nifkit.Asset:
    if path.suffix == ".nif":
        return nifkit.load(path)
    last = [0.0]

    def progress(fraction: float, text: str) -> None:
        if time.monotonic() - last[0] > 2:
            last[0] = time.monotonic()
            say(f"{fraction:4.0%} {text}")

    with tempfile.TemporaryDirectory() as folder:
        nifkit.bake_file(path, Path(folder) / "asset.nif", preset=arguments.preset, rays=0, progress=progress)
        return nifkit.load(Path(folder) / "asset.nif")


try:
    asset = load(arguments.mesh)
except nifkit.Error as error:
    sys.exit(f"ambient_occlusion.py: {error}")
if any(thing.encoding == nifkit.Encoding.PROOF for thing in asset.objects):
    sys.exit(f"ambient_occlusion.py: {arguments.mesh}: an asset of the encoding proof leaves rays open, for a BVH")
scene = nifkit.Scene(asset)
# Rays start this far from the surface. A scene of objects with different sizes would use the bias of each object hit.
bias = max(thing.bias for thing in asset.objects)
say(f"{arguments.mesh}: {asset.file_bytes:,} bytes, {sum(thing.triangles for thing in asset.objects):,} triangles")

# %% An orthographic camera, from the front, above and to the right
up = np.eye(3)[1 if arguments.up == "y" else 2]
front = np.eye(3)[2] if arguments.up == "y" else -np.eye(3)[1]
toward = -(front + 0.5 * np.cross(up, front) + 0.4 * up)
toward /= np.linalg.norm(toward)
right = np.cross(toward, up)
right /= np.linalg.norm(right)
above = np.cross(right, toward)

low, high = scene.bounds.astype(float)
corners = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
left, top = (corners @ right).min(), (corners @ above).max()
pixel = np.ptp(corners @ right) / arguments.width
height = max(1, round(np.ptp(corners @ above) / pixel))
x = left + pixel * (np.arange(arguments.width) + 0.5)
y = top - pixel * (np.arange(height) + 0.5)
depth = (corners @ toward).min() - pixel
origins = (x[None, :, None] * right + y[:, None, None] * above + depth * toward).astype(np.float32)  # [height, width, 3]

# %% What it sees
start = time.perf_counter()
hits = scene.intersect(origins, toward.tolist(), outputs=("hit", "t", "normal"))
seen = hits.hit
normals = hits.normal[seen]
starts = origins[seen] + hits.t[seen][:, None] * toward.astype(np.float32) + bias * normals

# %% How much of the sky each point sees: rays in directions that the surface receives light from, by their cosines
random = np.random.default_rng(1)
light, proven = np.zeros(len(starts)), np.zeros(len(starts))
answers = {name: np.empty(len(starts), dtype=bool) for name in ("visible", "certain")}
for _ in range(arguments.samples):
    directions = random.standard_normal(starts.shape, dtype=np.float32)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    directions += normals
    scene.query(starts, directions, out=answers)
    light += answers["visible"]
    proven += answers["certain"]
seconds = time.perf_counter() - start
rays = seen.size + arguments.samples * len(starts)
say(f"{rays / 1e6:.1f} million rays in {seconds:.1f} s; {proven.mean() / arguments.samples:.1%} of the answers are proven")

occlusion, certainty = np.ones(seen.shape), np.ones(seen.shape)
occlusion[seen], certainty[seen] = light / arguments.samples, proven / arguments.samples


# %% The picture
def write_png(path: Path, picture: np.ndarray) -> None:
    """A grey picture, [height, width], 0 to 1."""
    grey = (255 * picture + 0.5).astype(np.uint8)
    lines = np.concatenate([np.zeros((len(grey), 1), dtype=np.uint8), grey], axis=1)  # each row starts with its filter: none

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = struct.pack(">IIBBBBB", grey.shape[1], grey.shape[0], 8, 0, 0, 0, 0)
    body = zlib.compress(lines.tobytes(), 9)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", body) + chunk(b"IEND", b""))


def write_figure(path: Path) -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    shape = (12, 5.4 * height / arguments.width + 0.4)
    figure = Figure(figsize=shape, layout="constrained")
    FigureCanvasAgg(figure)
    shown = (
        ("Ambient occlusion", np.where(seen, occlusion, np.nan), "gray"),
        ("Answers that are proven", np.where(seen, certainty, np.nan), "viridis"),
    )
    for axes, (title, picture, colors) in zip(figure.subplots(1, 2), shown):
        image = axes.imshow(picture, cmap=colors, vmin=0, vmax=1)
        axes.set_title(title)
        axes.set_axis_off()
    figure.colorbar(image, ax=figure.axes, shrink=0.8)
    figure.savefig(path, dpi=120, metadata={"Software": None})


try:
    if arguments.plain or importlib.util.find_spec("matplotlib") is None:
        write_png(arguments.output, occlusion)
    else:
        write_figure(arguments.output)
except OSError as error:
    sys.exit(f"ambient_occlusion.py: cannot write {arguments.output}: {error.strerror}")
say(f"{arguments.output} is written")
