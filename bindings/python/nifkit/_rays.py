"""Passes numpy arrays of any strides to the library as rays, without copies, and makes arrays for the answers."""
from __future__ import annotations

import ctypes
import math
from typing import TYPE_CHECKING, Any, Mapping, Optional, Sequence, TypeVar, Union

import numpy as np

from ._abi import ErrorCode, NifRays, Structure
from ._library import Error

if TYPE_CHECKING:  # numpy.typing takes a while to load
    import numpy.typing as npt

    # Outputs: type of an element, and the dimensions that are added to those of the rays.
    Kinds = Mapping[str, tuple[npt.DTypeLike, tuple[int, ...]]]


To = TypeVar("To", bound=Structure)
_Pointers = ctypes.c_void_p * 3


def _as_floats(name: str, value: Any) -> npt.NDArray[np.float32]:
    """Returns `value` itself if it is an array of float32; a copy if it is float64, a number, a list or a tuple."""
    if isinstance(value, (int, float, np.generic, list, tuple)):
        try:
            return np.asarray(value, dtype=np.float32)
        except (ValueError, TypeError):
            raise ValueError(f"{name}: a list or tuple of numbers, in equal lengths, is needed") from None
    array = np.asarray(value)
    if array.dtype == np.float64:
        with np.errstate(over="ignore"):  # becomes infinite
            return array.astype(np.float32, order="C")
    if array.dtype != np.float32:
        raise TypeError(f"{name}: an array of float32 or float64 is needed, not {array.dtype}")
    return array


def _as_masks(value: Any) -> npt.NDArray[np.uint32]:
    """Returns `value` itself if it is an array of uint32; a copy if it has other integers."""
    array = np.asarray(value)
    if array.dtype == np.uint32:
        return array
    if array.dtype.kind not in "iu" and not (array.dtype.kind == "O" and isinstance(value, int)):
        raise TypeError(f"mask: integers are needed, not {array.dtype}")
    if array.size and not (0 <= array.min() and array.max() < 2**32):
        raise Error(ErrorCode.INVALID_ARGUMENT, "mask: a mask is a number from 0 to 2^32 - 1")
    return array.astype(np.uint32, order="C")


def _stride(name: str, array: npt.NDArray[Any], shape: tuple[int, ...]) -> int:
    """Bytes from one ray to the next in an array whose first dimensions are the rays'. Refuses layouts with no fixed stride."""
    if len(shape) == 1:
        return array.strides[0] if shape[0] > 1 else 0
    stride: Optional[int] = None
    inner = 1  # rays per step in this dimension
    for length, step in zip(reversed(shape), reversed(array.strides[: len(shape)])):
        if length == 1:
            continue
        if stride is None:
            stride = step
        elif step != stride * inner:
            raise ValueError(
                f"{name}: rays of shape {shape} do not lie at one distance from each other (strides {array.strides}); "
                f"ask them row by row, or pass a copy: numpy.ascontiguousarray(numpy.broadcast_to({name}, {array.shape}))"
            )
        inner *= length
    return stride or 0


class Rays:
    """A batch of rays: the library's structure, with the arrays that it points into.

    Attributes:
        shape: that of the batch, of which outputs have an entry each.
        count: rays.
        rays: the structure.
    """

    def __init__(self, origins: Any, directions: Any, tmin: Any, tmax: Any, mask: Any) -> None:
        inputs: dict[str, npt.NDArray[Any]]
        inputs = {"origins": _as_floats("origins", origins), "directions": _as_floats("directions", directions)}
        for name, array in inputs.items():
            if array.ndim == 0 or array.shape[-1] != 3:
                raise ValueError(f"{name}: an array of shape (..., 3) is needed, not {array.shape}")
        shapes = [array.shape[:-1] for array in inputs.values()]
        for name, limit in (("tmin", tmin), ("tmax", tmax)):
            if limit is not None:
                inputs[name] = _as_floats(name, limit)
                shapes.append(inputs[name].shape)
        if mask is not None:
            inputs["mask"] = _as_masks(mask)
            shapes.append(inputs["mask"].shape)
        self.shape = shapes[0]
        if any(shape != self.shape for shape in shapes):
            try:
                self.shape = np.broadcast_shapes(*shapes)
            except ValueError:
                got = ", ".join(f"{name} {array.shape}" for name, array in inputs.items())
                raise ValueError(f"the numbers of rays do not fit each other: {got}") from None
        self.count = math.prod(self.shape)
        self.inputs = list(inputs.values())
        self.rays = rays = NifRays()
        rays.count = self.count
        if self.count == 0:
            return
        rays.origin, rays.origin_stride = self._vectors("origins", inputs["origins"])
        rays.direction, rays.direction_stride = self._vectors("directions", inputs["directions"])
        for name in ("tmin", "tmax", "mask"):
            if name in inputs:
                setattr(rays, name, inputs[name].ctypes.data)
                setattr(rays, f"{name}_stride", self._stride(name, inputs[name], self.shape))

    def _vectors(self, name: str, array: npt.NDArray[np.float32]) -> tuple[Any, int]:
        base, step = array.ctypes.data, array.strides[-1]
        return _Pointers(base, base + step, base + 2 * step), self._stride(name, array, (*self.shape, 3))

    def _stride(self, name: str, array: npt.NDArray[Any], shape: tuple[int, ...]) -> int:
        if array.shape != shape:
            array = np.broadcast_to(array, shape)
        # A negative stride is passed in two's complement, in 64 bits.
        return _stride(name, array, self.shape) % 2**64


def make_outputs(
    rays: Rays, kinds: Kinds, names: Union[str, Sequence[str]], out: Optional[Mapping[str, npt.NDArray[Any]]]
) -> dict[str, npt.NDArray[Any]]:
    """Arrays for the answers: `out`, after checks, or new ones of these names."""
    if isinstance(names, str):
        names = (names,)
    wanted = list(names if out is None else out)
    for name in wanted:
        if name not in kinds:
            raise ValueError(f"there is no output '{name}'; there are {', '.join(kinds)}")
    if not wanted:
        raise ValueError(f"ask for at least one output: {', '.join(kinds)}")
    arrays: dict[str, npt.NDArray[Any]] = {}
    for name in wanted:
        dtype, tail = kinds[name]
        shape = ((rays.count + 7) // 8,) if name == "visible_bits" else (*rays.shape, *tail)
        if out is None:
            arrays[name] = np.empty(shape, dtype=dtype)
            continue
        array = arrays[name] = out[name]
        if not isinstance(array, np.ndarray):
            raise TypeError(f"out: {name} is a {type(array).__name__}, not an array")
        same = array.dtype == dtype or (dtype is np.bool_ and array.dtype == np.uint8)
        if not same or array.shape != shape:
            raise ValueError(
                f"out: {name} has to be {np.dtype(dtype).name} of shape {shape}, not {array.dtype} of shape {array.shape}"
            )
        if not array.flags.c_contiguous or not array.flags.writeable:
            raise ValueError(f"out: {name} has to be C-contiguous and writeable")
    if out is not None:
        _refuse_overlap(rays, arrays)
    return arrays


def _refuse_overlap(rays: Rays, arrays: Mapping[str, npt.NDArray[Any]]) -> None:
    outputs = list(arrays.items())
    for i, (name, array) in enumerate(outputs):
        others = rays.inputs + [other for _, other in outputs[:i]]
        if any(np.may_share_memory(array, other) for other in others):
            raise ValueError(f"out: {name} lies in memory of the rays or of another output")


def point_at(structure: To, arrays: Mapping[str, npt.NDArray[Any]]) -> To:
    """Sets the structure's pointers with these names, and returns it."""
    for name, array in arrays.items():
        setattr(structure, name, array.ctypes.data)
    return structure
