"""Devices: the CPU or a GPU that answers queries, and a list of those on this machine."""
from __future__ import annotations

import ctypes
import os
import threading
from typing import NamedTuple, Optional, Union

from ._abi import ErrorCode, NifBackendInfo, NifGpuInfo, NifDeviceInfo
from ._handle import Handle
from ._library import Error, check, file_name, lib, text


class Device(Handle):
    """The CPU or a GPU, with threads and work memory for its queries. Thread-safe. A context manager.

    Args:
        threads: threads that work on one query; 0: as many as the machine has.
        isa: instruction set of the CPU's kernels: "auto", "scalar", "sse4", "avx2", "avx512" or "neon". It never changes
            an answer, and no setting below but `precision` does.
        queries: queries that can run at the same time without waiting; 0: as many as the machine has threads.
        backend: "cpu"; "gpu", of AMD or NVIDIA; or one of the two: "cuda" or "hip".
        options: other keys of the library's configuration string. For the CPU: `memory` ("auto" or "least": smaller tables,
            slower rays), `shaders` ("off", or "on" for `Asset.shader_tables()`). For GPUs: `device` (number of the GPU), `module` (file of the GPU module), `pipeline` ("auto",
            "on" or "off"), `precision` ("single" or "half").

    Raises:
        Error: INVALID_ARGUMENT for an unknown key or value, NOT_AVAILABLE if this machine or build lacks what is asked for.
    """

    _kind = "device"
    _release = lib.nifReleaseDevice

    def __init__(
        self,
        threads: int = 0,
        isa: str = "auto",
        *,
        queries: int = 0,
        backend: str = "cpu",
        **options: Union[int, str],
    ) -> None:
        keys: dict[str, Union[int, str]] = {"threads": threads, "isa": isa, "queries": queries, "backend": backend}
        keys.update(options)
        for key, value in keys.items():
            if any(sign in key for sign in ",=\0"):
                raise Error(ErrorCode.INVALID_ARGUMENT, f"a key has no comma, no = and no 0 in it, as {key!r} has")
            if "," in str(value) or "\0" in str(value):
                raise Error(ErrorCode.INVALID_ARGUMENT, f"{key}: a value has no comma and no 0 in it, as {value!r} has")
        handle = ctypes.c_void_p()
        config = file_name(",".join(f"{key}={value}" for key, value in keys.items()))  # one value is a file's name
        check(lib.nifNewDevice(config, None, ctypes.byref(handle)))
        assert handle.value is not None
        super().__init__(handle.value)

    def _info(self) -> tuple[int, str, str, str]:
        info = NifDeviceInfo()
        with self._using() as handle:  # the texts belong to the device
            check(lib.nifGetDeviceInfo(handle, ctypes.byref(info)))
            return int(info.threads), text(info.isa), text(info.backend), text(info.gpu)

    @property
    def threads(self) -> int:
        """Most threads that one query uses."""
        return self._info()[0]

    @property
    def isa(self) -> str:
        """Instruction set in use, e.g. "avx512"."""
        return self._info()[1]

    @property
    def backend(self) -> str:
        """"cpu", "cuda" or "hip"."""
        return self._info()[2]

    @property
    def gpu(self) -> str:
        """Name of the GPU; "" for the CPU."""
        return self._info()[3]

    def __repr__(self) -> str:
        if self.closed:
            return "<nifkit.Device: closed>"
        threads, isa, backend, _ = self._info()
        return f"<nifkit.Device: {backend}, {isa}, threads={threads}>"


def check_device(device: Optional[Device]) -> None:
    if device is not None and not isinstance(device, Device):
        raise TypeError(f"device: a nifkit.Device or None is needed, not this {type(device).__name__}")


_default: Optional[Device] = None
_default_lock = threading.Lock()


def default_device() -> Device:
    """The device of objects that are made without one: the CPU with all its threads. Made at the first call."""
    global _default
    with _default_lock:
        if _default is None or _default.closed:
            _default = Device()
        return _default


def _forget_default() -> None:
    """For a forked process, which has none of its parent's threads."""
    global _default, _default_lock
    _default_lock = threading.Lock()
    _default = None


os.register_at_fork(after_in_child=_forget_default)


class BackendInfo(NamedTuple):
    """A backend of this version of the library."""

    name: str
    """"cpu", "cuda" or "hip"."""
    available: bool
    reason: str
    """One sentence on why it is not available; "" if it is."""


class GpuInfo(NamedTuple):
    """A GPU."""

    name: str
    target: str
    """What its code is compiled for, e.g. "gfx1100" or "sm_90"."""
    driver: str
    memory_bytes: int
    available: bool
    reason: str
    """One sentence on why it cannot be used; "" if it can."""
    backend: str
    """"cuda" or "hip"."""
    pci_address: str
    """E.g. "0000:3b:00.0", as lspci writes it."""
    uuid: Optional[bytes]
    """[16] As Vulkan's deviceUUID; None if the driver does not report it."""
    luid: Optional[bytes]
    """[8] As Vulkan's deviceLUID; None except on Windows."""


def backends() -> list[BackendInfo]:
    """The backends of this version, and why one is not available. Looks for drivers and GPUs each time. Thread-safe."""
    found: list[BackendInfo] = []
    info = NifBackendInfo()
    while True:
        code = lib.nifGetBackendInfo(len(found), ctypes.byref(info))
        if code == ErrorCode.INVALID_ARGUMENT:
            return found
        check(code)
        found.append(BackendInfo(text(info.name), bool(info.available), text(info.reason)))


def gpus() -> list[GpuInfo]:
    """The GPUs of this machine, as `Device(backend="gpu", device=N)` numbers them; [] if there are none:
    `backends()` says why. Thread-safe."""
    found: list[GpuInfo] = []
    info = NifGpuInfo()
    while True:
        code = lib.nifGetGpuInfo(len(found), ctypes.byref(info))
        if code in (ErrorCode.INVALID_ARGUMENT, ErrorCode.NOT_AVAILABLE):
            return found
        check(code)
        found.append(
            GpuInfo(
                text(info.name), text(info.target), text(info.driver),
                int(info.memory_bytes), bool(info.available), text(info.reason), text(info.backend),
                f"{info.pci_domain:04x}:{info.pci_bus:02x}:{info.pci_device:02x}.0",
                bytes(info.uuid) if any(info.uuid) else None,
                bytes(info.luid) if info.has_luid else None,
            )
        )
