#!/usr/bin/env python3
"""Writes what fuzz_rays starts with: files of rays for `nif query`.

    tests/corpus/make_rays.py FOLDER
"""
import pathlib
import struct
import sys

ROWS = [[0.25, 0.5, 2, 0, 0, -1, 0, 1], [3, 3, 2, 0, 1, -1, 0.5, 1e30], [-0.0, 1, 2, 3, 4, 5, -1, float("inf")]]


def npy(version: int, kind: str, order: str, by_columns: bool, columns: int) -> bytes:
    header = f"{{'descr': '{order}{kind}', 'fortran_order': {by_columns}, 'shape': ({len(ROWS)}, {columns}), }}\n".encode()
    rows = [row[:columns] for row in ROWS]
    values = [x for line in (zip(*rows) if by_columns else rows) for x in line]
    length = struct.pack("<H" if version == 1 else "<I", len(header))
    elements = struct.pack(f"{order}{len(values)}{'f' if kind == 'f4' else 'd'}", *values)
    return b"\x93NUMPY" + bytes([version, 0]) + length + header + elements


SEEDS = {
    "csv": b"# rays\r\n0,0,5,0,0,-1\r\n1.5, 2e3 ,-3,0x1p-3,inf,nan # one\r\n",
    "csv-header": b'"tmax";"dz";"dy";"dx";"oz";"oy";"ox"\n1;2;3;4;5;6;7\n;2;3;4;5;6;7\n',
    "blanks": b"\xef\xbb\xbf0 0 5 0 0 -1 0 1\r\t1 2  3 4 5 6 7 1e999\r",
    "json": b'{"origin": [0, 0, 5], "direction": [0, 0, -1], "tmin": null, "tmax": "0x1p0"}\n[1,2,3,4,5,6]\n[1,2,3,4,5,6,NaN,Infinity]\n',
    "many": b"\x1e\x081 2 3 4 5 6\n\x1f1 2 3 4 5\n",
    "npy": npy(1, "f4", "<", False, 6),
    "npy-columns": npy(2, "f8", ">", True, 8),
    "npy-doubles": npy(3, "f8", "<", False, 8),
}

folder = pathlib.Path(sys.argv[1])
folder.mkdir(exist_ok=True)
for name, seed in SEEDS.items():
    (folder / name).write_bytes(seed)
