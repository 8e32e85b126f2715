#!/usr/bin/env python3
"""Writes what fuzz_api starts with: sequences of calls, spelled as tests/fuzz/fuzz_api.cpp reads them.

    tests/corpus/make_api.py FOLDER
"""
import pathlib
import sys


def device(slot=0, config=0, callbacks=0):
    """callbacks: 1 for a log, 2 for a task runner, 4 for two threads; their sum."""
    return bytes([0, slot, config, callbacks])


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


def ask(of, count=9, mask=None):
    """mask: a number of any_mask(), for all rays."""
    return bytes([11, of]) + rays(count) + (b"\0" if mask is None else bytes([1, 1, mask]))


def job(of, slot, count=5, what=0):
    """what: 1 to run a task, 3 to cancel the job, too."""
    return bytes([14, of, slot]) + rays(count) + bytes([what])


def set_mask(of, instance, mask):
    return bytes([22, of, instance, 0, mask])


def set_flags(of, instance, flags):
    return bytes([22, of, instance, 1, 1, flags])


def set_user(of, instance, user):
    return bytes([22, of, instance, 2]) + user.to_bytes(4, "big") + b"\0"


def remove(of, instance):
    return bytes([25, of, instance])


def place(x, far):
    """On all axes: x, 2^23 further away if `far`."""
    return (bytes([4]) + number(x) + bytes([far])) * 3


def set_origin(of, instance, x, far):
    return bytes([28, of, instance]) + place(x, far) + bytes([1])


def set_scene_origin(of, x, far):
    return bytes([30, of]) + place(x, far) + bytes([1])


def move_many(of, stride, instances):
    return (bytes([27, of, stride, 0, len(instances)]) +
            b"".join(bytes([instance]) + matrix([(3, 1)]) for instance in instances))


def ask_back(of):
    return bytes([31, of])


def load_piecewise(device_slot, slot, which, reads=None, lie=5):
    return bytes([33, device_slot, slot, which]) + (b"\1" if reads is None else bytes([0, reads])) + bytes([1, lie])


def run_tasks(count):
    return bytes([34, count - 1])


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
    for which in range(6):
        calls = [device(0, 0, 7), load_piecewise(0, 0, which), scene(0, 0), add(0, 0, 1, 0), add(0, 0, 0, 0),
                 add(0, 0, 0, 1, [(3, 1)]), set_mask(0, 0, 2), set_user(0, 1, 99), commit(0), ask(0, 5),
                 ask(0, 5, 2), job(0, 0, 9, 3), set_flags(0, 0, 1), commit(0), ask(0), set_origin(0, 1, 0.5, 1),
                 set_scene_origin(0, 0.25, 1), commit(0), ask(0), ask_back(0), remove(0, 0), commit(0), ask(0),
                 add(0, 0, 0, 0), move_many(0, 0, [0, 1]), move_many(0, 3, [1, 0]), commit(0), ask(0, 5, 3),
                 run_tasks(1), job(0, 1, 5, 1), ask_back(0), info(0, 0, 0)]
        (folder / f"changed-{which}").write_bytes(b"".join(calls))
    calls = [device(0, 9), device(), load_piecewise(1, 1, 0, 1), load_piecewise(1, 1, 1, None, 0), damaged(0, 0, 99, 1, 3), damaged(0, 5, 1000, 0, 0), load(2, 0, 0, 0),
             scene(3, 0), add(0, 0, 0, 0), ask(0, 1), commit(2), load(0, 0, 0, 0), scene(0, 0), ask(0, 2),
             add(0, 0, 0, 1, [(0, 0), (5, 0)]), move(0, 9, []), let_go(1, 1), let_go(1, 0), let_go(1, 0),
             add(0, 0, 1, 0), info(0, 0, 0)]
    (folder / "refused").write_bytes(b"".join(calls))


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(pathlib.Path(sys.argv[1]))
