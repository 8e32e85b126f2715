"""Baking through the program `nif`. NIF_PROGRAM names it; where it is not built, test.sh leaves this file out."""
import os
import signal
import subprocess
import sys
import threading

import numpy as np
import pytest
from conftest import some_rays
from test_refusals import refused

import nifkit
from nifkit import Encoding, ErrorCode

# A cube from -1 to 1.
CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=np.float64)
SIDES = np.array(
    [[0, 1, 3], [0, 3, 2], [4, 7, 5], [4, 6, 7], [0, 5, 1], [0, 4, 5],
     [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]
)  # fmt: skip
QUICK = {"rays": 0, "preset": "fast", "threads": 1}


def ball(steps: int) -> tuple[np.ndarray, np.ndarray]:
    """A dented sphere of 4 steps^2 triangles."""
    u, v = np.meshgrid(np.linspace(0, 2 * np.pi, 2 * steps, endpoint=False), np.linspace(0.01, np.pi - 0.01, steps + 1))
    radius = 1 + 0.2 * np.sin(5 * u) * np.sin(4 * v)
    vertices = np.stack([np.sin(v) * np.cos(u), np.sin(v) * np.sin(u), np.cos(v)], axis=-1) * radius[..., None]
    number = np.arange(u.size).reshape(u.shape)
    a, b = number[:-1].ravel(), np.roll(number, -1, axis=1)[:-1].ravel()
    c, d = number[1:].ravel(), np.roll(number, -1, axis=1)[1:].ravel()
    return vertices.reshape(-1, 3), np.concatenate([np.stack([a, b, c], axis=1), np.stack([b, d, c], axis=1)])


@pytest.fixture(autouse=True)
def clean(tmp_path, monkeypatch):
    """Temporary files in a folder of their own; none is left."""
    (tmp_path / "temporary").mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "temporary"))
    yield
    assert os.listdir(tmp_path / "temporary") == []


def test_cube(tmp_path):
    with nifkit.bake(CORNERS, SIDES, tmp_path / "cube.nif", name="cube", encoding="exact", **QUICK) as asset:
        (thing,) = asset.objects
        assert thing.name == "cube" and thing.triangles == 12
        assert (thing.bounds == [[-1] * 3, [1] * 3]).all()
        assert asset.metadata["source"]["hash"].startswith("xxh3-64:")
        with nifkit.Scene(asset) as scene:
            origins, directions = some_rays(scene, 5000)
            directions += np.random.default_rng(2).normal(size=directions.shape).astype(np.float32)
            # Slabs, in double precision; rays that graze a side are left out.
            with np.errstate(divide="ignore"):
                t = (np.array([-1, 1])[:, None, None] - origins.astype(float)) / directions.astype(float)
            enter, leave = t.min(axis=0).max(axis=1), t.max(axis=0).min(axis=1)
            clear = np.abs(leave - enter) > 1e-4
            assert clear.mean() > 0.99
            wanted = ~((enter < leave) & (leave > 0))
            assert (scene.visible(origins, directions) == wanted)[clear].all() and 0 < wanted.sum() < 5000
            hits = scene.intersect(origins, directions)
            inside = (np.abs(origins) < 1).all(axis=1)
            at = clear & ~wanted & ~inside
            assert np.allclose(hits.t[at], enter[at], rtol=1e-5)
    # The file is the asset; again, in memory alone, with any types, it has the same bytes.
    content = (tmp_path / "cube.nif").read_bytes()
    assert sorted(os.listdir(tmp_path)) == ["cube.nif", "temporary"]
    nifkit.bake(CORNERS.tolist(), SIDES.astype(np.uint8), tmp_path / "again.nif", name="cube", encoding="exact", **QUICK)
    assert (tmp_path / "again.nif").read_bytes() == content
    with nifkit.bake(CORNERS.astype("f4")[:, ::-1][:, ::-1], SIDES.astype(">i8"), name="cube", encoding="exact", **QUICK) as same:
        assert same.file_bytes == len(content)


def test_far_from_the_origin():
    """At coordinates of a survey, which float32 rounds by a quarter, as beside the origin."""
    here = CORNERS * (4.175, 3.075, 1.525)
    where = np.array([447330.312, 5411990.557, 513.835])
    assert len(np.unique((here + where).astype(np.float32), axis=0)) == 8 and not np.allclose(
        (here + where).astype(np.float32), here + where, rtol=0, atol=0.05
    )
    with nifkit.bake(here + where, SIDES, encoding="exact", **QUICK) as asset:
        (thing,), (placed,) = asset.objects, asset.instances
        assert thing.triangles == 12
        offset = placed.transform[:, 3].astype(float)
        assert np.allclose(thing.bounds + offset, [here[0] + where, here[-1] + where], rtol=0, atol=1e-6)
        with nifkit.Scene(asset) as scene:
            scene.set_origin(offset)
            scene.commit()
            assert np.allclose(scene.bounds, thing.bounds, rtol=0, atol=0.2)
            middle = here.mean(axis=0) + where
            assert not scene.visible(middle - offset, np.eye(3)).any()
        assert (placed.transform[:, :3] == np.eye(3)).all()
    thousandths = np.round((here + where) * 1000).astype(np.int64)
    with nifkit.bake(thousandths, SIDES, encoding="exact", **QUICK) as asset:
        assert asset.objects[0].triangles == 12
        low = asset.objects[0].bounds[0] + asset.instances[0].transform[:, 3].astype(float)
        assert (low == thousandths[0]).all()


def test_colors():
    red_and_blue = np.where(CORNERS[:, :1] < 0, np.uint8((255, 0, 0)), np.uint8((0, 0, 255)))
    for colors in (red_and_blue, red_and_blue / 255):
        with nifkit.bake(CORNERS, SIDES, colors=colors, encoding="exact", **QUICK) as asset:
            assert asset.objects[0].colors
            with nifkit.Scene(asset) as scene:
                hits = scene.intersect([[-5, 0.3, 0.2], [5, 0.3, 0.2]], [[1, 0, 0], [-1, 0, 0]], outputs=("t", "color"))
                assert np.allclose(hits.t, 4) and np.allclose(hits.color, [[1, 0, 0], [0, 0, 1]], atol=0.1)


def test_files(tmp_path):
    lines = ["v " + " ".join(map(str, corner)) for corner in CORNERS] + ["f " + " ".join(map(str, side + 1)) for side in SIDES]
    mesh = tmp_path / "--cube one.obj"  # no option
    mesh.write_text("\n".join(lines) + "\n")
    report = nifkit.bake_file(mesh, tmp_path / "cube.nif", encoding="bvh", rays=2000, source_triangles=True)
    assert report["schema"] == "nifkit.bake/2" and report["triangles"] == 12
    assert all(entry["error"] == 0 for entry in report["sets"].values())
    with nifkit.load(tmp_path / "cube.nif") as asset:
        assert asset.objects[0].encoding is Encoding.BVH and asset.objects[0].source_triangles == 12
        assert asset.file_bytes == report["bytes"]["file"]
    home = os.getcwd()
    os.chdir(tmp_path)
    try:
        # Files are named as the caller sees them.
        nifkit.bake_file("--cube one.obj", "-cube.nif", rays=0, encoding="bvh")
        assert (tmp_path / "-cube.nif").stat().st_size > 0
    finally:
        os.chdir(home)


def test_refusals(tmp_path):
    nan = CORNERS.copy()
    nan[3, 1] = np.nan
    out = tmp_path / "out.nif"
    for arguments, options, code, text in (
        ((nan, SIDES), {}, 17, "mesh.ply: "),
        ((CORNERS * 1e300, SIDES), {}, 17, "mesh.ply: "),
        ((CORNERS, SIDES + 1), {}, 18, "there is no vertex 8; there are 8, from 0 on"),
        ((CORNERS, SIDES - 1), {}, 18, "there is no vertex -1"),
        ((CORNERS, []), {}, None, None),
        ((CORNERS, np.zeros((0, 3), dtype=int)), {}, 16, "mesh.ply: "),
        ((CORNERS, SIDES * 0), {}, 19, "mesh.ply: "),
        ((CORNERS, SIDES), {"preset": "slow"}, 2, "--preset"),
        ((CORNERS, SIDES), {"what_is_this": 3}, 2, "--what-is-this"),
        ((CORNERS, SIDES), {"encoding": "exact", "prefer": "speed"}, 2, "--prefer"),
        ((CORNERS, SIDES), {"encoding": "bvh", "max_bytes": 10}, 50, "--max-bytes"),
    ):
        if code is None:
            with pytest.raises(ValueError, match=r"triangles: an array of shape \(m, 3\) is needed"):
                nifkit.bake(*arguments, out)
            continue
        with refused(code, text) as info:
            nifkit.bake(*arguments, out, **options)
        assert str(tmp_path / "temporary") not in str(info.value)
    for arguments, kind, text in (
        (("abc", SIDES), TypeError, "vertices: an array of numbers"),
        ((CORNERS[:, :2], SIDES), ValueError, r"vertices: an array of shape \(n, 3\)"),
        ((CORNERS, SIDES * 1.0), TypeError, "triangles: an array of integers"),
        ((CORNERS, SIDES[:, :2]), ValueError, r"triangles: an array of shape \(m, 3\)"),
    ):
        with pytest.raises(kind, match=text):
            nifkit.bake(*arguments, out)
    with pytest.raises(ValueError, match="colors: an array of shape"):
        nifkit.bake(CORNERS, SIDES, out, colors=np.zeros((3, 3)))
    with pytest.raises(TypeError, match="colors: an array of uint8 or floats"):
        nifkit.bake(CORNERS, SIDES, out, colors=SIDES)
    with refused(2, "colors: floats have to be from 0 to 1"):
        nifkit.bake(CORNERS, SIDES, out, colors=CORNERS)
    with pytest.raises(ValueError, match="name: 'a/b' cannot be the name of a file"):
        nifkit.bake(CORNERS, SIDES, out, name="a/b")
    for wrong in ("json", "output", "j"):
        with pytest.raises(ValueError, match=f"{wrong} is no option here"):
            nifkit.bake(CORNERS, SIDES, out, **{wrong: "x"})
    for wrong in ("", ["1", ""]):
        with refused(ErrorCode.INVALID_ARGUMENT, "max_error: its value is empty"):
            nifkit.bake(CORNERS, SIDES, out, max_error=wrong)
    with refused(ErrorCode.INVALID_ARGUMENT, "the path of the asset is empty"):
        nifkit.bake(CORNERS, SIDES, "")
    with refused(ErrorCode.INVALID_ARGUMENT, "the path of the mesh is empty"):
        nifkit.bake_file("", out)
    with refused(40, "no_such"):
        nifkit.bake(CORNERS, SIDES, tmp_path / "no_such/out.nif", **QUICK)
    with refused(10, "none.obj"):
        nifkit.bake_file(tmp_path / "none.obj", out)
    assert os.listdir(tmp_path) == ["temporary"]


# Trains for longer than any test waits.
LONG = {"encoding": "segment", "preset": "high", "threads": 1, "rays": 0}


def test_progress_and_cancel(tmp_path):
    seen = []

    def progress(fraction, text):
        seen.append((fraction, text))
        # Nothing is said within the first second.
        return not any(text.startswith("training") for _, text in seen)

    with refused(ErrorCode.CANCELLED, "the bake was cancelled"):
        nifkit.bake(*ball(60), tmp_path / "ball.nif", name="ball", progress=progress, **LONG)
    fractions = [fraction for fraction, _ in seen]
    assert fractions == sorted(fractions) and 0 <= fractions[0] and fractions[-1] < 1
    assert "training ball" in seen[-1][1]
    assert os.listdir(tmp_path) == ["temporary"]

    class Mine(BaseException):
        pass

    def raising(fraction, text):
        raise Mine

    with pytest.raises(Mine):
        nifkit.bake(*ball(60), tmp_path / "ball.nif", progress=raising, **LONG)
    assert os.listdir(tmp_path) == ["temporary"]
    # None goes on.
    calls = []
    with nifkit.bake(CORNERS, SIDES, progress=lambda *said: calls.append(said), encoding="bvh", rays=0):
        assert calls


def test_interrupted(tmp_path):
    """Ctrl-C ends a bake on the main thread, and its program with it."""
    program = f"""
import signal, sys, nifkit
signal.signal(signal.SIGINT, signal.default_int_handler)  # also where the tests' own shell ignores it
sys.path.insert(0, {os.path.dirname(__file__)!r})
from test_bake import LONG, ball
def progress(fraction, text):
    print("at work", flush=True)
nifkit.bake(*ball(60), {str(tmp_path / "out.nif")!r}, progress=progress, **LONG)
"""
    environment = {**os.environ, "TMPDIR": str(tmp_path / "temporary")}
    process = subprocess.Popen(
        [sys.executable, "-c", program], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment
    )
    assert process.stdout.readline() == "at work\n"
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=60)
    assert process.returncode != 0 and said.splitlines()[-1] == "KeyboardInterrupt"
    assert os.listdir(tmp_path) == ["temporary"]


def test_two_at_once():
    found = []
    threads = [
        threading.Thread(target=lambda: found.append(nifkit.bake(CORNERS, SIDES, encoding="bvh", rays=0).file_bytes))
        for _ in range(2)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(found) == 2 and found[0] == found[1]


def run_module(*arguments: str, **environment: str):
    return subprocess.run(
        [sys.executable, "-m", "nifkit", *arguments], capture_output=True, text=True, env={**os.environ, **environment}
    )


def test_module(tmp_path):
    done = run_module("--help")
    assert done.returncode == 0 and "bake" in done.stdout and done.stderr == ""
    done = run_module("info", str(tmp_path / "none.nif"))
    assert done.returncode == 10 and done.stdout == "" and "none.nif" in done.stderr


def test_missing(tmp_path, monkeypatch):
    monkeypatch.setenv("NIF_PROGRAM", "")
    monkeypatch.setenv("PATH", str(tmp_path))
    with refused(ErrorCode.NOT_AVAILABLE, "only the runtime is installed here; baking needs nifkit's program `nif`"):
        nifkit.bake(CORNERS, SIDES)
    done = run_module("bake", NIF_PROGRAM="", PATH=str(tmp_path))
    assert done.returncode == 127 and done.stderr.startswith("nifkit: only the runtime is installed here")
    fake = tmp_path / "nif"
    fake.write_text("#!/bin/no/such\n")
    fake.chmod(0o755)
    assert nifkit.find_program() == str(fake)
    with refused(ErrorCode.NOT_AVAILABLE, f"cannot run {fake}"):
        nifkit.bake(CORNERS, SIDES)
    monkeypatch.setenv("NIF_PROGRAM", str(tmp_path / "none"))
    with refused(ErrorCode.NOT_AVAILABLE, f"NIF_PROGRAM names {tmp_path / 'none'}, which is no program"):
        nifkit.bake(CORNERS, SIDES)
    # One that ends in ways that nif does not.
    monkeypatch.setenv("NIF_PROGRAM", str(fake))
    for script, code, text in (("kill -9 $$", 1, "nif was ended by signal 9"), ("exit 3", 3, "nif ended with 3")):
        fake.write_text(f"#!/bin/sh\n{script}\n")
        with refused(code, text):
            nifkit.bake(CORNERS, SIDES)
    for script in ("true", "echo []", "echo {", r"printf '\377'"):
        fake.write_text(f"#!/bin/sh\n{script}\n")
        with refused(ErrorCode.UNKNOWN, f"{fake} wrote no report that can be read"):
            nifkit.bake(CORNERS, SIDES)
