"""Baking: meshes in arrays or files become assets, by the program `nif`."""
from __future__ import annotations

import json
import os
import tempfile
from typing import TYPE_CHECKING, Any, Optional, Sequence, Union

import numpy as np

from ._abi import ErrorCode
from ._asset import Asset, load
from ._device import Device, check_device
from ._library import Error
from ._program import Progress, find_program, run

if TYPE_CHECKING:  # numpy.typing takes a while to load
    import numpy.typing as npt

    Option = Union[None, bool, int, float, str, Sequence[str]]
    Path = Union[str, os.PathLike[str]]

_INDEX_OUT_OF_RANGE = 18  # exit code of nif


def bake(
    vertices: npt.ArrayLike,
    triangles: npt.ArrayLike,
    path: Optional[Path] = None,
    *,
    colors: Optional[npt.ArrayLike] = None,
    name: str = "mesh",
    progress: Optional[Progress] = None,
    device: Optional[Device] = None,
    **options: Option,
) -> Asset:
    """Bakes a mesh into an asset. Takes seconds to minutes, in a process of its own; the GIL is released.

    Args:
        vertices: [n, 3] positions. Far from the origin for its size, a mesh of float64 or integers is kept relative to an
            offset, so that nothing is lost; the asset's instance has it as its translation (docs/meshes.md).
        triangles: [m, 3] numbers of vertices, from 0 on.
        path: where to write the .nif file, too; None: it is not kept.
        colors: [n, 3] sRGB colours of the vertices, uint8 or floats from 0 to 1: first hits then return colours.
        name: of the object.
        progress: called on this thread ten times a second with the part that is done, 0 to 1, and a text. If it returns
            False, the bake is cancelled: it raises CANCELLED, and no file is left, but of a bake that trained for more
            than 30 seconds `PATH.checkpoint`, from which `resume=True` goes on. What it raises, bake() raises.
        device: of the asset that is returned, as in `load()`.
        options: those of `nif bake`, with underscores: `preset="fast"`, `encoding="exact"`, `prefer="speed"`,
            `max_error=0.005`, `max_bytes="100kB"`, `rays=0` (measure no errors), `threads=1`, `seed=1`, ...
            docs/command-line.md lists them, and so does `python -m nifkit bake --help`.

    Returns:
        the asset, loaded. The same arrays and options give the same bytes.

    Raises:
        Error: NOT_AVAILABLE if the program `nif` is not installed; else with the exit code and sentence of `nif`, e.g. 17 for
            a vertex that is not finite, 50 if `max_bytes` or `max_error` cannot be reached.
        TypeError, ValueError: for arrays of wrong types and shapes.
    """
    check_device(device)
    positions = _positions(vertices)
    corners = _corners(triangles, len(positions))
    paints = None if colors is None else _colors(colors, len(positions))
    if paints is not None:
        options.setdefault("colors", True)
    if not name or "/" in name or "\0" in name:
        raise ValueError(f"name: {name!r} cannot be the name of a file, from which objects have their names")
    with tempfile.TemporaryDirectory(prefix="nifkit-") as folder:
        mesh = os.path.join(folder, f"{name}.ply")
        _write_ply(mesh, positions, corners, paints)
        output = os.path.join(folder, f"{name}.nif") if path is None else os.fspath(path)
        _run_bake(mesh, output, progress, options, hidden=os.path.join(folder, ""))
        return load(output, device=device)


def bake_file(mesh: Path, path: Path, *, progress: Optional[Progress] = None, **options: Option) -> dict[str, Any]:
    """Bakes a mesh file (.obj, .ply, .stl, .off, .gltf, .glb, .drc, also .gz and .zst) into a .nif file.

    Args:
        mesh: the file; its meshes become objects, and its nodes instances. What is placed once and never moves against each
            other becomes one object, unless `no_merge=True`.
        path: the .nif file to write.
        progress, options: as in `bake()`.

    Returns:
        the report of `nif bake --json` (docs/command-line.md): `bytes`, `seconds`, `sets` with errors, `notes`, ...

    Raises:
        Error: as `bake()`.
    """
    return _run_bake(os.fspath(mesh), os.fspath(path), progress, options)


def _run_bake(
    mesh: str, output: str, progress: Optional[Progress], options: dict[str, Option], hidden: str = ""
) -> dict[str, Any]:
    if not mesh or not output:
        raise Error(ErrorCode.INVALID_ARGUMENT, f"the path of the {'asset' if mesh else 'mesh'} is empty")
    arguments = ["bake", f"--output={output}", "--json"]
    for name, value in options.items():
        option = "--" + name.replace("_", "-")
        if name in ("output", "json", "quiet", "manifest", "help") or len(name) == 1:
            raise ValueError(f"{name} is no option here; see help(nifkit.bake)")
        if value is None or value is False:
            continue
        if value is True:
            arguments.append(option)
            continue
        values = value if isinstance(value, (list, tuple)) else [value]
        if any(not str(item) for item in values):
            raise Error(ErrorCode.INVALID_ARGUMENT, f"{name}: its value is empty")
        arguments += [f"{option}={item}" for item in values]
    if any("\0" in argument for argument in (*arguments, mesh)):
        raise ValueError("an option or path of nif has no 0 in it")
    said = run([*arguments, "--", mesh], progress, hidden)
    try:
        report = json.loads(said)
    except (ValueError, RecursionError):
        report = None
    if not isinstance(report, dict):
        raise Error(ErrorCode.UNKNOWN, f"{find_program()} wrote no report that can be read; is it nifkit's program `nif`?")
    return report


def _positions(vertices: npt.ArrayLike) -> npt.NDArray[Any]:
    array = np.asarray(vertices)
    if array.dtype.kind not in "fiu":
        raise TypeError(f"vertices: an array of numbers is needed, not {array.dtype}")
    if array.ndim != 2 or array.shape[1] != 3:
        raise ValueError(f"vertices: an array of shape (n, 3) is needed, not {array.shape}")
    with np.errstate(over="ignore"):  # too large: infinite, which nif refuses
        floats = array.astype("<f4")
        wide = array.astype("<f8")
    return wide if array.dtype.itemsize > 2 and not np.array_equal(floats, wide, equal_nan=True) else floats


def _corners(triangles: npt.ArrayLike, vertices: int) -> npt.NDArray[np.int32]:
    array = np.asarray(triangles)
    if array.size == 0 and array.dtype.kind == "f":
        array = array.astype(np.int32)  # an empty list
    if array.dtype.kind not in "iu":
        raise TypeError(f"triangles: an array of integers is needed, not {array.dtype}")
    if array.ndim != 2 or array.shape[1] != 3:
        raise ValueError(f"triangles: an array of shape (m, 3) is needed, not {array.shape}")
    if array.size and not (0 <= array.min() and array.max() < min(vertices, 2**31)):
        wrong = array.min() if array.min() < 0 else array.max()
        raise Error(_INDEX_OUT_OF_RANGE, f"triangles: there is no vertex {wrong}; there are {vertices}, from 0 on")
    return array.astype("<i4")


def _colors(colors: npt.ArrayLike, vertices: int) -> npt.NDArray[Any]:
    array = np.asarray(colors)
    if array.dtype != np.uint8 and array.dtype.kind != "f":
        raise TypeError(f"colors: an array of uint8 or floats is needed, not {array.dtype}")
    if array.shape != (vertices, 3):
        raise ValueError(f"colors: an array of shape {(vertices, 3)} is needed, not {array.shape}")
    if array.dtype.kind == "f" and not ((array >= 0) & (array <= 1)).all():
        raise Error(ErrorCode.INVALID_ARGUMENT, "colors: floats have to be from 0 to 1")
    return array if array.dtype == np.uint8 else array.astype("<f4")


def _write_ply(
    path: str, vertices: npt.NDArray[Any], triangles: npt.NDArray[np.int32], colors: Optional[npt.NDArray[Any]]
) -> None:
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(vertices)}"]
    header += [f"property {'float' if vertices.dtype.itemsize == 4 else 'double'} {axis}" for axis in "xyz"]
    columns: list[Any] = [("position", vertices.dtype, 3)]
    if colors is not None:
        kind = "uchar" if colors.dtype == np.uint8 else "float"
        header += [f"property {kind} {color}" for color in ("red", "green", "blue")]
        columns.append(("color", colors.dtype, 3))
    header += [f"element face {len(triangles)}", "property list uchar int vertex_indices", "end_header", ""]
    records = np.empty(len(vertices), dtype=columns)
    records["position"] = vertices
    if colors is not None:
        records["color"] = colors
    faces = np.empty(len(triangles), dtype=[("count", "u1"), ("corners", "<i4", 3)])
    faces["count"], faces["corners"] = 3, triangles
    with open(path, "wb") as file:
        file.write("\n".join(header).encode("ascii"))
        records.tofile(file)
        faces.tofile(file)
