"""What shaders of your own need: the words of objects and scenes, and the functions that read them (docs/shaders.md)."""
from __future__ import annotations

import ctypes
from typing import TYPE_CHECKING, Any, Callable, Union

import numpy as np

from ._abi import ErrorCode, ShaderLanguage
from ._library import Error, check, lib

if TYPE_CHECKING:  # numpy.typing takes a while to load
    import numpy.typing as npt


def shader_source(language: Union[ShaderLanguage, int] = ShaderLanguage.GLSL) -> str:
    """The text of functions for shaders, to be put before your own. It reads what `Asset.shader_tables()` and
    `Scene.shader_tables()` of this version return. Thread-safe.

    Raises:
        Error: INVALID_ARGUMENT if there is no such language.
    """
    source = lib.nifGetShaderSource(language)
    if source is None:
        raise Error(ErrorCode.INVALID_ARGUMENT, f"there are no functions for shaders in the language {language!r}")
    return bytes(source).decode()


def words_of(call: Callable[[Any, int, Any], int]) -> npt.NDArray[np.uint32]:
    """What a call of the library writes: `call(words, capacity, count)`."""
    count = ctypes.c_uint64()
    check(call(None, 0, ctypes.byref(count)))
    words = np.empty(count.value, dtype=np.uint32)
    check(call(words.ctypes.data, words.size, ctypes.byref(count)))
    return words
