"""Numbers and colours, which only hits and programs use (docs/format.md, "Numbers", "Colours", "The payload of
numbers").
"""

import struct

from shell import PAYLOAD, Payloads, require, reserved

SOURCE_TRIANGLES, SOURCE_VERTICES = 1, 4
KINDS = range(SOURCE_TRIANGLES, SOURCE_VERTICES + 1)


def read_numbers(file, only=None):
    """Numbers by kind and object. only: the object, or all of them."""
    found = {kind: {} for kind in KINDS}
    if "NUMS" not in file.sections:
        return found
    payloads = Payloads(file.sections["NVAL"], 0 if only is None else None)
    last = (-1, -1)
    for nth, (which, kind, n, zero, *payload) in enumerate(file.sections["NUMS"].records("4I" + PAYLOAD)):
        place = f"numbers {nth}"
        require(which < len(file.objects), place, f"object {which}")
        require(last < (which, kind), place, f"object {which} and kind {kind} do not follow the ones before")
        last = which, kind
        item = file.objects[which]
        if item.unsupported or kind not in KINDS or only not in (None, which):
            continue
        reserved((zero,), place)
        require("triangles" in item.parts, place, "an object without triangles")
        n = n or 2**32
        tree = item.triangles
        count = len(tree.vertices) if kind == SOURCE_VERTICES else len(tree.triangles)
        found[kind][which] = unpack(payloads.take(payload, place), count, n, place)
    return found


def unpack(payload, count, n, place):
    bits = max((n - 1).bit_length(), 1)
    size = (bits * count + 31) // 32 * 4
    require(len(payload) == size, place, f"a payload of {len(payload)} bytes, not {size}")
    rest = int.from_bytes(payload, "little")
    numbers = []
    for _ in range(count):
        numbers.append(rest & ((1 << bits) - 1))
        require(numbers[-1] < n, place, f"a number that is not below {n}")
        rest >>= bits
    require(rest == 0, place, "bits behind the last number are not zero")
    return numbers


def read_colours(file, only=None):
    """The packed colours of surface voxels, by object."""
    found = {}
    if "COLR" not in file.sections:
        return found
    payloads = Payloads(file.sections["CVAL"], 0 if only is None else None)
    last = -1
    for nth, (which, count, *zeros, offset, length, crc, zero) in enumerate(file.sections["COLR"].records("4I" + PAYLOAD)):
        place = f"colours {nth}"
        require(last < which < len(file.objects), place, f"object {which}")
        last = which
        item = file.objects[which]
        if item.unsupported or only not in (None, which):
            continue
        reserved(zeros, place)
        require("planes" in item.parts, place, "an object without surface voxels")
        voxels = item.planes.grid.surface_voxels
        require(count == voxels, place, f"{count} surface voxels, not {voxels}")
        payload = payloads.take((offset, length, crc, zero), place)
        require(len(payload) == 2 * count, place, f"a payload of {len(payload)} bytes, not {2 * count}")
        found[which] = struct.unpack(f"<{count}H", payload)
    return found
