#!/usr/bin/env python3
"""Writes what fuzz_api starts with: sequences of calls, spelled as tests/fuzz/fuzz_api.cpp reads them.

    tests/corpus/make_api.py FOLDER
"""
import pathlib
import sys


def device(slot=0, config=0):
    return bytes([0, slot, config])


def load(device_slot, slot, which, borrow):
    return bytes([1, device_slot, slot, which, borrow])


def scene(device_slot, slot):
    return bytes([3, device_slot, slot])


def number(x):
    return bytes([0, int(x * 16) & 255])


def matrix(changes):
    return bytes([len(changes)]) + b"".join(bytes([i]) + number(x) for i, x in changes)


def add(to, asset, whole, placed, changes=(), which=0):
    return bytes([4, to, asset, whole, placed]) + matrix(changes) + bytes([which])


def move(of, instance, changes):
    return bytes([7, of, instance]) + matrix(changes)


def commit(of):
    return bytes([8, of])


def rays(count):
    out = bytes([count - 1])
    for i in range(count):
        for axis in range(3):
            out += number(((i * 5 + axis * 3) % 9 - 4) / 2)
        for axis in range(3):
            out += number(((i * 7 + axis) % 5 - 2) / 2 or 0.5)
        out += bytes([1, 1])
    return out


def ask(of, count=9):
    return bytes([11, of]) + rays(count)


def job(of, slot, count=5):
    return bytes([14, of, slot]) + rays(count)


def info(asset, which, of):
    return bytes([15, asset, which, of])


def retain(kind, slot):
    return bytes([16, kind, slot])


def let_go(kind, slot):
    return bytes([18, kind, slot])


def damaged(device_slot, which, at, flip, bit):
    return bytes([17, device_slot, which]) + at.to_bytes(4, "big") + bytes([flip, bit])


def main(folder):
    folder.mkdir(parents=True, exist_ok=True)
    for which in range(6):
        calls = [device(), load(0, 0, which, which % 2), scene(0, 0), add(0, 0, 1, 1, [(3, 0.5)]),
                 add(0, 0, 0, 1, [(0, 2), (7, 1)], which % 2), commit(0), ask(0), job(0, 0), info(0, 0, 0),
                 move(0, 0, [(3, 1)]), ask(0, 2), commit(0), ask(0, 5), let_go(1, 0), let_go(0, 0), ask(0, 3)]
        (folder / f"encoding-{which}").write_bytes(b"".join(calls))
    calls = [device(0, 2), device(1, 0), load(0, 0, 5, 0), load(1, 1, 5, 1), scene(0, 0), scene(1, 1),
             add(0, 0, 1, 0), add(1, 1, 1, 0), add(0, 1, 1, 0), commit(0), commit(1), ask(0), ask(1), job(1, 1),
             retain(2, 0), let_go(2, 0), let_go(2, 0), ask(0, 1), let_go(0, 1), commit(1), ask(1, 3)]
    (folder / "several").write_bytes(b"".join(calls))
    calls = [device(0, 9), device(), damaged(0, 0, 99, 1, 3), damaged(0, 5, 1000, 0, 0), load(2, 0, 0, 0),
             scene(3, 0), add(0, 0, 0, 0), ask(0, 1), commit(2), load(0, 0, 0, 0), scene(0, 0), ask(0, 2),
             add(0, 0, 0, 1, [(0, 0), (5, 0)]), move(0, 9, []), let_go(1, 1), let_go(1, 0), let_go(1, 0),
             add(0, 0, 1, 0), info(0, 0, 0)]
    (folder / "refused").write_bytes(b"".join(calls))


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(pathlib.Path(sys.argv[1]))
