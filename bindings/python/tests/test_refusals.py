"""What is refused, with which code and words, and that nothing of it ends the process."""
import ctypes
import os
import pickle
import copy

import numpy as np
import pytest
from conftest import golden, some_rays

import nifkit
from nifkit import ErrorCode

ZERO, UP = np.zeros((4, 3), dtype=np.float32), np.float32([0, 0, 1])


def refused(code: ErrorCode, text: str):
    """pytest.raises for an Error of this code, whose sentence has the text."""

    class Refused:
        def __enter__(self):
            self.raises = pytest.raises(nifkit.Error)
            self.info = self.raises.__enter__()
            return self.info

        def __exit__(self, *error):
            fine = self.raises.__exit__(*error)
            if fine:
                assert self.info.value.code == code, self.info.value
                assert text in str(self.info.value)
            return fine

    return Refused()


@pytest.mark.parametrize("name", ["origins", "directions", "tmin", "tmax"])
@pytest.mark.parametrize("dtype", ["f2", ">f4", ">f8", "i4", "u1", "?", "c8", "O", "U3", "M8[s]"])
def test_types(scene, name, dtype):
    values = {"origins": ZERO, "directions": ZERO + UP, "tmin": ZERO[:, 0], "tmax": ZERO[:, 0] + 1}
    assert scene.visible(**values).all()
    values[name] = np.zeros(values[name].shape, dtype=dtype)
    with pytest.raises(TypeError, match=f"^{name}: an array of float32 or float64 is needed, not "):
        scene.visible(**values)


def test_things_that_are_no_arrays(scene):
    for wrong in (None, "abc", {}, object(), b"123456789012"):
        with pytest.raises(TypeError, match="^origins: an array of float32 or float64 is needed"):
            scene.visible(wrong, UP)
    for wrong in ([[1, 2, 3], [1, 2]], ["a", "b", "c"]):
        with pytest.raises(ValueError, match="^origins: a list or tuple of numbers"):
            scene.visible(wrong, UP)
    # Another library's memory.
    memory = (ctypes.c_float * 12)()
    assert scene.visible(np.ctypeslib.as_array(memory).reshape(4, 3), UP).shape == (4,)
    assert scene.visible(memoryview(memory).cast("B").cast("f", (4, 3)), UP).shape == (4,)


@pytest.mark.parametrize(
    "origins, directions, tmin, text",
    [
        (np.zeros(4, "f4"), UP, None, r"origins: an array of shape \(..., 3\) is needed, not \(4,\)"),
        (np.zeros((3, 4), "f4"), UP, None, r"origins: .* not \(3, 4\)"),
        (np.float32(0), UP, None, r"origins: .* not \(\)"),
        (ZERO, np.zeros((4, 2), "f4"), None, r"directions: .* not \(4, 2\)"),
        (ZERO, np.zeros((5, 3), "f4"), None, r"do not fit each other: origins \(4, 3\), directions \(5, 3\)"),
        (ZERO, UP, np.zeros(5, "f4"), r"do not fit each other: .*tmin \(5,\)"),
        (ZERO, UP, np.zeros((4, 1), "f4"), r"origins: rays of shape \(4, 4\) do not lie at one distance"),
    ],
)
def test_shapes(scene, origins, directions, tmin, text):
    with pytest.raises(ValueError, match=text):
        scene.visible(origins, directions, tmin)


def test_outputs(scene):
    rays = some_rays(scene, 4)
    with pytest.raises(ValueError, match="there is no output 'visble'; there are visible, "):
        scene.query(*rays, outputs=("visble",))
    with pytest.raises(ValueError, match="at least one output"):
        scene.query(*rays, outputs=())
    with pytest.raises(ValueError, match="there is no output 'logit'"):
        scene.intersect(*rays, outputs="logit")
    for array, text in (
        (np.empty(5, dtype=bool), r"visible has to be bool of shape \(4,\), not bool of shape \(5,\)"),
        (np.empty(4, dtype=np.float32), "not float32"),
        (np.empty(8, dtype=bool)[::2], "C-contiguous and writeable"),
        (np.frombuffer(b"1234", dtype=bool), "C-contiguous and writeable"),
    ):
        with pytest.raises(ValueError, match=text):
            scene.query(*rays, out={"visible": array})
    with pytest.raises(TypeError, match="visible is a list"):
        scene.query(*rays, out={"visible": [0] * 4})
    both = np.empty(4, dtype=bool)
    with pytest.raises(ValueError, match="certain lies in memory"):
        scene.query(*rays, out={"visible": both, "certain": both})
    origins = rays[0].copy()
    with pytest.raises(ValueError, match="visible lies in memory"):
        scene.query(origins, UP, out={"visible": origins.view(np.uint8).reshape(-1)[:4]})


def test_rays_that_are_none(scene):
    """Any numbers are safe."""
    random = np.random.default_rng(5)
    for _ in range(20):
        bits = [random.integers(0, 2**32, (1000, 3), dtype=np.uint32).view(np.float32) for _ in range(2)]
        limits = [random.integers(0, 2**32, 1000, dtype=np.uint32).view(np.float32) for _ in range(2)]
        scene.query(*bits, *limits, outputs=("visible", "probability"))
        scene.intersect(*bits, *limits)
        scene.query_open(*bits, *limits)
    nan = np.full((4, 3), np.nan, dtype=np.float32)
    got = scene.query(nan, UP, outputs=("visible", "certain"))
    assert got.visible.all() and not got.certain.any()


def test_files(tmp_path):
    good = golden("single").read_bytes()
    (tmp_path / "empty.nif").touch()
    (tmp_path / "short.nif").write_bytes(good[:200])
    (tmp_path / "text.nif").write_text("no asset, but a text that is long enough to be read\n" * 5)
    damaged = bytearray(good)
    damaged[len(good) // 2] ^= 1
    (tmp_path / "damaged.nif").write_bytes(damaged)
    for name, code in {
        "none.nif": ErrorCode.FILE_NOT_FOUND,
        "empty.nif": ErrorCode.FILE_EMPTY,
        "short.nif": ErrorCode.FILE_TRUNCATED,
        "text.nif": ErrorCode.NOT_A_NIF,
        "damaged.nif": ErrorCode.DAMAGED_NIF,
        ".": ErrorCode.FILE_UNREADABLE,
    }.items():
        for path in (tmp_path / name, str(tmp_path / name)):
            for in_place in (False, True):
                with refused(code, str(tmp_path)):
                    nifkit.load(path, in_place=in_place)
        if (tmp_path / name).is_file():
            with refused(code, "memory"):
                nifkit.load((tmp_path / name).read_bytes())
    with refused(ErrorCode.INVALID_ARGUMENT, "a path has no 0 in it"):
        nifkit.load("a\0b.nif")
    with refused(ErrorCode.INVALID_ARGUMENT, "cannot be the name of a file"):
        nifkit.load("\ud800.nif")
    with refused(ErrorCode.INVALID_ARGUMENT, "only a path's file can be used in place"):
        nifkit.load(good, in_place=True)
    for wrong in (3, None, [1, 2], np.frombuffer(good, dtype=np.uint8)[::2]):
        with pytest.raises(TypeError, match="a path, a contiguous buffer or a binary file"):
            nifkit.load(wrong)
    view = memoryview(good)
    view.release()
    with pytest.raises(TypeError, match="released memoryview"):
        nifkit.load(view)


def test_sources(tmp_path):
    good = golden("shapes").read_bytes()
    odd = tmp_path / os.fsdecode("gr\u00fc\u00df \u7269".encode() + b"\xff.nif")  # not UTF-8
    odd.write_bytes(good)
    array = np.frombuffer(b"x" + good, dtype=np.uint8)[1:]
    for source in (golden("shapes"), str(odd), good, bytearray(good), memoryview(good), array):
        with nifkit.load(source) as asset:
            assert asset.file_bytes == len(good)
    with open(odd, "rb") as file, nifkit.load(file) as asset:
        assert asset.file_bytes == len(good)
    with open(__file__, "rb") as file, refused(ErrorCode.NOT_A_NIF, f"{__file__}: "):
        nifkit.load(file)
    with open(__file__) as file, pytest.raises(TypeError, match="a binary file, not this str"):
        nifkit.load(file)
    odd.unlink()
    with refused(ErrorCode.FILE_NOT_FOUND, "gr\u00fc\u00df \u7269"):
        nifkit.load(odd)


def test_devices():
    for options, code in (
        ({"isa": "mmx"}, ErrorCode.INVALID_ARGUMENT),
        ({"threads": -1}, ErrorCode.INVALID_ARGUMENT),
        ({"what": 1}, ErrorCode.INVALID_ARGUMENT),
        ({"isa": "auto,threads=3"}, ErrorCode.INVALID_ARGUMENT),
        ({"isa": "auto\0"}, ErrorCode.INVALID_ARGUMENT),
        ({"isa=scalar,memory": "auto"}, ErrorCode.INVALID_ARGUMENT),
        ({"threads=1,isa": "auto"}, ErrorCode.INVALID_ARGUMENT),
        ({"module": "\ud800"}, ErrorCode.INVALID_ARGUMENT),
        ({"isa": "neon"}, ErrorCode.NOT_AVAILABLE),
        ({"backend": "gpu", "module": "/no/such/module.so"}, ErrorCode.NOT_AVAILABLE),
    ):
        with refused(code, ""):
            nifkit.Device(**options)
    with nifkit.Device(threads=1, isa="scalar") as device:
        assert (device.threads, device.isa, device.backend, device.gpu) == (1, "scalar", "cpu", "")
        assert "scalar" in repr(device)
    assert [backend.name for backend in nifkit.backends()] == ["cpu", "cuda", "hip"]
    assert nifkit.backends()[0].available
    assert bool(nifkit.gpus()) or all(backend.reason for backend in nifkit.backends()[1:])
    for gpu in nifkit.gpus():
        assert gpu.backend in ("cuda", "hip") and len(gpu.pci_address) == 12 and gpu.luid is None


def test_things_that_are_no_devices(scene):
    for wrong in (5, 0, "cpu", scene):
        for call in (
            lambda: nifkit.load(golden("single"), device=wrong),
            lambda: nifkit.Scene(device=wrong),
            lambda: nifkit.bake(ZERO, [[0, 1, 2]], device=wrong),
        ):
            with pytest.raises(TypeError, match="^device: a nifkit.Device or None is needed, not this "):
                call()


def test_closed():
    device = nifkit.Device(threads=1)
    asset = nifkit.load(golden("single"), device=device)
    scene = nifkit.Scene(asset)
    rays = some_rays(scene, 10)
    wanted = scene.visible(*rays)
    asset.close()
    device.close()
    asset.close()
    assert (scene.visible(*rays) == wanted).all()  # it keeps what it needs
    scene.close()
    assert scene.closed and asset.closed and device.closed
    calls = {
        "scene": [
            lambda: scene.visible(*rays),
            lambda: scene.intersect(*rays),
            lambda: scene.query_open(*rays),
            lambda: scene.query_async(*rays),
            lambda: scene.query_with_fallback(*rays, fallback=lambda rays, visible: visible),
            lambda: scene.bounds,
            lambda: scene.shader_tables(),
            lambda: scene.commit(),
            lambda: scene.set_instance_transform(0, np.eye(4)),
            lambda: scene.set_instance_transforms(None, [np.eye(4)]),
            lambda: scene.set_instance_origin(0, (0, 0, 0)),
            lambda: scene.set_origin((0, 0, 0)),
            lambda: scene.set_instance_mask(0, 1),
            lambda: scene.set_instance_flags(0, 0),
            lambda: scene.set_instance_user(0, 0),
            lambda: scene.remove_instance(0),
            lambda: scene.instance(0),
            lambda: scene.__enter__(),
        ],
        "asset": [
            lambda: asset.resident_bytes,
            lambda: asset.metadata,
            lambda: asset.objects,
            lambda: asset.instances,
            lambda: asset.shader_tables(0),
            lambda: nifkit.Scene(asset, device=nifkit.default_device()),
        ],
        "device": [
            lambda: device.threads,
            lambda: nifkit.load(golden("single"), device=device),
            lambda: nifkit.Scene(device=device),
        ],
    }
    for kind, all_of_it in calls.items():
        for call in all_of_it:
            with refused(ErrorCode.INVALID_ARGUMENT, f"the {kind} is closed"):
                call()
    assert [repr(thing) for thing in (device, asset, scene)] == [
        f"<nifkit.{kind}: closed>" for kind in ("Device", "Asset", "Scene")
    ]


def test_scenes(scene):
    rays = some_rays(scene, 10)
    with nifkit.load(golden("single")) as asset, nifkit.Scene() as other, nifkit.Device(threads=1) as device:
        with refused(ErrorCode.INVALID_OPERATION, "commit"):
            other.visible(*rays)
        with refused(ErrorCode.INVALID_ARGUMENT, ""):
            other.add_instance(asset, 99)
        for wrong in (-1, 2**32):
            with refused(ErrorCode.INVALID_ARGUMENT, "is not a number from 0"):
                other.add_instance(asset, wrong)
        for wrong in (0.7, np.float32(1), "0", None):
            with pytest.raises(TypeError, match="^object: an integer is needed, not this "):
                other.add_instance(asset, wrong)
            with pytest.raises(TypeError, match="^instance: an integer is needed, not this "):
                other.set_instance_transform(wrong, np.eye(4))
        with refused(ErrorCode.INVALID_ARGUMENT, ""):
            other.set_instance_transform(0, np.eye(4))
        with refused(ErrorCode.SINGULAR_TRANSFORM, ""):
            other.add_asset(asset, np.zeros((3, 4)))
        for value in (np.nan, np.inf, 1e300):
            with refused(ErrorCode.INVALID_ARGUMENT, ""):
                other.add_asset(asset, np.diag([value, 1, 1, 1]))
        with refused(ErrorCode.INVALID_ARGUMENT, ""):
            nifkit.Scene(asset, device=device)  # an asset of another device
        for wrong in (np.eye(3), np.ones(16), [[1]]):
            with pytest.raises(ValueError, match=r"transform: a matrix of shape \(3, 4\)"):
                other.add_asset(asset, wrong)
        with pytest.raises(ValueError, match="the last row"):
            other.add_asset(asset, np.ones((4, 4)))
        for wrong in ("abc", np.eye(4, dtype=complex), object()):
            with pytest.raises(TypeError, match="transform: numbers are needed"):
                other.add_asset(asset, wrong)
        for wrong in (None, "dragon.nif", scene):
            with pytest.raises(TypeError, match=r"an asset that load\(\) made is needed"):
                other.add_asset(wrong)
            with pytest.raises(TypeError, match=r"an asset that load\(\) made is needed"):
                nifkit.Scene(wrong)
        assert other.instance_count == 0


def test_instances(scene):
    """What is refused changes nothing."""
    for call in (
        lambda: scene.remove_instance(1),
        lambda: scene.instance(1),
        lambda: scene.set_instance_origin(1, (0, 0, 0)),
        lambda: scene.set_instance_origin(0, (0, np.inf, 0)),
        lambda: scene.set_origin((np.nan, 0, 0)),
        lambda: scene.set_instance_mask(0, 2**32),
        lambda: scene.set_instance_user(0, 2**64),
        lambda: scene.set_instance_user(0, -1),
        lambda: scene.set_instance_transforms([0, 1], [np.eye(4)] * 2),
        lambda: scene.set_instance_transforms([2**32], [np.eye(4)]),
        lambda: scene.visible(ZERO, UP, mask=2**32),
        lambda: scene.visible(ZERO, UP, mask=[0, 1, 2, -1]),
    ):
        with refused(ErrorCode.INVALID_ARGUMENT, ""):
            call()
    with refused(ErrorCode.NOT_AVAILABLE, ""):
        scene.set_instance_flags(0, 2)
    with refused(ErrorCode.SINGULAR_TRANSFORM, ""):
        scene.set_instance_transforms([0], np.zeros((1, 3, 4)))
    for kind, call, text in (
        (ValueError, lambda: scene.set_instance_transforms([0, 0], [np.eye(4)]), "instances: 1 numbers are needed"),
        (ValueError, lambda: scene.set_instance_transforms(None, np.eye(4)), r"transforms: a matrix of shape \(n, 3, 4\)"),
        (TypeError, lambda: scene.set_instance_transforms([0.5], [np.eye(4)]), "instances: integers are needed"),
        (ValueError, lambda: scene.set_origin((0, 0)), r"origin: an array of shape \(3,\)"),
        (TypeError, lambda: scene.set_origin("abc"), "origin: numbers are needed"),
        (TypeError, lambda: scene.set_instance_mask(0, 0.5), "mask: an integer is needed"),
        (TypeError, lambda: scene.visible(ZERO, UP, mask=0.5), "mask: integers are needed"),
        (TypeError, lambda: scene.visible(ZERO, UP, mask=[True] * 4), "mask: integers are needed"),
        (ValueError, lambda: scene.visible(ZERO, UP, mask=[1, 2]), "do not fit each other"),
    ):
        with pytest.raises(kind, match=text):
            call()
    assert scene.committed


def test_fallbacks(networks):
    rays = some_rays(networks, 5000)

    class Mine(BaseException):
        pass

    def raising(rays, visible):
        raise Mine("mine")

    def querying(rays, visible):
        return networks.visible(np.zeros((len(rays), 3), "f4"), UP)

    for _ in range(20):
        with pytest.raises(Mine, match="^mine$"):
            networks.query_with_fallback(*rays, fallback=raising)
    for wrong in (lambda r, v: None, lambda r, v: v[:-1], lambda r, v: v.astype("f4"), lambda r, v: "visible"):
        with pytest.raises(ValueError, match="the fallback has to return"):
            networks.query_with_fallback(*rays, fallback=wrong)
    with pytest.raises(TypeError):
        networks.query_with_fallback(*rays, fallback=lambda: None)
    with pytest.raises(TypeError, match="not callable"):
        networks.query_with_fallback(*rays, fallback=3)
    with refused(ErrorCode.INVALID_OPERATION, "a fallback cannot query the device that called it"):
        networks.query_with_fallback(*rays, fallback=querying)
    for wrong in (-1, float("nan")):
        with refused(ErrorCode.INVALID_ARGUMENT, ""):
            networks.query_with_fallback(*rays, fallback=lambda r, v: v, confidence=wrong)
    for wrong in ("x", None, [1], 10**400):
        with pytest.raises(TypeError, match="^confidence: a number is needed, not this "):
            networks.query_with_fallback(*rays, fallback=lambda r, v: v, confidence=wrong)
    networks.query_with_fallback(*rays, fallback=lambda r, v: v, confidence=np.float32(0.9))
    # Another device may be queried.
    with nifkit.Device(threads=1) as device, nifkit.load(golden("networks"), device=device) as asset:
        with nifkit.Scene(device=device) as other:
            other.add_instance(asset)
            other.commit()
            answer = lambda r, v: other.visible(rays[0][r], rays[1][r])  # noqa: E731
            assert (networks.query_with_fallback(*rays, fallback=answer).visible == networks.visible(*rays)).all()


def test_errors_are_plain_exceptions():
    with pytest.raises(nifkit.Error) as info:
        nifkit.load("/no/such.nif")
    error = info.value
    assert error.code is ErrorCode.FILE_NOT_FOUND and error.code == 10 and error.message == str(error)
    other = pickle.loads(pickle.dumps(error))
    assert (other.code, str(other)) == (error.code, str(error))
    assert nifkit.Error(50, "a").code == 50


def test_no_copies_of_handles(scene):
    for thing in (scene, scene.device, scene.query_async(ZERO, UP)):
        for way in (copy.copy, copy.deepcopy, pickle.dumps):
            with pytest.raises(TypeError, match="cannot be copied or pickled"):
                way(thing)
