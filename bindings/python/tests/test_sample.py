"""samples/python: the picture that comes out, and what is refused."""
import importlib.util
import os
import struct
import subprocess
import sys
import zlib
from pathlib import Path

import numpy as np
import pytest
from conftest import ROOT, golden
from test_bake import CORNERS, SIDES

import nifkit

SAMPLE = ROOT / "samples/python/ambient_occlusion.py"


def run(*arguments: object) -> "subprocess.CompletedProcess[str]":
    return subprocess.run([sys.executable, SAMPLE, *map(str, arguments)], capture_output=True, text=True)


def read_png(path: Path) -> np.ndarray:
    """[height, width, channels] of 8 bits; of the filters, only none is known."""
    data = path.read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    at, packed = 8, b""
    while at < len(data):
        size, kind = struct.unpack(">I4s", data[at : at + 8])
        content = data[at + 8 : at + 8 + size]
        assert struct.unpack(">I", data[at + 8 + size : at + 12 + size])[0] == zlib.crc32(kind + content)
        if kind == b"IHDR":
            width, height, bits, color = struct.unpack(">IIBB", content[:10])
        packed += content if kind == b"IDAT" else b""
        at += 12 + size
    assert bits == 8
    lines = np.frombuffer(zlib.decompress(packed), dtype=np.uint8).reshape(height, -1)
    channels = {0: 1, 2: 3, 6: 4}[color]
    assert lines.shape[1] == 1 + width * channels
    return lines[:, 1:].reshape(height, width, channels)


@pytest.fixture(scope="module")
def meshes(tmp_path_factory):
    """A cube, and a cube that is open on top, as the camera sees it."""
    folder = tmp_path_factory.mktemp("meshes")
    vertices = "".join("v {} {} {}\n".format(*corner) for corner in CORNERS)
    faces = ["f {} {} {}\n".format(*(side + 1)) for side in SIDES]
    (folder / "cube.obj").write_text(vertices + "".join(faces))
    (folder / "open.obj").write_text(vertices + "".join(faces[:6] + faces[8:]))  # without y = 1
    return folder


def test_pictures(meshes, tmp_path):
    pictures = {}
    for name in ("cube", "open"):
        nifkit.bake_file(meshes / f"{name}.obj", tmp_path / f"{name}.nif", encoding="exact", rays=0)
        done = run(tmp_path / f"{name}.nif", "-o", tmp_path / f"{name}.png", "--plain", "--width", 90, "--samples", 32)
        assert done.returncode == 0 and "100.0% of the answers are proven" in done.stderr, done.stderr
        pictures[name] = read_png(tmp_path / f"{name}.png")[..., 0]
        assert pictures[name].shape[1] == 90
    # A cube is convex, so nothing is dark; of the open one the inside is.
    assert (pictures["cube"] == 255).mean() > 0.995
    assert 0.05 < (pictures["open"] < 200).mean() < 0.5
    # The same picture every time.
    run(tmp_path / "open.nif", "-o", tmp_path / "again.png", "--plain", "--width", 90, "--samples", 32)
    assert (tmp_path / "again.png").read_bytes() == (tmp_path / "open.png").read_bytes()


def test_from_a_mesh(meshes, tmp_path):
    done = run(meshes / "open.obj", "-o", tmp_path / "open.png", "--width", 60, "--samples", 4, "--up", "z")
    assert done.returncode == 0, done.stderr
    assert "open.obj: " in done.stderr and "10 triangles" in done.stderr
    if importlib.util.find_spec("matplotlib"):
        # Half of it is in colour.
        head = (tmp_path / "open.png").read_bytes()[16:26]
        assert struct.unpack(">IIBB", head)[0] > 1000
    else:
        assert read_png(tmp_path / "open.png").shape[1:] == (60, 1)


def test_refusals(tmp_path):
    (tmp_path / "text.ply").write_text("no mesh\n")
    for arguments, code, text in (
        ((tmp_path / "none.obj",), 1, "none.obj"),
        ((tmp_path / "text.ply",), 1, "text.ply"),
        ((golden("proof"),), 1, "an asset of the encoding proof leaves rays open"),
        ((golden("single"), "-o", tmp_path / "no_such/a.png", "--width", 9), 1, f"cannot write {tmp_path / 'no_such/a.png'}"),
        ((golden("single"), "--width", 0), 2, "--width takes 1 to 10000"),
        ((), 2, "mesh"),
    ):
        done = run(*arguments)
        assert done.returncode == code and text in done.stderr.splitlines()[-1], done.stderr
        assert "Traceback" not in done.stderr
    assert os.listdir(tmp_path) == ["text.ply"]
