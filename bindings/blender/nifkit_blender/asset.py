"""The asset, as the operators that show something ask it. Needs numpy, and the package nifkit inside this add-on."""
from __future__ import annotations

import os
import shutil
import sys
import tempfile
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Iterator

from .long_operator import Failure


def package() -> Any:
    """The package nifkit. Raises Failure where numpy or the C library is missing."""
    try:
        with own_library():
            from . import nifkit
    except ImportError as error:
        if (error.name or "").split(".")[0] == "numpy":
            version = f"{sys.version_info.major}.{sys.version_info.minor}"
            raise Failure(f"Blender's Python {version} has no numpy, which showing an asset needs; install it there") from None
        raise Failure(f"The library of this add-on cannot be used: {error}") from None
    return nifkit


@contextmanager
def own_library() -> Iterator[None]:
    """Who installs the add-on again while Blender runs writes into its files, and code that changes while it is used crashes.
    So what the package loads is a copy, whose name is gone at once. (Windows lets nobody write there.)"""
    library = Path(__file__).with_name("nifkit") / "libnif.so"
    if f"{__package__}.nifkit" in sys.modules or "NIF_LIBRARY" in os.environ or not library.exists():
        yield
        return
    try:
        folder = tempfile.TemporaryDirectory(prefix="nifkit-")
        copy = shutil.copy(library, folder.name)
    except OSError as error:
        raise Failure(f"The library of this add-on cannot be copied to be used: {error}") from None
    with folder:
        os.environ["NIF_LIBRARY"] = str(copy)
        try:
            yield
        finally:
            del os.environ["NIF_LIBRARY"]


class Asset:
    """An asset in the world as it is in its file. A context manager.

    Attributes:
        bias: how far from a surface its rays should start, in Blender's units.
        bounds: lowest and highest corner of what can block a ray.

    Raises:
        Failure: the file cannot be used.
    """

    def __init__(self, path: str) -> None:
        nifkit = package()
        self._error = nifkit.Error
        if not path:
            raise Failure("Choose an asset, or bake one")
        try:
            with nifkit.load(path) as asset:
                if any(thing.encoding == nifkit.Encoding.PROOF for thing in asset.objects):
                    raise Failure(f"{path}: an asset of the encoding proof leaves rays open; bake another one")
                self.bias = max(thing.bias for thing in asset.objects)
                self._scene = nifkit.Scene(asset)
            self.bounds = self._scene.bounds
        except nifkit.Error as error:
            raise Failure(str(error)) from None

    def visible(self, origins: Any, directions: Any, distance: float) -> Any:
        """Whether nothing is in the way of rays, [...] of bool; origins and directions are float32, [..., 3], broadcast against
        each other. Directions have length 1."""
        try:
            return self._scene.visible(origins, directions, tmax=distance)
        except self._error as error:
            raise Failure(str(error)) from None

    def __enter__(self) -> Asset:
        return self

    def __exit__(self, *_: object) -> None:
        self._scene.close()
