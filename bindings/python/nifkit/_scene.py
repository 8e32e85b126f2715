"""Scenes: instances of objects, and the queries that they answer."""
from __future__ import annotations

import ctypes
import threading
from typing import TYPE_CHECKING, Any, Callable, Mapping, Optional, Sequence, Union

import numpy as np

from ._abi import (
    ErrorCode, InstanceFlags, NifAnswers, NifFallback, NifHits, NifInstanceInfo, NifObjectInfo, NifOpenRays, NifPose, NifSceneInfo,
)  # fmt: skip
from ._answers import ANSWER_KINDS, HIT_KINDS, Answers, Hits, Instance, OpenRays
from ._asset import Asset
from ._device import Device, check_device, default_device
from ._handle import Handle, Use
from ._job import Job, is_at_work, start
from ._library import Error, check, lib, whole as _number
from ._rays import Rays, make_outputs, point_at
from ._shader import words_of

if TYPE_CHECKING:  # numpy.typing takes a while to load
    import numpy.typing as npt

    from ._answers import Bools, Floats, Numbers

    Out = Optional[Mapping[str, npt.NDArray[Any]]]
    Fallback = Callable[[npt.NDArray[np.int64], Bools], npt.ArrayLike]


# The devices whose fallbacks run on this thread.
_in_fallback = threading.local()


class Scene(Handle):
    """A list of instances of objects, for queries with rays. A context manager.

    Build it, commit it, query it; after a change, commit again. Any number of threads may query one scene. A change while
    another thread queries it, or before its jobs are done, is refused (INVALID_OPERATION).

    Args:
        assets: added as by `add_asset()`, and committed.
        device: what answers; by default that of the first asset, or the CPU with all its threads.

    Every query takes these:

    - `origins`, `directions`: float32, [..., 3], world units, relative to the scene's origin. A direction need not have
      length 1.
    - `tmin`, `tmax`: float32, [...] or a number: the points origin + t direction with tmin <= t <= tmax are asked about. By
      default 0 and infinity.
    - `mask`: uint32, [...] or a number: a ray meets the instances whose own mask has a bit in common with its mask. By
      default all.

    The shapes in front are broadcast against each other, as numpy does, and outputs have the resulting shape. Arrays are
    read where they lie, at any strides: of a batch with more than one dimension, all rays must lie at one distance from
    each other. The GIL is released meanwhile; the arrays must not change. Arrays of float64 are converted to float32 first,
    which copies them, and so are masks of other integers. Lists, tuples and numbers are taken for small things, such as one
    direction for all rays. Invalid rays (NaN, no direction, tmin > tmax) are visible.

    Every query raises `Error` where the library refuses it (e.g. INVALID_OPERATION: not committed), TypeError for an array
    of another type, and ValueError for shapes and layouts that do not fit.
    """

    _kind = "scene"
    _release = lib.nifReleaseScene

    def __init__(self, *assets: Asset, device: Optional[Device] = None) -> None:
        for asset in assets:
            _check_asset(asset)
        check_device(device)
        self._device = device or (assets[0].device if assets else default_device())
        handle = ctypes.c_void_p()
        with self._device._using() as owner:
            check(lib.nifNewScene(owner, ctypes.byref(handle)))
        assert handle.value is not None
        super().__init__(handle.value)
        for asset in assets:
            self.add_asset(asset)
        if assets:
            self.commit()

    @property
    def device(self) -> Device:
        """The device that answers."""
        return self._device

    # ---- Changes

    def _borrow(self, use: Use) -> int:
        value = super()._borrow(use)
        # Afterwards: no other thread can start a job meanwhile.
        if use.change and is_at_work(value):
            raise Error(ErrorCode.INVALID_OPERATION, "a job of the scene is not done; wait for it first")
        return value

    def add_asset(self, asset: Asset, transform: Optional[npt.ArrayLike] = None) -> range:
        """Adds a whole asset: all instances in its file, or, if it has none, each object once (unless it `places_nothing`).

        Args:
            asset: of the scene's device. The scene keeps what it needs of it.
            transform: [3, 4] or [4, 4] matrix from asset to world space (or 12 numbers, row by row), applied after each
                instance's own; None: identity.

        Returns:
            the numbers of the new instances.

        Raises:
            Error: INVALID_ARGUMENT if a value is not finite, SINGULAR_TRANSFORM if the matrix has no inverse.
        """
        _check_asset(asset)
        matrix = _matrix(transform)
        first, count = ctypes.c_uint32(), ctypes.c_uint32()
        with self._using(change=True) as scene, asset._using() as handle:
            check(lib.nifAddAsset(scene, handle, _address(matrix), ctypes.byref(first), ctypes.byref(count)))
        return range(first.value, first.value + count.value)

    def add_instance(self, asset: Asset, object: int = 0, transform: Optional[npt.ArrayLike] = None) -> int:
        """Adds one instance of one object.

        Args:
            asset: as in `add_asset()`.
            object: its number, below `Asset.object_count`.
            transform: as in `add_asset()`, from object to world space.

        Returns:
            the instance's number: the lowest that is free.
        """
        _check_asset(asset)
        matrix = _matrix(transform)
        instance = ctypes.c_uint32()
        with self._using(change=True) as scene, asset._using() as handle:
            number = _number("object", object)
            check(lib.nifAddInstance(scene, handle, number, _address(matrix), ctypes.byref(instance)))
        return int(instance.value)

    def remove_instance(self, instance: int) -> None:
        """Removes one instance. Its number is free for the next `add_instance()`; the others keep theirs."""
        with self._using(change=True) as scene:
            check(lib.nifRemoveInstance(scene, _number("instance", instance)))

    def set_instance_transform(self, instance: int, transform: npt.ArrayLike) -> None:
        """Replaces the transform of one instance. `transform` as in `add_instance()`."""
        matrix = _matrix(transform)
        with self._using(change=True) as scene:
            check(lib.nifSetInstanceTransform(scene, _number("instance", instance), _address(matrix)))

    def set_instance_transforms(self, instances: Optional[npt.ArrayLike], transforms: npt.ArrayLike) -> None:
        """Replaces the transforms of many instances; if one of them is invalid, of none.

        Args:
            instances: [n] their numbers; None: 0 .. n - 1.
            transforms: [n, 3, 4] or [n, 4, 4] matrices, as in `add_instance()`.
        """
        matrices = _matrices(transforms)
        numbers = None if instances is None else _numbers(instances)
        if numbers is not None and numbers.shape != matrices.shape[:1]:
            raise ValueError(f"instances: {len(matrices)} numbers are needed, as many as transforms, not {numbers.shape}")
        with self._using(change=True) as scene:
            if len(matrices):
                check(lib.nifSetInstanceTransforms(scene, len(matrices), _address(numbers), _address(matrices), 48))

    def set_instance_vertices(self, instance: int, positions: Optional[npt.ArrayLike]) -> None:
        """Gives one instance vertices of its own, which take effect at the next commit.

        Args:
            positions: [`Object.vertices`, 3] in object space, in the order of the source mesh; None: those at rest.
        """
        points = None if positions is None else _rows(positions, "positions", 3)
        with self._using(change=True) as scene:
            if points is not None:
                count = self._object_of(scene, instance).vertices
                if count and len(points) != count:
                    raise ValueError(f"positions: {count} vertices are needed, as many as the source has, not {len(points)}")
            check(lib.nifSetInstanceVertices(scene, _number("instance", instance), _address(points), 12))

    def pose_instance(
        self, instance: int, joints: npt.ArrayLike, weights: Optional[npt.ArrayLike] = None
    ) -> None:
        """Moves the vertices of one instance by the skin of its object; takes effect at the next commit.

        Args:
            joints: [`Object.joints`, 3, 4] or [..., 4, 4] matrices from the mesh in its bind pose to object space.
            weights: [`Object.targets`] of the morph targets; None: all are 0.
        """
        matrices = _matrices(joints, "transforms")
        shares = None if weights is None else _rows(weights, "weights", 0)
        pose = NifPose()
        pose.joints, pose.joint_count = _address(matrices), len(matrices)
        if shares is not None:
            pose.weights, pose.target_count = _address(shares), len(shares)
        with self._using(change=True) as scene:
            check(lib.nifPoseInstance(scene, _number("instance", instance), ctypes.byref(pose)))

    @staticmethod
    def _object_of(scene: Any, instance: int) -> NifObjectInfo:
        """Of an instance's object; the scene must not change meanwhile."""
        placed, info = NifInstanceInfo(), NifObjectInfo()
        check(lib.nifGetInstanceInfo(scene, _number("instance", instance), ctypes.byref(placed)))
        check(lib.nifGetObjectInfo(placed.asset, placed.object, ctypes.byref(info)))
        return info

    def set_instance_origin(self, instance: int, origin: Optional[npt.ArrayLike]) -> None:
        """Sets an instance's origin, which is added to its transform's translation in double precision.

        Args:
            origin: float64, [3]; None: 0 0 0. For worlds in which float32 is too coarse for places: give a place here,
                and leave the transform small. See `set_origin()`.
        """
        place = _place(origin)
        with self._using(change=True) as scene:
            check(lib.nifSetInstanceOrigin(scene, _number("instance", instance), _address(place)))

    def set_origin(self, origin: Optional[npt.ArrayLike]) -> None:
        """Sets the scene's origin: float64, [3]; None: 0 0 0. Rays, hits and bounds are relative to it. Move it with the
        camera, and rays are as precise near the camera as they are near 0, in a world of any size."""
        place = _place(origin)
        with self._using(change=True) as scene:
            check(lib.nifSetSceneOrigin(scene, _address(place)))

    def set_instance_mask(self, instance: int, mask: int) -> None:
        """Sets an instance's mask, 0 to 2^32 - 1. A ray meets the instance only if their masks have a bit in common. A new
        instance has all bits."""
        with self._using(change=True) as scene:
            check(lib.nifSetInstanceMask(scene, _number("instance", instance), _number("mask", mask)))

    def set_instance_flags(self, instance: int, flags: int) -> None:
        """Sets an instance's flags, e.g. `InstanceFlags.DISABLED`. A new instance has none."""
        with self._using(change=True) as scene:
            check(lib.nifSetInstanceFlags(scene, _number("instance", instance), _number("flags", flags)))

    def set_instance_user(self, instance: int, user: int) -> None:
        """Sets a value for your own use, 0 to 2^64 - 1, which hits return (`Hits.user`). A new instance has 0."""
        with self._using(change=True) as scene:
            check(lib.nifSetInstanceUser(scene, _number("instance", instance), _number("user", user, 64)))

    def commit(self) -> None:
        """Makes all changes since the last commit visible to queries."""
        with self._using(change=True) as scene:
            check(lib.nifCommitScene(scene))

    # ---- What it is

    def _info(self) -> NifSceneInfo:
        info = NifSceneInfo()
        with self._using() as scene:
            check(lib.nifGetSceneInfo(scene, ctypes.byref(info)))
        return info

    @property
    def instance_count(self) -> int:
        """The number of instances in the scene."""
        return int(self._info().instance_count)

    @property
    def instance_end(self) -> int:
        """All their numbers are below this. After `remove_instance()` some may be free."""
        return int(self._info().instance_end)

    def instance(self, instance: int) -> Instance:
        """Describes an instance as it was last set, committed or not."""
        info = NifInstanceInfo()
        with self._using() as scene:
            check(lib.nifGetInstanceInfo(scene, _number("instance", instance), ctypes.byref(info)))
            lib.nifRetainAsset(info.asset)  # while the scene keeps it
        return Instance(
            Asset(info.asset, self._device), int(info.object), np.array(info.transform, dtype=np.float32).reshape(3, 4),
            np.array(info.origin), int(info.mask), InstanceFlags(info.flags), int(info.user),
        )

    @property
    def origin(self) -> npt.NDArray[np.float64]:
        """float64, [3]: the scene's origin. See `set_origin()`."""
        return np.array(self._info().origin)

    @property
    def committed(self) -> bool:
        """True: no changes since the last commit."""
        return bool(self._info().committed)

    @property
    def bounds(self) -> Optional[Floats]:
        """[2, 3] lowest and highest corner of everything that can block a ray, at the last commit, relative to the
        scene's origin. A little larger than the objects' bounds. None if nothing can block a ray."""
        info = self._info()
        bounds = np.array([info.bounds_min, info.bounds_max], dtype=np.float32)
        return bounds if (bounds[0] <= bounds[1]).all() else None

    @property
    def resident_bytes(self) -> int:
        """Bytes of memory, without those of assets."""
        return int(self._info().resident_bytes)

    def shader_tables(self) -> npt.NDArray[np.uint32]:
        """The words of the committed scene for a shader of your own, as `Asset.shader_tables()` returns those of an object: its
        instances, then the objects that they place. Rays are then in world space.

        Raises:
            Error: NOT_AVAILABLE if shaders cannot answer one of the objects, INVALID_OPERATION if the scene is not committed
                or the device was not made with `shaders="on"`.
        """
        with self._using() as scene:
            return words_of(lambda words, capacity, count: int(lib.nifGetSceneShaderTables(scene, words, capacity, count)))

    def __repr__(self) -> str:
        if self.closed:
            return "<nifkit.Scene: closed>"
        return f"<nifkit.Scene: {self.instance_count} instances>"

    # ---- Queries

    def _rays(self, origins: Any, directions: Any, tmin: Any, tmax: Any, mask: Any) -> Rays:
        if getattr(_in_fallback, "device", None) is self._device:
            raise Error(ErrorCode.INVALID_OPERATION, "a fallback cannot query the device that called it")
        return Rays(origins, directions, tmin, tmax, mask)

    def query(
        self,
        origins: npt.ArrayLike,
        directions: npt.ArrayLike,
        tmin: Optional[npt.ArrayLike] = None,
        tmax: Optional[npt.ArrayLike] = None,
        *,
        mask: Optional[npt.ArrayLike] = None,
        outputs: Union[str, Sequence[str]] = ("visible",),
        out: Out = None,
    ) -> Answers:
        """Finds for each ray whether anything is in its way. Rays as in the class's text.

        Args:
            outputs: names of `Answers`. Asking for no more than `visible` and `visible_bits` is fastest; the answers are
                the same.
            out: arrays to write to, by these names, instead of new ones: C-contiguous, of the type and shape that
                `Answers` says (uint8 where it says bool is right, too). Then `outputs` means nothing.

        Returns:
            the answers, None for those not asked for.
        """
        rays = self._rays(origins, directions, tmin, tmax, mask)
        arrays = make_outputs(rays, ANSWER_KINDS, outputs, out)
        answers = point_at(NifAnswers(), arrays)
        with self._using() as scene:
            check(lib.nifQuery(scene, ctypes.byref(rays.rays), ctypes.byref(answers)))
        return Answers(**arrays)

    def query_with_fallback(
        self,
        origins: npt.ArrayLike,
        directions: npt.ArrayLike,
        tmin: Optional[npt.ArrayLike] = None,
        tmax: Optional[npt.ArrayLike] = None,
        *,
        fallback: Fallback,
        confidence: float = 2.0,
        mask: Optional[npt.ArrayLike] = None,
        outputs: Union[str, Sequence[str]] = ("visible",),
        out: Out = None,
    ) -> Answers:
        """As `query()`, but your own function answers rays that are not certain.

        Args:
            fallback: `fallback(rays, visible)` gets up to 1,024 numbers of rays (int64, [k], ascending; numbers in the
                batch in C order) with the learned answers (bool, [k]), both read-only, and returns k truth values: whether
                each is visible. They count as certain. It is called on the device's threads, which take turns in Python,
                and must not query the same device. If it raises, so does the query.
            confidence: a ray is passed on if it is not certain and its probability p has max(p, 1 - p) < confidence. 0.5
                or less: none; above 1: every ray that is not certain.
            outputs, out: as in `query()`.
        """
        rays = self._rays(origins, directions, tmin, tmax, mask)
        arrays = make_outputs(rays, ANSWER_KINDS, outputs, out)
        answers = point_at(NifAnswers(), arrays)
        least = _float("confidence", confidence)
        call = _FallbackCall(fallback, self._device)
        function = NifFallback(call.answer)
        with self._using() as scene:
            code = lib.nifQueryWithFallback(
                scene, ctypes.byref(rays.rays), ctypes.byref(answers), least, function, None
            )
            call.raise_failure()
            check(code)
        return Answers(**arrays)

    def visible(
        self,
        origins: npt.ArrayLike,
        directions: npt.ArrayLike,
        tmin: Optional[npt.ArrayLike] = None,
        tmax: Optional[npt.ArrayLike] = None,
        *,
        mask: Optional[npt.ArrayLike] = None,
    ) -> Bools:
        """bool, [...]: True where nothing is in the way. Rays as in the class's text."""
        answer = self.query(origins, directions, tmin, tmax, mask=mask, outputs="visible").visible
        assert answer is not None
        return answer

    def probability(
        self,
        origins: npt.ArrayLike,
        directions: npt.ArrayLike,
        tmin: Optional[npt.ArrayLike] = None,
        tmax: Optional[npt.ArrayLike] = None,
        *,
        mask: Optional[npt.ArrayLike] = None,
    ) -> Floats:
        """float32, [...]: calibrated probability that nothing is in the way. Rays as in the class's text."""
        answer = self.query(origins, directions, tmin, tmax, mask=mask, outputs="probability").probability
        assert answer is not None
        return answer

    def certain(
        self,
        origins: npt.ArrayLike,
        directions: npt.ArrayLike,
        tmin: Optional[npt.ArrayLike] = None,
        tmax: Optional[npt.ArrayLike] = None,
        *,
        mask: Optional[npt.ArrayLike] = None,
    ) -> Bools:
        """bool, [...]: True if the answer is proven. Rays as in the class's text."""
        answer = self.query(origins, directions, tmin, tmax, mask=mask, outputs="certain").certain
        assert answer is not None
        return answer

    def query_open(
        self,
        origins: npt.ArrayLike,
        directions: npt.ArrayLike,
        tmin: Optional[npt.ArrayLike] = None,
        tmax: Optional[npt.ArrayLike] = None,
        *,
        mask: Optional[npt.ArrayLike] = None,
        outputs: Union[str, Sequence[str]] = ("visible",),
    ) -> OpenRays:
        """Answers the rays that have a proof and lists the others, without evaluating networks. At most 2^32 - 1 rays.
        `outputs` as in `query()`. Assets of the encoding `proof` are made for this query."""
        rays = self._rays(origins, directions, tmin, tmax, mask)
        arrays = make_outputs(rays, ANSWER_KINDS, outputs, None)
        answers = point_at(NifAnswers(), arrays)
        numbers, instances = np.empty(rays.count, dtype=np.uint32), np.empty(rays.count, dtype=np.uint32)
        low, high = np.empty(rays.count, dtype=np.float32), np.empty(rays.count, dtype=np.float32)
        count = ctypes.c_uint32()
        lists = NifOpenRays()
        lists.capacity = rays.count
        lists.rays, lists.tmin, lists.tmax = numbers.ctypes.data, low.ctypes.data, high.ctypes.data
        lists.count, lists.instance = ctypes.addressof(count), instances.ctypes.data
        with self._using() as scene:
            check(lib.nifQueryOpen(scene, ctypes.byref(rays.rays), ctypes.byref(answers), ctypes.byref(lists)))
        n = count.value
        return OpenRays(numbers[:n], low[:n], high[:n], instances[:n], Answers(**arrays))

    def intersect(
        self,
        origins: npt.ArrayLike,
        directions: npt.ArrayLike,
        tmin: Optional[npt.ArrayLike] = None,
        tmax: Optional[npt.ArrayLike] = None,
        *,
        mask: Optional[npt.ArrayLike] = None,
        outputs: Union[str, Sequence[str]] = ("hit", "t", "normal", "instance", "object", "triangle"),
        out: Out = None,
    ) -> Hits:
        """Finds the first hit of each ray. Rays as in the class's text.

        Args:
            outputs: names of `Hits`.
            out: arrays to write to, as in `query()`.

        Returns:
            the hits, None for outputs not asked for.
        """
        rays = self._rays(origins, directions, tmin, tmax, mask)
        arrays = make_outputs(rays, HIT_KINDS, outputs, out)
        hits = point_at(NifHits(), arrays)
        with self._using() as scene:
            check(lib.nifIntersect(scene, ctypes.byref(rays.rays), ctypes.byref(hits)))
        return Hits(**arrays)

    def query_async(
        self,
        origins: npt.ArrayLike,
        directions: npt.ArrayLike,
        tmin: Optional[npt.ArrayLike] = None,
        tmax: Optional[npt.ArrayLike] = None,
        *,
        mask: Optional[npt.ArrayLike] = None,
        outputs: Union[str, Sequence[str]] = ("visible",),
        out: Out = None,
    ) -> Job[Answers]:
        """Starts `query()` in the background. With a device of one thread it is answered before this returns. Do not
        change the arrays until the job is done."""
        rays = self._rays(origins, directions, tmin, tmax, mask)
        arrays = make_outputs(rays, ANSWER_KINDS, outputs, out)
        answers = point_at(NifAnswers(), arrays)
        with self._using() as scene:
            query = lambda job: lib.nifQueryAsync(scene, ctypes.byref(rays.rays), ctypes.byref(answers), job)  # noqa: E731
            return start(scene, query, Answers(**arrays), (rays, self._device))

    def intersect_async(
        self,
        origins: npt.ArrayLike,
        directions: npt.ArrayLike,
        tmin: Optional[npt.ArrayLike] = None,
        tmax: Optional[npt.ArrayLike] = None,
        *,
        mask: Optional[npt.ArrayLike] = None,
        outputs: Union[str, Sequence[str]] = ("hit", "t", "normal", "instance", "object", "triangle"),
        out: Out = None,
    ) -> Job[Hits]:
        """Starts `intersect()` in the background, as `query_async()` does."""
        rays = self._rays(origins, directions, tmin, tmax, mask)
        arrays = make_outputs(rays, HIT_KINDS, outputs, out)
        hits = point_at(NifHits(), arrays)
        with self._using() as scene:
            query = lambda job: lib.nifIntersectAsync(scene, ctypes.byref(rays.rays), ctypes.byref(hits), job)  # noqa: E731
            return start(scene, query, Hits(**arrays), (rays, self._device))


class _FallbackCall:
    """Wraps a fallback, which the library calls on any thread. The first exception is kept, and ends the calls."""

    def __init__(self, fallback: Fallback, device: Device) -> None:
        self._fallback = fallback
        self._device = device
        self._failure: Optional[BaseException] = None

    def answer(self, user: Optional[int], count: int, rays: int, visible: int) -> None:
        if self._failure is not None:
            return
        outer = getattr(_in_fallback, "device", None)
        _in_fallback.device = self._device
        try:
            # Copies, because the library's memory is gone after the call.
            numbers = np.frombuffer(ctypes.string_at(rays, 8 * count), dtype=np.int64)
            learned = np.frombuffer(ctypes.string_at(visible, count), dtype=np.bool_)
            answers = np.asarray(self._fallback(numbers, learned))
            if answers.shape != (count,) or answers.dtype.kind not in "biu":
                raise ValueError(
                    f"the fallback has to return {count} truth values, not {answers.dtype} of shape {answers.shape}"
                )
            ctypes.memmove(visible, answers.astype(np.bool_).tobytes(), count)  # an address would not keep them alive
        except BaseException as error:  # also KeyboardInterrupt: it must not be lost in the library
            self._failure = error
        finally:
            _in_fallback.device = outer

    def raise_failure(self) -> None:
        # Without the cycle of the exception's traceback, this object and the failure.
        failure, self._failure = self._failure, None
        if failure is not None:
            raise failure


def _check_asset(asset: Asset) -> None:
    if not isinstance(asset, Asset):
        raise TypeError(f"an asset that load() made is needed, not this {type(asset).__name__}")


def _matrix(transform: Optional[npt.ArrayLike]) -> Optional[Floats]:
    """[12], row by row."""
    if transform is None:
        return None
    matrix = np.asarray(transform)
    return _matrices((matrix.reshape(3, 4) if matrix.shape == (12,) else matrix)[None], "transform").reshape(12)


def _matrices(transforms: npt.ArrayLike, name: str = "transforms") -> Floats:
    """[n, 12], row by row."""
    matrices = np.asarray(transforms)
    if matrices.dtype.kind not in "fiu":
        raise TypeError(f"{name}: numbers are needed, not {matrices.dtype}")
    if matrices.ndim != 3 or matrices.shape[1:] not in ((3, 4), (4, 4)):
        shape, got = ("(3, 4) or (4, 4)", matrices.shape[1:])
        if name == "transforms":
            shape, got = ("(n, 3, 4) or (n, 4, 4)", matrices.shape)
        raise ValueError(f"{name}: a matrix of shape {shape} is needed, not {got}")
    if (matrices[:, 3:] != (0, 0, 0, 1)).any():
        raise ValueError(f"{name}: the last row of a 4x4 matrix has to be 0 0 0 1")
    with np.errstate(over="ignore"):
        return np.ascontiguousarray(matrices[:, :3], dtype=np.float32).reshape(-1, 12)


def _place(origin: Optional[npt.ArrayLike]) -> Optional[npt.NDArray[np.float64]]:
    """[3]"""
    if origin is None:
        return None
    place = np.asarray(origin)
    if place.dtype.kind not in "fiu":
        raise TypeError(f"origin: numbers are needed, not {place.dtype}")
    if place.shape != (3,):
        raise ValueError(f"origin: an array of shape (3,) is needed, not {place.shape}")
    return np.ascontiguousarray(place, dtype=np.float64)


def _rows(values: npt.ArrayLike, name: str, width: int) -> Floats:
    """[n, width], or [n] with a width of 0."""
    rows = np.asarray(values)
    if rows.dtype.kind not in "fiu":
        raise TypeError(f"{name}: numbers are needed, not {rows.dtype}")
    if rows.shape[1:] != ((width,) if width else ()) or rows.ndim == 0:
        raise ValueError(f"{name}: an array of shape {f'(n, {width})' if width else '(n,)'} is needed, not {rows.shape}")
    with np.errstate(over="ignore"):
        return np.ascontiguousarray(rows, dtype=np.float32)


def _address(array: Optional[npt.NDArray[Any]]) -> Optional[int]:
    return None if array is None else array.ctypes.data


def _numbers(instances: npt.ArrayLike) -> Numbers:
    """[n]"""
    numbers = np.asarray(instances)
    if numbers.dtype.kind not in "iu" and numbers.size:
        raise TypeError(f"instances: integers are needed, not {numbers.dtype}")
    if numbers.size and not 0 <= numbers.min() <= numbers.max() < 2**32:
        raise Error(ErrorCode.INVALID_ARGUMENT, "instances: a number is not one from 0 to 2^32 - 1")
    return np.ascontiguousarray(numbers, dtype=np.uint32)


def _float(name: str, value: float) -> ctypes.c_float:
    try:
        return ctypes.c_float(value)
    except (TypeError, OverflowError):
        raise TypeError(f"{name}: a number is needed, not this {type(value).__name__}") from None
