"""Answers: those of the golden files, and with the bits of the C library, whatever the layout of the arrays."""
import subprocess
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from conftest import ANSWER, GOLDEN, ROOT, golden, some_rays

import nifkit

ALL = ("visible", "visible_bits", "probability", "certain", "logit")
HITS = nifkit.Hits._fields


def same(one, other) -> None:
    """Two Answers or Hits, to the bit."""
    for name, a, b in zip(one._fields, one, other):
        assert (a is None) == (b is None), name
        assert a is None or (a.dtype == b.dtype and a.tobytes() == b.tobytes()), name


@pytest.mark.parametrize("path", GOLDEN, ids=lambda path: path.stem)
def test_golden(path):
    answers = np.fromfile(path.with_suffix(".answers"), dtype=ANSWER)
    with nifkit.load(path) as asset:
        assert len(answers) >= 300 and set(answers["object"]) == set(range(asset.object_count))
        for number in range(asset.object_count):
            wanted = answers[answers["object"] == number]
            with nifkit.Scene(device=asset.device) as scene:
                assert scene.add_instance(asset, number) == 0
                scene.commit()
                # Columns of the file's records, where they lie.
                rays = (wanted["origin"], wanted["direction"], wanted["tmin"], wanted["tmax"])
                got = scene.query(*rays, outputs=ALL)
            assert (got.visible == wanted["visible"]).all()
            assert (got.certain == wanted["certain"]).all()
            assert (got.logit == wanted["logit"]).all()
            assert (np.unpackbits(got.visible_bits, bitorder="little")[: len(wanted)] == got.visible).all()
            assert ((got.probability == got.visible) | ~got.certain).all()


@pytest.fixture(scope="session")
def c_program(tmp_path_factory):
    """answers.c with the library that the package uses."""
    folder = tmp_path_factory.mktemp("c")
    library = folder / "libnif.so.{}.{}".format(*nifkit._abi.ABI)  # by the name that a program looks for
    library.symlink_to(Path(nifkit._library.lib._name).resolve())
    options = ["-O2", "-Wall", "-Werror", "-I", ROOT / "runtime/include", f"-Wl,-rpath,{folder}"]
    subprocess.run(["cc", *options, Path(__file__).with_name("answers.c"), library, "-o", folder / "answers"], check=True)
    return folder / "answers"


@pytest.mark.parametrize("path", GOLDEN, ids=lambda path: path.stem)
def test_bits_of_c(path, c_program, tmp_path):
    count = 20_000
    with nifkit.load(path) as asset, nifkit.Scene(asset) as scene:
        rays = np.empty((count, 8), dtype=np.float32)  # NifRay: origin, tmin, direction, tmax
        rays[:, :3], rays[:, 4:7] = some_rays(scene, count)
        rays[:, 3], rays[:, 7] = 0, np.inf
        rays[::7, 7] = 0.5
        rays.tofile(tmp_path / "rays")
        subprocess.run([c_program, path, tmp_path / "rays", tmp_path / "answers"], check=True)
        columns = (rays[:, :3], rays[:, 4:7], rays[:, 3], rays[:, 7])
        got = scene.query(*columns, outputs=ALL)
        hits = scene.intersect(*columns, outputs=HITS)
        got_bytes = b"".join(array.tobytes() for array in (*got, *hits))
    assert (tmp_path / "answers").read_bytes() == got_bytes
    assert 0 < np.count_nonzero(hits.hit) < count


def layouts(a: np.ndarray):
    """The same numbers, at other strides."""
    yield np.asfortranarray(a)
    wide = np.full((len(a), 7), np.nan, dtype=np.float32)
    wide[:, 1:6:2] = a
    yield wide[:, 1:6:2]
    yield a[::-1].copy()[::-1]
    yield np.repeat(a, 3, axis=0)[::3]
    yield a[:, ::-1].copy()[:, ::-1]
    packed = np.zeros(len(a), dtype=np.dtype([("odd", "u1"), ("a", "<f4", 3)]))  # not aligned
    packed["a"] = a
    yield packed["a"]
    frozen = a.copy()
    frozen.flags.writeable = False
    yield frozen


def test_strides(networks):
    origins, directions = some_rays(networks, 3000)
    tmax = np.random.default_rng(3).random(3000, dtype=np.float32) * 2
    wanted = networks.query(origins, directions, None, tmax, outputs=ALL)
    assert 0 < wanted.visible.sum() < 3000
    limits = [tmax[::-1].copy()[::-1], np.repeat(tmax, 2)[::2]]
    for i, origin in enumerate(layouts(origins)):
        for direction in layouts(directions):
            same(networks.query(origin, direction, None, limits[i % 2], outputs=ALL), wanted)
    lists = (origins[:5].tolist(), tuple(map(tuple, directions[:5].tolist())), 0, tmax[:5].tolist())
    assert (networks.visible(*lists) == wanted.visible[:5]).all()


def test_nothing_is_copied(scene):
    """Of a batch that takes 4.8 MB, in any layout; numpy tells tracemalloc what it allocates."""
    origins, directions = some_rays(scene, 200_000)
    out = {"visible": np.empty(len(origins), dtype=bool)}
    arrays = [(origin, directions) for origin in layouts(origins)]
    arrays += [(np.broadcast_to(origins[0], origins.shape), np.asfortranarray(directions))]
    tracemalloc.start()
    try:
        for origin, direction in arrays:
            tracemalloc.reset_peak()
            before = tracemalloc.get_traced_memory()[0]
            scene.query(origin, direction, out=out)
            scene.query_async(origin, direction, out=out).wait()
            assert tracemalloc.get_traced_memory()[1] - before < 100_000
    finally:
        tracemalloc.stop()


def test_shapes(networks):
    origins, directions = some_rays(networks, 60)
    flat = networks.query(origins, directions, outputs=ALL)
    image = networks.query(origins.reshape(5, 4, 3, 3), directions.reshape(5, 4, 3, 3), outputs=ALL)
    for name in ("visible", "probability", "certain", "logit"):
        assert getattr(image, name).shape == (5, 4, 3)
    assert image.visible.ravel().tolist() == flat.visible.tolist()
    assert networks.visible(origins[0], directions[0]).shape == ()
    assert networks.visible(origins[0], directions[0]) == flat.visible[0]
    assert networks.intersect(origins[0], directions).normal.shape == (60, 3)
    one = networks.visible(origins, (0, 0, 1), 0, 2.5)
    assert (one == networks.visible(origins, np.tile(np.float32((0, 0, 1)), (60, 1)), tmax=np.full(60, 2.5, "f4"))).all()
    assert networks.visible(origins[:0], directions[:0]).shape == (0,)
    assert networks.visible(np.zeros((0, 3), "f4"), (0, 0, 1)).shape == (0,)
    assert networks.intersect(np.zeros((4, 0, 3), "f4"), (0, 0, 1)).t.shape == (4, 0)
    # Rows of a larger picture have no single stride; each row has.
    cut = origins.reshape(6, 10, 3)[:, 2:7]
    with pytest.raises(ValueError, match=r"origins: rays of shape \(6, 5\) do not lie at one distance"):
        networks.visible(cut, (0, 0, 1))
    rows = np.stack([networks.visible(row, (0, 0, 1)) for row in cut])
    assert (rows == networks.visible(np.ascontiguousarray(cut), (0, 0, 1))).all()
    # Dimensions of length 1 have strides that mean nothing.
    assert networks.visible(origins[:, None][::2], directions[::2][:, None]).shape == (30, 1)


def test_outputs_do_not_change_answers(networks):
    rays = some_rays(networks, 5000)
    wanted = networks.query(*rays, outputs=ALL)
    for name in ALL:
        alone = networks.query(*rays, outputs=name)
        assert [field for field in alone._fields if getattr(alone, field) is not None] == [name]
        assert getattr(alone, name).tobytes() == getattr(wanted, name).tobytes()
    assert (networks.probability(*rays) == wanted.probability).all()
    assert (networks.certain(*rays) == wanted.certain).all()
    assert (networks.visible(*rays) == wanted.visible).all()


def test_out(networks):
    rays = some_rays(networks, 100)
    wanted = networks.query(*rays, outputs=("visible", "logit"))
    out = {"visible": np.full(100, 7, dtype=np.uint8), "logit": np.empty(100, dtype=np.int32)}
    got = networks.query(*rays, out=out)
    assert got.visible is out["visible"] and got.certain is None
    assert (out["visible"] == wanted.visible).all() and (out["logit"] == wanted.logit).all()
    t = np.empty(100, dtype=np.float32)
    assert networks.intersect(*rays, out={"t": t}).t is t
    assert (np.isinf(t) == wanted.visible).all()


def test_isa_and_threads(networks):
    path = golden("networks")
    rays = some_rays(networks, 10_000)
    wanted, hits = networks.query(*rays, outputs=ALL[:2] + ALL[3:]), networks.intersect(*rays, outputs=HITS)
    for options in ({"isa": "scalar"}, {"threads": 1}, {"threads": 3, "queries": 2}, {"memory": "least"}):
        with nifkit.Device(**options) as device, nifkit.load(path, device=device) as asset:
            with nifkit.Scene(device=device) as scene:
                scene.add_instance(asset)
                scene.commit()
                same(scene.query(*rays, outputs=ALL[:2] + ALL[3:]), wanted)
                same(scene.intersect(*rays, outputs=HITS), hits)


def test_fallback(networks):
    origins, directions = some_rays(networks, 20_000)
    learned = networks.query(origins, directions, outputs=ALL)
    open_ = np.flatnonzero(~learned.certain)
    assert len(open_) > 100
    asked = []

    def other(rays, visible):
        assert rays.dtype == np.int64 and visible.dtype == bool and 1 <= len(rays) == len(visible) <= 1024
        assert (visible == learned.visible[rays]).all()
        asked.append(rays)
        return ~visible

    got = networks.query_with_fallback(origins, directions, outputs=ALL, fallback=other)
    assert np.array_equal(np.sort(np.concatenate(asked)), open_)
    assert got.certain.all()
    assert (got.visible != learned.visible).nonzero()[0].tolist() == open_.tolist()
    assert (got.probability == got.visible).all()
    asked.clear()
    p = learned.probability
    networks.query_with_fallback(origins, directions, fallback=other, confidence=0.9)
    unsure = np.flatnonzero(~learned.certain & (np.maximum(p, 1 - p) < np.float32(0.9)))
    assert 0 < len(unsure) < len(open_)
    assert np.array_equal(np.sort(np.concatenate(asked)), unsure)
    asked.clear()
    same(networks.query_with_fallback(origins, directions, outputs=ALL, fallback=other, confidence=0.5), learned)
    assert not asked
    # Lists of 0 and 1 will do.
    got = networks.query_with_fallback(origins, directions, fallback=lambda rays, visible: [1] * len(rays))
    assert got.visible[open_].all()


def test_fallback_of_full_batches():
    """1,024 answers at once are as many as numpy has no memory of its own for: what it frees, free() writes into."""
    with nifkit.Device(threads=1) as device, nifkit.load(golden("networks"), device=device) as asset:
        with nifkit.Scene(device=device) as scene:
            scene.add_instance(asset)
            scene.commit()
            origins, directions = some_rays(scene, 20_000)
            open_ = np.resize(np.flatnonzero(~scene.certain(origins, directions)), 8 * 1024)
            asked = []

            def nothing(rays, visible):
                asked.append(len(rays))
                return np.zeros(len(rays), dtype=bool)

            assert not scene.query_with_fallback(origins[open_], directions[open_], fallback=nothing).visible.any()
            assert asked == [1024] * 8


def test_query_open(networks):
    origins, directions = some_rays(networks, 20_000)
    learned = networks.query(origins, directions, outputs=ALL)
    found = networks.query_open(origins, directions, 0, 5, outputs=ALL)
    everything = networks.query(origins, directions, 0, 5, outputs=ALL)
    assert np.array_equal(np.sort(found.rays), np.flatnonzero(~everything.certain))
    assert len(found.rays) == len(found.tmin) == len(found.tmax) > 100
    assert (found.tmin >= 0).all() and (found.tmax <= 5).all() and (found.tmin <= found.tmax).all()
    assert (found.answers.probability[found.rays] == 0.5).all()
    assert (found.instance == 0).all()
    closed = found.answers.certain
    assert (found.answers.visible[closed] == everything.visible[closed]).all()
    assert len(networks.query_open(origins[:0], directions[:0]).rays) == 0
    assert learned.visible.any()


def test_jobs(networks):
    rays = some_rays(networks, 50_000)
    wanted, hits = networks.query(*rays, outputs=ALL), networks.intersect(*rays)
    jobs = [networks.query_async(*rays, outputs=ALL) for _ in range(4)]
    more = networks.intersect_async(*rays)
    same(more.wait(), hits)
    for job in reversed(jobs):
        same(job.wait(), wanted)
        assert job.done()
        same(job.wait(), wanted)


def test_transforms(scene):
    path = golden("single")
    origins, directions = some_rays(scene, 2000)
    wanted = scene.visible(origins, directions)
    assert 0 < wanted.sum() < 2000
    # A quarter turn and a move, which single precision does exactly.
    turn = np.array([[0, -1, 0, 4], [1, 0, 0, 8], [0, 0, 1, -2]], dtype=np.float32)
    with nifkit.load(path) as asset, nifkit.Scene() as moved:
        assert moved.bounds is None and not moved.committed
        moved.commit()
        assert moved.committed and moved.visible(origins, directions).all()
        assert moved.add_asset(asset, np.vstack([turn, [0, 0, 0, 1]])) == range(0, 1)
        assert not moved.committed
        moved.commit()
        there = (origins @ turn[:, :3].T + turn[:, 3]).astype(np.float32)
        ways = np.ascontiguousarray(directions @ turn[:, :3].T)
        assert (moved.visible(there, ways) != wanted).mean() < 0.02  # rounding of the origins
        moved.set_instance_transform(0, [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0])
        moved.commit()
        assert (moved.visible(origins, directions) == wanted).all()
        assert moved.add_instance(asset, 0, turn) == 1
        moved.commit()
        assert moved.instance_count == 2 and moved.resident_bytes > 0


def test_float64(networks):
    """Is converted; also in layouts that are read where they lie in float32."""
    origins, directions = some_rays(networks, 60)
    wanted = networks.query(origins, directions, 0.25, np.full(60, 3, "f4"), outputs=ALL)
    wide = (origins.astype("f8"), np.asfortranarray(directions, dtype="f8"), np.float64(0.25), np.full(60, 3.0))
    same(networks.query(*wide, outputs=ALL), wanted)
    cut = np.repeat(wide[0].reshape(6, 10, 3), 2, axis=1)[:, ::2]
    got = networks.query(cut, wide[1].reshape(6, 10, 3), 0.25, 3, outputs="logit").logit
    assert (got.ravel() == wanted.logit).all()
    assert networks.visible(np.full(3, 1e300), (0, 0, 1))  # is infinite: invalid


def test_masks(scene):
    origins, directions = some_rays(scene, 1000)
    wanted = scene.visible(origins, directions)
    scene.set_instance_mask(0, 0b110)
    scene.commit()
    assert (scene.visible(origins, directions) == wanted).all()
    assert (scene.visible(origins, directions, mask=2) == wanted).all()
    assert scene.visible(origins, directions, mask=1).all() and not scene.intersect(origins, directions, mask=1).hit.any()
    masks = np.arange(1000) % 4
    for kind in ("u4", "i8", "u1"):
        assert (scene.visible(origins, directions, mask=masks.astype(kind)) == (wanted | (masks < 2))).all()
    assert (scene.query_async(origins, directions, mask=masks).wait().visible == (wanted | (masks < 2))).all()
    assert scene.certain(origins, directions, mask=8).all() and (scene.probability(origins, directions, mask=8) == 1).all()
    assert len(scene.query_open(origins, directions, mask=1).rays) == 0
    scene.set_instance_mask(0, 2**32 - 1)
    scene.set_instance_flags(0, nifkit.InstanceFlags.DISABLED)
    scene.commit()
    assert scene.visible(origins, directions).all() and scene.instance(0).flags == nifkit.InstanceFlags.DISABLED


def test_instances(scene):
    """Numbers stay, and what was set is told."""
    origins, directions = some_rays(scene, 1000)
    wanted = scene.intersect(origins, directions, outputs=HITS)
    asset = scene.instance(0).asset
    assert asset == scene.instance(0).asset and asset.file_bytes == golden("single").stat().st_size
    assert [scene.add_instance(asset) for _ in range(3)] == [1, 2, 3]
    scene.remove_instance(0)
    scene.remove_instance(2)
    assert (scene.instance_count, scene.instance_end) == (2, 4)
    assert scene.add_instance(asset) == 0
    for number in (1, 3, *scene.add_asset(asset)):
        scene.remove_instance(number)
    far = np.eye(4)
    far[0, 3] = 5
    scene.set_instance_transforms(None, [far])
    scene.set_instance_transforms([], np.zeros((0, 3, 4)))
    scene.set_instance_user(0, 2**64 - 1)
    scene.set_instance_mask(0, 5)
    # In double precision: 2^40 + 0.125 - 5 is no float32, and neither is what is near it.
    scene.set_instance_origin(0, (2.0**40 + 0.125, -3, 0))
    scene.set_origin((2.0**40 + 5.125, -3, 0))
    told = scene.instance(0)
    assert (told.object, told.mask, told.flags, told.user) == (0, 5, 0, 2**64 - 1)
    assert told.asset == asset and told.asset != nifkit.load(golden("single"))
    assert (told.transform == far[:3]).all() and told.origin.tolist() == [2.0**40 + 0.125, -3, 0]
    assert scene.origin.tolist() == [2.0**40 + 5.125, -3, 0]
    scene.commit()
    got = scene.intersect(origins, directions, outputs=HITS)
    same(got._replace(user=wanted.user), wanted)
    assert (got.user == np.where(got.hit, np.uint64(2**64 - 1), np.uint64(0))).all() and got.hit.any()
    scene.set_instance_origin(0, None)
    scene.set_origin(None)
    assert not scene.instance(0).origin.any() and not scene.origin.any() and not scene.committed


def test_lists_of_an_asset_are_made_once():
    with nifkit.load(golden("shapes")) as asset:
        assert asset.objects is asset.objects and asset.instances is asset.instances and asset.parts is asset.parts
        assert len(asset.objects) == asset.object_count and len(asset.instances) == asset.instance_count
        assert sum(part.file_bytes for part in asset.parts) == asset.file_bytes
        with pytest.raises(ValueError, match="read-only"):
            asset.objects[0].bounds[0] = 0


def test_cancel(networks):
    """What nobody has started on is left, and is said to be."""
    rays = some_rays(networks, 200_000)
    wanted = networks.visible(*rays)
    done = networks.query_async(*rays)
    done.wait()
    done.cancel()
    assert (done.wait().visible == wanted).all()
    cancelled = 0
    for _ in range(20):
        job = networks.query_async(*rays, outputs=ALL)
        job.cancel()
        try:
            assert (job.wait().visible == wanted).all()
        except nifkit.Error as error:
            assert error.code == nifkit.ErrorCode.CANCELLED
            cancelled += 1
        assert job.done()
    assert cancelled or networks.device.threads == 1


def test_instances_bend():
    """Vertices and poses change what rays meet; the pose at rest changes nothing."""
    with nifkit.load(golden("bending")) as asset, nifkit.Scene(device=asset.device) as scene:
        bending = [number for number, item in enumerate(asset.objects) if item.joints]
        stiff = [number for number, item in enumerate(asset.objects) if not item.vertices]
        about = asset.objects[bending[0]]
        instance = scene.add_instance(asset, bending[0])
        other = scene.add_instance(asset, stiff[0])
        scene.set_instance_mask(other, 0)
        scene.commit()
        origins, directions = some_rays(scene, 2000)
        rest = scene.intersect(origins, directions).t
        moves = np.tile(np.eye(3, 4, dtype=np.float32), (about.joints, 1, 1))
        scene.pose_instance(instance, moves, np.zeros(about.targets))
        scene.commit()
        # Weights need not add up to 1 exactly.
        assert np.isclose(scene.intersect(origins, directions).t, rest, rtol=1e-4).mean() > 0.95
        moves[:, :, 3] = 1000
        scene.pose_instance(instance, moves)
        scene.commit()
        assert scene.visible(origins, directions).all()
        scene.set_instance_vertices(instance, np.zeros((about.vertices, 3)))
        scene.commit()
        assert scene.visible(origins, directions).all()
        scene.set_instance_vertices(instance, None)
        scene.commit()
        assert (scene.intersect(origins, directions).t == rest).all()
        with pytest.raises(ValueError, match="vertices are needed"):
            scene.set_instance_vertices(instance, np.zeros((3, 3)))
        with pytest.raises(ValueError, match="shape"):
            scene.set_instance_vertices(instance, np.zeros(3))
        with pytest.raises(nifkit.Error, match="joints"):
            scene.pose_instance(instance, moves[1:])
        with pytest.raises(nifkit.Error, match="--deforms"):
            scene.pose_instance(other, moves)
