"""Assets: loaded .nif files, and what is in them."""
from __future__ import annotations

import ctypes
import json
import os
from typing import IO, TYPE_CHECKING, Any, Callable, NamedTuple, Optional, TypeVar, Union

import numpy as np

from ._abi import (
    LOAD_COPY, LOAD_IN_PLACE, NONE, Encoding, ErrorCode, InstanceFlags, NifAssetInfo, NifAssetInstanceInfo, NifObjectInfo, NifPartInfo, Structure,
)
from ._device import Device, check_device, default_device
from ._handle import Handle
from ._library import Error, check, file_name, lib, text, whole
from ._shader import words_of

if TYPE_CHECKING:  # numpy.typing takes a while to load
    import numpy.typing as npt

    Buffer = Union[bytes, bytearray, memoryview, npt.NDArray[np.uint8]]

Item = TypeVar("Item")
Info = TypeVar("Info", bound=Structure)


class Part(NamedTuple):
    """A part of an asset; the bytes of all parts add up to those of the asset."""

    name: str
    """E.g. "planes"; docs/runtime.md lists all."""
    file_bytes: int
    resident_bytes: int


class Object(NamedTuple):
    """An object of an asset."""

    name: str
    encoding: Union[Encoding, int]
    """An int if it is newer than this package; 0 if the object is unsupported."""
    network: int
    """Number of its network, below `Asset.network_count`; means nothing for encodings without networks."""
    bounds: npt.NDArray[np.float32]
    """[2, 3] lowest and highest corner of the source mesh, in object space."""
    bias: float
    """Start shadow rays this far from the surface, in object units."""
    triangles: int
    """Of the source mesh."""
    resident_bytes: int
    proves: bool
    """False: an object of the encoding `proof` that proves only which rays miss it."""
    source_triangles: int
    """The number of triangles in the source mesh, if first hits return numbers of it; 0: they return the object's own."""
    colors: bool
    """Do first hits have the surface's colours?"""
    level: int
    """Above 0: a coarser stand-in for the next object, which is a level below."""
    error: float
    """The largest distance of its surface from the source's, in object units; 0: none or unknown."""
    unsupported: str
    """Why this version cannot answer the object, which cannot be placed then; "" for all others."""
    vertices: int
    """Vertices of the source mesh, if instances can bend (`Scene.set_instance_vertices()`); 0: they cannot."""
    joints: int
    """Of its skin (`Scene.pose_instance()`); 0: it has none."""
    targets: int
    """Its morph targets."""


class AssetInstance(NamedTuple):
    """A placement of an object in an asset's file."""

    name: str
    object: int
    transform: npt.NDArray[np.float32]
    """[3, 4] from object space to that of the asset, rounded to float32; `Scene.add_asset()` uses all digits of the file."""
    parent: Optional[int]
    """Number of an earlier instance of the file that takes this one along when it moves."""
    user: int
    """This and the next two are set by `Scene.add_asset()`."""
    mask: int
    flags: InstanceFlags


class Asset(Handle):
    """A loaded .nif file, made by `load()`. Immutable and thread-safe; any number of scenes of its device can use it. A
    context manager: a scene keeps what it needs of it, even after `close()`. Two are equal if they come from the same load."""

    _kind = "asset"
    _release = lib.nifReleaseAsset

    def __init__(self, value: int, device: Device) -> None:
        super().__init__(value)
        self._device = device
        self._number = value  # never reused
        self._lists: dict[str, tuple[Any, ...]] = {}

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Asset) and self._number == other._number

    def __hash__(self) -> int:
        return hash(self._number)

    @property
    def device(self) -> Device:
        """The device that it was loaded for."""
        return self._device

    def _info(self) -> NifAssetInfo:
        info = NifAssetInfo()
        with self._using() as handle:
            check(lib.nifGetAssetInfo(handle, ctypes.byref(info)))
        return info

    @property
    def object_count(self) -> int:
        """Objects; at least 1."""
        return int(self._info().object_count)

    @property
    def instance_count(self) -> int:
        """Placements of objects in the file. Without any, a scene places each object once, unless the file `places_nothing`."""
        return int(self._info().instance_count)

    @property
    def places_nothing(self) -> bool:
        """Does the file state that it places no object? Then `Scene.add_asset()` adds nothing."""
        return bool(self._info().places_nothing)

    @property
    def network_count(self) -> int:
        """Networks; objects may share them."""
        return int(self._info().network_count)

    @property
    def format_version(self) -> int:
        """Version of the file format."""
        return int(self._info().format_version)

    @property
    def file_bytes(self) -> int:
        """Bytes of the file."""
        return int(self._info().file_bytes)

    @property
    def resident_bytes(self) -> int:
        """Bytes of memory that the library keeps for it."""
        return int(self._info().resident_bytes)

    @property
    def gpu_bytes(self) -> int:
        """Bytes of GPU memory for it; 0 until a scene with it is committed on a GPU."""
        return int(self._info().gpu_bytes)

    @property
    def metadata(self) -> Any:
        """What the baker wrote into the file, read from JSON: mostly a dict; None if there is none.

        Raises:
            Error: DAMAGED_NIF if it is not JSON.
        """
        info = NifAssetInfo()
        with self._using() as handle:  # the text belongs to the asset
            check(lib.nifGetAssetInfo(handle, ctypes.byref(info)))
            if not info.metadata:
                return None
            content = ctypes.string_at(info.metadata, info.metadata_bytes)
        try:
            return json.loads(content)
        except (ValueError, RecursionError) as error:
            raise Error(ErrorCode.DAMAGED_NIF, f"the asset's metadata cannot be read as JSON: {error}") from None

    def _list(self, call: Callable[[int, int, Any], int], info: Info, make: Callable[[Info], Item]) -> tuple[Item, ...]:
        """Everything that `call` lists. An asset never changes, so it is listed only once."""
        with self._using() as handle:
            kind = type(info).__name__
            if kind not in self._lists:
                found: list[Item] = []
                while (code := call(handle, len(found), ctypes.byref(info))) != ErrorCode.INVALID_ARGUMENT:
                    check(code)
                    found.append(make(info))
                self._lists[kind] = tuple(found)
            return self._lists[kind]

    @property
    def parts(self) -> tuple[Part, ...]:
        """The parts of the file and of its memory."""
        return self._list(lib.nifGetPartInfo, NifPartInfo(), _part)

    @property
    def objects(self) -> tuple[Object, ...]:
        """Its objects, in order of their numbers. Listed once, and kept."""
        return self._list(lib.nifGetObjectInfo, NifObjectInfo(), _object)

    @property
    def instances(self) -> tuple[AssetInstance, ...]:
        """The placements in its file, in order of their numbers. Listed once, and kept."""
        return self._list(lib.nifGetAssetInstanceInfo, NifAssetInstanceInfo(), _instance)

    def shader_tables(self, object: int = 0) -> npt.NDArray[np.uint32]:
        """The words of one object for a shader of your own, uint32 in this machine's byte order, to be bound as one read-only
        storage buffer (docs/shaders.md). The device must be made with `shaders="on"`.

        Raises:
            Error: NOT_AVAILABLE if shaders cannot answer the object, INVALID_ARGUMENT if there is no such object,
                INVALID_OPERATION without `shaders="on"`.
        """
        number = whole("object", object)
        with self._using() as handle:
            return words_of(lambda words, capacity, count: int(lib.nifGetShaderTables(handle, number, words, capacity, count)))

    def __repr__(self) -> str:
        if self.closed:
            return "<nifkit.Asset: closed>"
        return f"<nifkit.Asset: {self.object_count} objects, {self.resident_bytes} bytes>"


def _part(info: NifPartInfo) -> Part:
    return Part(text(info.name), int(info.file_bytes), int(info.resident_bytes))


def _object(info: NifObjectInfo) -> Object:
    try:
        encoding: Union[Encoding, int] = Encoding(info.encoding)
    except ValueError:
        encoding = int(info.encoding)
    return Object(
        text(info.name), encoding, int(info.network), kept([info.bounds_min, info.bounds_max]), float(info.bias),
        int(info.triangles), int(info.resident_bytes), bool(info.proves), int(info.source_triangles), bool(info.colors),
        int(info.level), float(info.error), text(info.unsupported), int(info.vertices), int(info.joints), int(info.targets),
    )


def _instance(info: NifAssetInstanceInfo) -> AssetInstance:
    parent = None if info.parent == NONE else int(info.parent)
    return AssetInstance(
        text(info.name), int(info.object), kept(info.transform).reshape(3, 4), parent, int(info.user), int(info.mask),
        InstanceFlags(info.flags),
    )


def kept(numbers: Any) -> npt.NDArray[np.float32]:
    """A read-only array, because it is shared."""
    array = np.array(numbers, dtype=np.float32)
    array.flags.writeable = False
    return array


def load(
    source: Union[str, os.PathLike[str], Buffer, IO[bytes]], *, device: Optional[Device] = None, in_place: bool = False
) -> Asset:
    """Loads a .nif file. Safe on untrusted files. Thread-safe.

    Args:
        source: a path (str or os.PathLike); or the content of a file: bytes or any other contiguous buffer, which is copied,
            or a binary file that is open, which is read to its end.
        device: what will answer; by default the CPU with all its threads.
        in_place: the file is mapped instead of read, and must not change while the asset lives. Only with a path.

    Raises:
        Error: with the code and sentence of the library, e.g. FILE_NOT_FOUND, NOT_A_NIF, DAMAGED_NIF.
    """
    check_device(device)
    device = device or default_device()
    handle = ctypes.c_void_p()
    if isinstance(source, (str, os.PathLike)):
        path = file_name(source)
        with device._using() as owner:
            check(lib.nifLoadAssetFile(owner, path, LOAD_IN_PLACE if in_place else LOAD_COPY, ctypes.byref(handle)))
    else:
        if in_place:
            raise Error(ErrorCode.INVALID_ARGUMENT, "in_place: only a path's file can be used in place, not a buffer")
        name = getattr(source, "name", None)
        content: Any = source.read() if hasattr(source, "read") else source
        try:
            view = memoryview(content).cast("B")
        except (TypeError, ValueError) as error:
            kind = type(content).__name__
            raise TypeError(f"load() takes a path, a contiguous buffer or a binary file, not this {kind}: {error}") from None
        # numpy can take the address of read-only buffers, but not of empty ones.
        array = np.frombuffer(view, dtype=np.uint8) if view.nbytes else np.zeros(1, dtype=np.uint8)
        with device._using() as owner:
            code = lib.nifLoadAssetMemory(owner, array.ctypes.data, view.nbytes, LOAD_COPY, ctypes.byref(handle))
            check(code, name if isinstance(name, str) else "memory")
    assert handle.value is not None
    return Asset(handle.value, device)
