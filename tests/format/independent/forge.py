"""Takes files apart and puts them together again with right checksums, to test what a reader makes of changed ones
(docs/format.md, "The shell", "Payloads").
"""

import struct

from shell import ENTRY, HEADER, PAYLOADS, aligned, crc32c

# Where records have payloads, and in which section these are.
PLACES = {
    "PLAN": ("DATA", (48, 72)),
    "TRIS": ("DATA", (16,)),
    "NETW": ("DATA", (32, 56)),
    "MLPS": ("DATA", (64,)),
    "SPHR": ("DATA", (16,)),
    "SNET": ("DATA", (48,)),
    "HOLE": ("DATA", (16,)),
    "ALPH": ("DATA", (16,)),
    "PRIM": ("PVAL", (48,)),
    "NUMS": ("NVAL", (16,)),
    "COLR": ("CVAL", (16,)),
    "SKIN": ("SVAL", (24,)),
}


def entries(data):
    """Of each entry of the section table: its place, type, flags, offset and length of its section, record size."""
    (count,) = struct.unpack_from("<I", data, 24)
    for entry in range(HEADER, min(HEADER + ENTRY * count, len(data) - ENTRY), ENTRY):
        kind, flags, offset, size, _, record = struct.unpack_from("<4sIQQII", data, entry)
        yield entry, kind.decode("latin-1"), flags, offset, size, record


def _payloads(data):
    """Of each payload that lies in its section: the place of the structure that states it, its own and its length."""
    found = {kind: (offset, size, record) for _, kind, _, offset, size, record in entries(data)}
    for kind, (where, places) in PLACES.items():
        if kind not in found or where not in found or found[kind][2] == 0:
            continue
        offset, size, record = found[kind]
        start, length = found[where][0:2]
        for at in range(offset, min(offset + size, len(data)) - record + 1, record):
            for place in places:
                if place + 24 > record:
                    continue
                first, count = struct.unpack_from("<QQ", data, at + place)
                if first <= length and count <= length - first:
                    yield at + place, start + first, count


def with_checksums(data):
    """A file whose checksums are made right again, as far as its table and records say where things are."""
    data = bytearray(data)
    for place, start, count in list(_payloads(data)):
        struct.pack_into("<I", data, place + 16, crc32c(data[start : start + count]))
    for entry, _, flags, offset, size, _ in list(entries(data)):
        struct.pack_into("<I", data, entry + 24, 0 if flags & PAYLOADS else crc32c(data[offset : offset + size]))
    return with_table_checksums(data)


def with_table_checksums(data):
    """Only those of the section table and the header."""
    data = bytearray(data)
    end = HEADER + ENTRY * sum(1 for _ in entries(data))
    struct.pack_into("<II", data, 28, crc32c(data[HEADER:end]), 0)
    struct.pack_into("<I", data, 32, crc32c(data[:HEADER]))
    return bytes(data)


class Forge:
    """header: 64 bytes. sections: lists of [type, flags, record size, bytes], in the order of the file."""

    def __init__(self, data):
        self.header = bytearray(data[:HEADER])
        self.sections = [
            [kind, flags, record, bytearray(data[offset : offset + size])]
            for _, kind, flags, offset, size, record in entries(data)
        ]

    def section(self, kind):
        return next(section for section in self.sections if section[0] == kind)

    def set(self, kind, record, place, layout, *values):
        """Sets numbers of a record, or of a section's bytes if it has no records."""
        _, _, size, data = self.section(kind)
        struct.pack_into("<" + layout, data, record * size + place, *values)

    def get(self, kind, record, place, layout):
        _, _, size, data = self.section(kind)
        return struct.unpack_from("<" + layout, data, record * size + place)

    def widen(self, kind, by, byte=0xEE):
        """Gives each record some more bytes."""
        section = self.section(kind)
        size, data = section[2], section[3]
        section[3] = bytearray(b"".join(data[at : at + size] + bytes([byte]) * by for at in range(0, len(data), size)))
        section[2] = size + by

    def open_hole(self, by):
        """Moves all payloads of DATA apart and fills the holes, also behind the last one."""
        data, moved = self.section("DATA")[3], bytearray(b"\xee" * by)
        stated = sorted(
            (self.get(kind, nth, place, "QQ"), kind, nth, place)
            for kind, (where, places) in PLACES.items()
            for section in self.sections
            if section[0] == kind and where == "DATA"
            for nth in range(len(section[3]) // section[2])
            for place in places
        )
        for (offset, length), kind, nth, place in stated:
            self.set(kind, nth, place, "Q", len(moved))
            moved += data[offset : offset + length]
            moved += b"\xee" * (aligned(len(moved)) + by - len(moved))
        data[:] = moved

    def bytes(self):
        out = bytearray(self.header) + bytes(ENTRY * len(self.sections))
        for nth, (kind, flags, record, data) in enumerate(self.sections):
            out += bytes(aligned(len(out)) - len(out))
            place = HEADER + ENTRY * nth
            struct.pack_into("<4sIQQII", out, place, kind.encode("latin-1"), flags, len(out), len(data), 0, record)
            out += data
        struct.pack_into("<QI", out, 16, len(out), len(self.sections))
        return with_checksums(out)
