"""Finds and loads the C library, and turns its codes into exceptions."""
from __future__ import annotations

import ctypes
import operator
import os
from pathlib import Path
from typing import Union

from ._abi import ABI, FUNCTIONS, ErrorCode

__all__ = ["Error", "check", "lib", "library_version", "whole"]


class Error(Exception):
    """What nifkit refuses.

    Attributes:
        code: an `ErrorCode`; of a bake, the exit code of the program `nif`, which may have no name there; then an int.
        message: one sentence.
    """

    code: Union[ErrorCode, int]
    message: str

    def __init__(self, code: int, message: str) -> None:
        super().__init__(code, message)
        try:
            self.code = ErrorCode(code)
        except ValueError:
            self.code = code
        self.message = message

    def __str__(self) -> str:
        return self.message


def _load() -> ctypes.CDLL:
    """Loads the library that NIF_LIBRARY names; else the one in this package; else the system's."""
    chosen = os.environ.get("NIF_LIBRARY")
    packaged = Path(__file__).with_name("libnif.so")
    soname = "libnif.so.{}.{}".format(*ABI)
    name = chosen or (str(packaged) if packaged.exists() else soname)
    try:
        library = ctypes.CDLL(name)
        functions = {function: getattr(library, function) for function in FUNCTIONS}
    except OSError as error:
        where = "NIF_LIBRARY names it" if chosen else f"it is neither in {packaged.parent} nor where the system looks"
        raise ImportError(f"cannot load nifkit's runtime, {name}: {error} ({where})") from None
    except AttributeError as error:
        raise ImportError(f"{name} is not the runtime of nifkit {ABI[0]}.{ABI[1]}: {error}") from None
    for function, (result, parameters) in FUNCTIONS.items():
        functions[function].restype = result
        functions[function].argtypes = parameters
    version = int(library.nifGetVersion())
    if (version // 10000, version // 100 % 100) != ABI:
        found = f"{version // 10000}.{version // 100 % 100}"
        raise ImportError(f"{name} is version {found} of nifkit's runtime; this package is made for {ABI[0]}.{ABI[1]}")
    return library


lib = _load()


def library_version() -> str:
    """Version of the loaded library, "major.minor.patch"."""
    version = int(lib.nifGetVersion())
    return f"{version // 10000}.{version // 100 % 100}.{version % 100}"


def text(value: bytes | None) -> str:
    """Decodes a text of the library. File names in it may have any encoding."""
    return (value or b"").decode("utf-8", "backslashreplace")


def file_name(path: str | os.PathLike[str]) -> bytes:
    """Encodes a file's name for the library."""
    try:
        name = os.fsencode(path)
    except UnicodeEncodeError:
        raise Error(ErrorCode.INVALID_ARGUMENT, f"{path!r} cannot be the name of a file") from None
    if b"\0" in name:
        raise Error(ErrorCode.INVALID_ARGUMENT, "a path has no 0 in it")
    return name


def check(code: int, memory: str = "memory") -> None:
    """Raises an `Error` with the sentence of the last call on this thread, unless `code` is OK. `memory`: what to call an
    asset that is loaded from memory."""
    if code != ErrorCode.OK:
        message = text(lib.nifGetErrorMessage())
        if message.startswith("memory: "):
            message = memory + message[len("memory") :]
        raise Error(code, message)


def whole(name: str, value: int, bits: int = 32) -> int:
    """Checks the range of a number, because ctypes would truncate it."""
    try:
        number = operator.index(value)
    except TypeError:
        raise TypeError(f"{name}: an integer is needed, not this {type(value).__name__}") from None
    if not 0 <= number < 2**bits:
        raise Error(ErrorCode.INVALID_ARGUMENT, f"{name}: {number} is not a number from 0 to 2^{bits} - 1")
    return number
