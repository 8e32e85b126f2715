"""Scenes: instances of objects, and the queries that they answer."""
from __future__ import annotations

import ctypes
import operator
import threading
from typing import TYPE_CHECKING, Any, Callable, Mapping, NamedTuple, Optional, Sequence, Union

import numpy as np

from ._abi import ErrorCode, NifFallback, NifHits, NifOpenRays, NifSceneInfo
from ._asset import Asset
from ._device import Device, check_device, default_device
from ._handle import Handle, Use
from ._job import Job, is_at_work, start
from ._library import Error, check, lib
from ._rays import Rays, make_outputs, point_at

if TYPE_CHECKING:  # numpy.typing takes a while to load
    import numpy.typing as npt

    from ._rays import Kinds

    Bools = npt.NDArray[np.bool_]
    Floats = npt.NDArray[np.float32]
    Numbers = npt.NDArray[np.uint32]
    Out = Optional[Mapping[str, npt.NDArray[Any]]]
    Fallback = Callable[[npt.NDArray[np.int64], Bools], npt.ArrayLike]


class Answers(NamedTuple):
    """What a query says of its rays. Outputs that were not asked for are None. `...` is the shape of the batch."""

    visible: Optional[Bools] = None
    """[...] True: visible, False: occluded."""
    visible_bits: Optional[npt.NDArray[np.uint8]] = None
    """[(count + 7) // 8] The same as bits: ray i is bit i % 8 (0 is the lowest) of byte i // 8."""
    probability: Optional[Floats] = None
    """[...] Calibrated probability that the ray is visible, 0 to 1; exactly 0 or 1 for certain rays."""
    certain: Optional[Bools] = None
    """[...] True: the answer is proven, not learned."""
    logit: Optional[npt.NDArray[np.int32]] = None
    """[...] The smallest network output of all instances: below 0 means occluded; plus or minus `LOGIT_CERTAIN` where
    no network decided."""


class Hits(NamedTuple):
    """Where rays first meet a scene. Outputs that were not asked for are None. `...` is the shape of the batch."""

    hit: Optional[Bools] = None
    """[...] True: the ray meets something."""
    t: Optional[Floats] = None
    """[...] Where, in units of the ray's direction; infinite if nothing is hit."""
    normal: Optional[Floats] = None
    """[..., 3] Geometric normal, in world space, of unit length, on the side that the ray comes from; 0 if nothing is hit."""
    instance: Optional[Numbers] = None
    """[...] The scene's number of the instance; `NONE` if nothing is hit."""
    object: Optional[Numbers] = None
    """[...] That instance's object, as numbered in its asset; `NONE` if nothing is hit."""
    triangle: Optional[Numbers] = None
    """[...] The triangle, where the object has triangles (see `Object.source_triangles`); else `NONE`."""
    u: Optional[Floats] = None
    """[...] Weight of the triangle's second vertex."""
    v: Optional[Floats] = None
    """[...] Weight of its third."""
    certain: Optional[Bools] = None
    """[...] True: it is proven that something is hit, or that nothing is."""
    t_low: Optional[Floats] = None
    """[...] Proven: nothing is met before."""
    t_high: Optional[Floats] = None
    """[...] Proven: something is met here or before."""
    color: Optional[Floats] = None
    """[..., 3] Base colour of the surface, linear RGB, 0 to 1; 0.5 where the object has no colours."""


class OpenRays(NamedTuple):
    """Rays that proofs leave open, for a BVH of yours: entry k is about ray number `rays[k]` of the batch (in C order), of
    which only the part from `tmin[k]` to `tmax[k]` matters. The order may differ from run to run."""

    rays: Numbers
    """[count] Numbers of rays."""
    tmin: Floats
    """[count] In units of the ray's direction."""
    tmax: Floats
    """[count] Likewise."""
    answers: Answers
    """Of all rays. An open ray has visible False, certain False, probability 0.5 and logit -1."""


_QUERY_KINDS: Kinds = {
    "visible": (np.bool_, ()),
    "visible_bits": (np.uint8, ()),
    "probability": (np.float32, ()),
    "certain": (np.bool_, ()),
    "logit": (np.int32, ()),
}
_HIT_KINDS: Kinds = {
    "hit": (np.bool_, ()),
    "t": (np.float32, ()),
    "normal": (np.float32, (3,)),
    "instance": (np.uint32, ()),
    "object": (np.uint32, ()),
    "triangle": (np.uint32, ()),
    "u": (np.float32, ()),
    "v": (np.float32, ()),
    "certain": (np.bool_, ()),
    "t_low": (np.float32, ()),
    "t_high": (np.float32, ()),
    "color": (np.float32, (3,)),
}
# Whose fallback runs on this thread.
_in_fallback = threading.local()


class Scene(Handle):
    """A list of instances of objects that rays are asked of. A context manager.

    Build it, commit it, query it; after a change, commit again. Any number of threads may query one scene. A change while
    another thread queries it, or before its jobs are done, is refused (INVALID_OPERATION).

    Args:
        assets: added as by `add()`, and committed.
        device: what answers; by default that of the first asset, or the CPU with all its threads.

    Every query takes these:

    - `origins`, `directions`: float32, [..., 3], world units. A direction need not have length 1.
    - `tmin`, `tmax`: float32, [...] or a number: the points origin + t direction with tmin <= t <= tmax are asked about. By
      default 0 and infinity.

    The shapes in front are broadcast against each other, as numpy does, and outputs have the resulting shape. Arrays are
    read where they lie, at any strides: of a batch with more than one dimension, all rays must lie at one distance from
    each other. Lists, tuples and numbers are taken for small things, such as one direction for all rays. The GIL is released
    meanwhile; the arrays must not change. Invalid rays (NaN, no direction, tmin > tmax) are visible.

    Every query raises `Error` where the library refuses it (e.g. INVALID_OPERATION: not committed), TypeError for an array
    that is not of float32, and ValueError for shapes and layouts that do not fit.
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
            self.add(asset)
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

    def add(self, asset: Asset, transform: Optional[npt.ArrayLike] = None) -> range:
        """Adds a whole asset: all instances in its file, or each object once if it has none (and does not place nothing).

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

    def add_object(self, asset: Asset, object: int = 0, transform: Optional[npt.ArrayLike] = None) -> int:
        """Adds one instance of one object.

        Args:
            asset: as in `add()`.
            object: its number, below `Asset.object_count`.
            transform: as in `add()`, from object to world space.

        Returns:
            the instance's number.
        """
        _check_asset(asset)
        matrix = _matrix(transform)
        instance = ctypes.c_uint32()
        with self._using(change=True) as scene, asset._using() as handle:
            number = _number("object", object)
            check(lib.nifAddInstance(scene, handle, number, _address(matrix), ctypes.byref(instance)))
        return int(instance.value)

    def set_transform(self, instance: int, transform: npt.ArrayLike) -> None:
        """Replaces the transform of one instance. `transform` as in `add_object()`."""
        matrix = _matrix(transform)
        with self._using(change=True) as scene:
            check(lib.nifSetInstanceTransform(scene, _number("instance", instance), _address(matrix)))

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
        """Instances."""
        return int(self._info().instance_count)

    @property
    def committed(self) -> bool:
        """True: no changes since the last commit."""
        return bool(self._info().committed)

    @property
    def bounds(self) -> Optional[Floats]:
        """[2, 3] lowest and highest corner of everything that can block a ray, in world space, at the last commit. A little
        larger than the objects' bounds. None if the scene is empty."""
        info = self._info()
        bounds = np.array([info.bounds_min, info.bounds_max], dtype=np.float32)
        return bounds if (bounds[0] <= bounds[1]).all() else None

    @property
    def resident_bytes(self) -> int:
        """Bytes of memory, without those of assets."""
        return int(self._info().resident_bytes)

    def __repr__(self) -> str:
        if self.closed:
            return "<nifkit.Scene: closed>"
        return f"<nifkit.Scene: {self.instance_count} instances>"

    # ---- Queries

    def _rays(self, origins: Any, directions: Any, tmin: Any, tmax: Any) -> Rays:
        if getattr(_in_fallback, "device", None) is self._device:
            raise Error(ErrorCode.INVALID_OPERATION, "a fallback cannot query the device that called it")
        return Rays(origins, directions, tmin, tmax)

    def query(
        self,
        origins: npt.ArrayLike,
        directions: npt.ArrayLike,
        tmin: Optional[npt.ArrayLike] = None,
        tmax: Optional[npt.ArrayLike] = None,
        *,
        outputs: Union[str, Sequence[str]] = ("visible",),
        out: Out = None,
        fallback: Optional[Fallback] = None,
        confidence: float = 2.0,
    ) -> Answers:
        """Asks for each ray whether anything is in its way. Rays as in the class's text.

        Args:
            outputs: names of `Answers`. Asking for no more than `visible` and `visible_bits` is fastest; the answers are
                the same.
            out: arrays to write to, by these names, instead of new ones: C-contiguous, of the type and shape that
                `Answers` says (uint8 where it says bool is right, too). Then `outputs` means nothing.
            fallback: answers rays that are not certain: `fallback(rays, visible)` gets up to 1,024 numbers of rays
                (int64, [k], ascending; numbers in the batch in C order) with the learned answers (bool, [k]), both
                read-only, and returns k truth values: whether each is visible. They count as certain. It is called on the
                device's threads, which take turns in Python, and must not query the same device. If it raises, so does
                the query.
            confidence: a ray is passed on if it is not certain and its probability p has max(p, 1 - p) < confidence. 0.5
                or less: none; above 1: every ray that is not certain.

        Returns:
            the answers, None for those not asked for.
        """
        rays = self._rays(origins, directions, tmin, tmax)
        arrays = make_outputs(rays, _QUERY_KINDS, outputs, out)
        point_at(rays.query, arrays)
        with self._using() as scene:
            if fallback is None:
                check(lib.nifQuery(scene, ctypes.byref(rays.query)))
            else:
                least = _float("confidence", confidence)
                call = _FallbackCall(fallback, self._device)
                function = NifFallback(call.answer)
                code = lib.nifQueryWithFallback(scene, ctypes.byref(rays.query), least, function, None)
                call.raise_failure()
                check(code)
        return Answers(**arrays)

    def visible(
        self,
        origins: npt.ArrayLike,
        directions: npt.ArrayLike,
        tmin: Optional[npt.ArrayLike] = None,
        tmax: Optional[npt.ArrayLike] = None,
    ) -> Bools:
        """bool, [...]: True where nothing is in the way. Rays as in the class's text."""
        answer = self.query(origins, directions, tmin, tmax, outputs="visible").visible
        assert answer is not None
        return answer

    def probability(
        self,
        origins: npt.ArrayLike,
        directions: npt.ArrayLike,
        tmin: Optional[npt.ArrayLike] = None,
        tmax: Optional[npt.ArrayLike] = None,
    ) -> Floats:
        """float32, [...]: calibrated probability that nothing is in the way. Rays as in the class's text."""
        answer = self.query(origins, directions, tmin, tmax, outputs="probability").probability
        assert answer is not None
        return answer

    def certain(
        self,
        origins: npt.ArrayLike,
        directions: npt.ArrayLike,
        tmin: Optional[npt.ArrayLike] = None,
        tmax: Optional[npt.ArrayLike] = None,
    ) -> Bools:
        """bool, [...]: True where the answer is proven. Rays as in the class's text."""
        answer = self.query(origins, directions, tmin, tmax, outputs="certain").certain
        assert answer is not None
        return answer

    def open_rays(
        self,
        origins: npt.ArrayLike,
        directions: npt.ArrayLike,
        tmin: Optional[npt.ArrayLike] = None,
        tmax: Optional[npt.ArrayLike] = None,
        *,
        outputs: Union[str, Sequence[str]] = ("visible",),
    ) -> OpenRays:
        """Answers what is proven, asks no network, and lists the other rays. At most 2^32 - 1 rays. `outputs` as in
        `query()`. For assets of the encoding `proof` this is the query that they are made for."""
        rays = self._rays(origins, directions, tmin, tmax)
        arrays = make_outputs(rays, _QUERY_KINDS, outputs, None)
        point_at(rays.query, arrays)
        numbers = np.empty(rays.count, dtype=np.uint32)
        low, high = np.empty(rays.count, dtype=np.float32), np.empty(rays.count, dtype=np.float32)
        count = ctypes.c_uint32()
        lists = NifOpenRays()
        lists.capacity = rays.count
        lists.rays, lists.tmin, lists.tmax = numbers.ctypes.data, low.ctypes.data, high.ctypes.data
        lists.count = ctypes.addressof(count)
        with self._using() as scene:
            check(lib.nifQueryOpen(scene, ctypes.byref(rays.query), ctypes.byref(lists)))
        return OpenRays(numbers[: count.value], low[: count.value], high[: count.value], Answers(**arrays))

    def intersect(
        self,
        origins: npt.ArrayLike,
        directions: npt.ArrayLike,
        tmin: Optional[npt.ArrayLike] = None,
        tmax: Optional[npt.ArrayLike] = None,
        *,
        outputs: Union[str, Sequence[str]] = ("hit", "t", "normal", "instance", "object", "triangle"),
        out: Out = None,
    ) -> Hits:
        """Finds where each ray first meets something. Rays as in the class's text.

        Args:
            outputs: names of `Hits`.
            out: arrays to write to, as in `query()`.

        Returns:
            the hits, None for outputs not asked for.
        """
        rays = self._rays(origins, directions, tmin, tmax)
        arrays = make_outputs(rays, _HIT_KINDS, outputs, out)
        hits = NifHits()
        point_at(hits, arrays)
        with self._using() as scene:
            check(lib.nifIntersect(scene, ctypes.byref(rays.query), ctypes.byref(hits)))
        return Hits(**arrays)

    def query_async(
        self,
        origins: npt.ArrayLike,
        directions: npt.ArrayLike,
        tmin: Optional[npt.ArrayLike] = None,
        tmax: Optional[npt.ArrayLike] = None,
        *,
        outputs: Union[str, Sequence[str]] = ("visible",),
        out: Out = None,
    ) -> Job[Answers]:
        """Starts `query()` in the background. With a device of one thread it is answered before this returns. Do not
        change the arrays until the job is done."""
        rays = self._rays(origins, directions, tmin, tmax)
        arrays = make_outputs(rays, _QUERY_KINDS, outputs, out)
        point_at(rays.query, arrays)
        with self._using() as scene:
            query = lambda job: lib.nifQueryAsync(scene, ctypes.byref(rays.query), job)  # noqa: E731
            return start(scene, query, Answers(**arrays), (rays, self._device))

    def intersect_async(
        self,
        origins: npt.ArrayLike,
        directions: npt.ArrayLike,
        tmin: Optional[npt.ArrayLike] = None,
        tmax: Optional[npt.ArrayLike] = None,
        *,
        outputs: Union[str, Sequence[str]] = ("hit", "t", "normal", "instance", "object", "triangle"),
        out: Out = None,
    ) -> Job[Hits]:
        """Starts `intersect()` in the background, as `query_async()` does."""
        rays = self._rays(origins, directions, tmin, tmax)
        arrays = make_outputs(rays, _HIT_KINDS, outputs, out)
        hits = NifHits()
        point_at(hits, arrays)
        with self._using() as scene:
            query = lambda job: lib.nifIntersectAsync(scene, ctypes.byref(rays.query), ctypes.byref(hits), job)  # noqa: E731
            return start(scene, query, Hits(**arrays), (rays, self._device))


class _FallbackCall:
    """A fallback as the library calls it, on any thread. The first exception is kept, and ends the calls."""

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
            # Copies: the library's memory is gone after the call.
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
    if matrix.dtype.kind not in "fiu":
        raise TypeError(f"transform: numbers are needed, not {matrix.dtype}")
    if matrix.shape == (4, 4):
        if (matrix[3] != (0, 0, 0, 1)).any():
            raise ValueError("transform: the last row of a 4x4 matrix has to be 0 0 0 1")
        matrix = matrix[:3]
    if matrix.shape not in ((3, 4), (12,)):
        raise ValueError(f"transform: a matrix of shape (3, 4) or (4, 4) is needed, not {matrix.shape}")
    with np.errstate(over="ignore"):
        return np.ascontiguousarray(matrix, dtype=np.float32).reshape(12)


def _address(matrix: Optional[Floats]) -> Optional[int]:
    return None if matrix is None else matrix.ctypes.data


def _number(name: str, value: int) -> int:
    """Checks what ctypes would cut off."""
    try:
        number = operator.index(value)
    except TypeError:
        raise TypeError(f"{name}: an integer is needed, not this {type(value).__name__}") from None
    if not 0 <= number < 2**32:
        raise Error(ErrorCode.INVALID_ARGUMENT, f"{name}: {number} is not a number from 0 to 2^32 - 1")
    return number


def _float(name: str, value: float) -> ctypes.c_float:
    try:
        return ctypes.c_float(value)
    except (TypeError, OverflowError):
        raise TypeError(f"{name}: a number is needed, not this {type(value).__name__}") from None
