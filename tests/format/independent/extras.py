"""What hits alone depend on: source triangles and colours (docs/format.md, "Source triangles", "Colours", "The
payload of source triangles").
"""

import struct

from container import Payloads, require, reserved


def _read(file, records, payloads):
    """Checks records of both kinds; yields (number of the object, object, number, payload, place)."""
    if records not in file.sections:
        return
    payloads = Payloads(file.sections[payloads])
    last = -1
    records = file.sections[records]
    require(records.data, records.name, "no record")
    for nth, (item, number, *zeros, offset, length) in enumerate(records.records("4IQQ")):
        place = f"{records.name} {nth}"
        require(last < item < len(file.objects), place, f"object {item}")
        last = item
        reserved(zeros, place)
        yield item, file.objects[item], number, payloads.take(offset, length, place), place
    payloads.finish()


def read_source_triangles(file):
    """Numbers by object."""
    found = {}
    for which, item, count, payload, place in _read(file, "SRCT", "SNUM"):
        require("triangles" in item.parts, place, "an object without triangles")
        triangles = len(item.triangles.triangles)
        bits = max((count - 1).bit_length(), 1)
        size = (bits * triangles + 31) // 32 * 4
        require(len(payload) == size, place, f"a payload of {len(payload)} bytes, not {size}")
        numbers = int.from_bytes(payload, "little")
        found[which] = []
        for _ in range(triangles):
            found[which].append(numbers & ((1 << bits) - 1))
            require(found[which][-1] < count, place, "a number that is not below the count of source triangles")
            numbers >>= bits
        require(numbers == 0, place, "bits behind the last number are not zero")
    return found


def read_colours(file):
    """The packed colours of surface voxels, by object."""
    found = {}
    for which, item, count, payload, place in _read(file, "COLR", "CVAL"):
        require("planes" in item.parts, place, "an object without surface voxels")
        voxels = item.planes.grid.surface_voxels
        require(count == voxels, place, f"{count} surface voxels, not {voxels}")
        require(len(payload) == 2 * count, place, f"a payload of {len(payload)} bytes, not {2 * count}")
        found[which] = struct.unpack(f"<{count}H", payload)
    return found
