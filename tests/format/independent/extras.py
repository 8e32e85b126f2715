"""Numbers, colours and skins, which only hits, programs and poses use (docs/format.md, "Numbers", "Colours", "Skin",
"The payload of numbers").
"""

import struct

from shell import PAYLOAD, Payloads, require, reserved

SOURCE_TRIANGLES, SOURCE_VERTICES = 1, 4
KINDS = range(SOURCE_TRIANGLES, SOURCE_VERTICES + 1)


def read_numbers(file, only=None):
    """Numbers by kind and object. only: the object, or all of them."""
    found = {kind: {} for kind in KINDS}
    file.number_limits = {}  # of source vertices, by object
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
        if kind == SOURCE_VERTICES:
            file.number_limits[which] = n % 2**32
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


def read_skins(file, sources, only=None):
    """By object: weights, moves by targets, and joints, each by vertex. sources: numbers of kind 4, by object."""
    found = {}
    if "SKIN" not in file.sections:
        return found
    payloads = Payloads(file.sections["SVAL"], 0 if only is None else None)
    last = -1
    for nth, fields in enumerate(file.sections["SKIN"].records("6I" + PAYLOAD)):
        which, vertices, joints, influences, targets, zero, *payload = fields
        place = f"skin {nth}"
        require(last < which < len(file.objects), place, f"object {which}")
        last = which
        item = file.objects[which]
        if item.unsupported or only not in (None, which):
            continue
        reserved((zero,), place)
        require(set(item.parts) == {"triangles"} and which in sources, place, "an object that cannot bend")
        require(0 < vertices == file.number_limits[which], place, f"{vertices} vertices")
        require(joints <= 65536, place, f"{joints} joints")
        require(influences in (4, 8) if joints else influences == 0 < targets, place, f"{influences} influences")
        require(targets < 2**28, place, f"{targets} morph targets")
        count, moves = vertices * influences, vertices * targets * 3
        data = payloads.take(payload, place)
        require(len(data) == 6 * count + 4 * moves, place, f"a payload of {len(data)} bytes")
        weights = struct.unpack_from(f"<{count}f", data)
        move = struct.unpack_from(f"<{moves}f", data, 4 * count)
        joint = struct.unpack_from(f"<{count}H", data, 4 * (count + moves))
        require(all(0 <= weight <= 1 for weight in weights), place, "a weight that is not 0 to 1")
        require(all(abs(x) <= 2.0**50 for x in move), place, "a target moves too far")
        require(all(number < joints for number in joint), place, "a joint that is out of range")
        for first in range(0, count, influences or 1):
            total = sum(weights[first : first + influences])
            require(abs(total - 1) <= 2.0**-10, place, f"weights that add up to {total}")
        found[which] = weights, move, joint
    return found
