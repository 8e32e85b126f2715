"""The shell of a file: header, section table, sections and payloads (docs/format.md, "The order of the checks", "The
shell", "Payloads"). A file is read through a function, so that a part of it is enough ("Fetching one object").
"""

import struct
from functools import cached_property

HEADER = 64
ENTRY = 32
LIMIT_SECTIONS = 64
IDENTIFIER = b"\xabNIF 20\xbb\r\n\x1a\n"
EARLIER = b"\xabNIF 10\xbb\r\n\x1a\n"

MUST_KNOW = 0xFFFF  # the flags that a reader may not ignore
PLACES_NOTHING = 1
REQUIRED, PAYLOADS, KEEP = 1, 2, 4
ARITHMETIC = 1  # the revision of docs/answers.md that this reader follows
DEFECTIVE_PROVERS = set()

# Of each known section: its flags, and the size of its records or 0.
SECTIONS = {
    "OBJS": (REQUIRED, 80),
    "INST": (REQUIRED, 96),
    "NAME": (REQUIRED, 0),
    "PLAN": (REQUIRED, 96),
    "TRIS": (REQUIRED, 40),
    "NETW": (REQUIRED, 80),
    "MLPS": (REQUIRED, 88),
    "SPHR": (REQUIRED, 40),
    "SNET": (REQUIRED, 72),
    "HOLE": (0, 40),
    "ALPH": (0, 40),
    "DATA": (REQUIRED | PAYLOADS, 0),
    "PRIM": (0, 72),
    "PVAL": (PAYLOADS, 0),
    "NUMS": (0, 40),
    "NVAL": (PAYLOADS, 0),
    "COLR": (0, 40),
    "CVAL": (PAYLOADS, 0),
    "SKIN": (0, 48),
    "SVAL": (PAYLOADS, 0),
    "META": (0, 0),
}
PAYLOAD = "QQII"  # in the layout of a record

# Exit codes of the statuses with which files are refused (docs/format.md, "The order of the checks").
STATUSES = {
    "file_empty": 12,
    "file_truncated": 13,
    "not_a_nif": 30,
    "foreign_nif": 31,
    "damaged_nif": 32,
    "unsupported_nif": 33,
}


class Refused(Exception):
    """The file breaks a rule. Says which place breaks it, and how."""

    def __init__(self, place, what, status="damaged_nif"):
        super().__init__(f"{place}: {what} ({status})")
        self.code = STATUSES[status]


def require(holds, place, what):
    if not holds:
        raise Refused(place, what)


def support(holds, place, what):
    if not holds:
        raise Refused(place, what, "unsupported_nif")


def reserved(fields, place):
    require(not any(fields), place, "reserved fields are not zero")


def require_range(value, low, high, place, what):
    require(low <= value <= high, place, f"{what} is {value}, not {low} to {high}")


def _crc_table():
    table = []
    for value in range(256):
        for _ in range(8):
            value = (value >> 1) ^ (0x82F63B78 if value & 1 else 0)
        table.append(value)
    return table


_TABLE = _crc_table()


def crc32c(data):
    crc = 0xFFFFFFFF
    for byte in data:
        crc = (crc >> 8) ^ _TABLE[(crc ^ byte) & 0xFF]
    return crc ^ 0xFFFFFFFF


def aligned(offset):
    return (offset + 63) // 64 * 64


class Section:
    """read(offset, length): of the file"""

    def __init__(self, name, flags, offset, size, crc, record_size, read):
        self.name, self.flags, self.offset, self.size = name, flags, offset, size
        self.record_size, self._crc, self._read = record_size, crc, read
        self._window, self._records = (0, b""), None

    def fetch(self, offset, length):
        """Bytes of a section, without a check of its checksum."""
        start, data = self._window
        if start <= offset and offset + length <= start + len(data):
            return data[offset - start : offset - start + length]
        return self._read(self.offset + offset, length)

    def read_ahead(self, start, end):
        """Fetches a range at once, from which later ones are taken."""
        self._window = (start, self.fetch(start, end - start))

    @cached_property
    def data(self):
        """All of it, checked."""
        data = self._read(self.offset, self.size)
        crc = 0 if self.flags & PAYLOADS else crc32c(data)
        require(crc == self._crc, f"section {self.name!r}", "checksum")
        return data

    def records(self, layout):
        """The records of this section, of a struct's format each; what they have behind it is ignored."""
        if self._records is None:
            layout = struct.Struct("<" + layout)
            self._records = [layout.unpack_from(self.data, at) for at in range(0, self.size, self.record_size)]
        return self._records


class Payloads:
    """Takes the payloads of a section in their order, and checks that they are where they have to be.

    end: of the payload before the first one that is taken; None if that one was not fetched
    """

    def __init__(self, section, end=0):
        self.section, self.end = section, end

    def take(self, payload, place):
        offset, length, crc, zero = payload
        place = f"{place}: payload in {self.section.name}"
        end = offset if self.end is None else self.end
        following = aligned(end)
        require(offset % 64 == 0, place, f"at {offset}, no multiple of 64")
        require(offset >= following, place, f"at {offset}, but the next one is at {following} or later")
        size = self.section.size
        require(offset <= size and length <= size - offset, place, "ends beyond its section")
        reserved((zero,), place)
        if offset == following:
            require(not any(self.section.fetch(end, offset - end)), place, "padding before it is not zero")
        data = self.section.fetch(offset, length)
        require(crc32c(data) == crc, place, "checksum")
        self.end = offset + length
        return data


class Shell:
    """sections: by name. places_nothing, proven: what the header says."""

    def __init__(self, read, length=None):
        """length: of the whole file, all of which is checked. None: sections are checked as they are read."""
        self._read = read
        count, stated, table_crc = self._header(read(0, HEADER if length is None else min(HEADER, length)), length)
        end = HEADER + ENTRY * count
        require(end <= stated, "section table", "ends beyond the file")
        table = read(HEADER, end - HEADER)
        require(crc32c(table) == table_crc, "section table", "checksum")
        self.sections = {}
        for entry in struct.iter_unpack("<IIQQII", table):
            end = self._add(entry, end, stated, length is not None)
        require(end == stated, "file", "does not end with its last section")
        for section in self.sections.values():
            self._check_kind(section)
        for name in ("OBJS", "INST", "NAME", "DATA"):
            require(name in self.sections, "section table", f"{name} is missing")
        for first, second in (("PRIM", "PVAL"), ("NUMS", "NVAL"), ("COLR", "CVAL"), ("SKIN", "SVAL")):
            both = (first in self.sections) == (second in self.sections)
            require(both, first, f"{first} and {second} are only there together")
            require(first not in self.sections or self.sections[first].size, first, "no record")

    def _header(self, data, length):
        _check_identifier(data)
        version, stated, count, table_crc, header_crc, flags, arithmetic, prover, *zeros = struct.unpack("<IQ10I", data[12:])
        require(crc32c(data[:32] + bytes(4) + data[36:]) == header_crc, "header", "checksum")
        support(version == 2, "header", f"version {version}")
        support(arithmetic == ARITHMETIC, "header", f"arithmetic {arithmetic}, but this reader knows {ARITHMETIC}")
        support(not flags & MUST_KNOW & ~PLACES_NOTHING, "header", f"flags {flags:#x}")
        reserved(zeros, "header")
        require(1 <= count <= LIMIT_SECTIONS, "header", f"{count} sections")
        if length is not None and length < stated:
            raise Refused("header", f"states {stated} bytes, but there are {length}", "file_truncated")
        require(length in (None, stated), "header", f"states {stated} bytes, but there are {length}")
        self.places_nothing = flags & PLACES_NOTHING
        self.proven = prover != 0 and prover not in DEFECTIVE_PROVERS
        return count, stated, table_crc

    def _add(self, entry, end, stated, whole):
        """Returns where the section ends."""
        kind, flags, offset, size, crc, record_size = entry
        name = kind.to_bytes(4, "little").decode("latin-1")
        place = f"section {name!r}"
        support(not flags & MUST_KNOW & ~(REQUIRED | PAYLOADS | KEEP), place, f"flags {flags:#x}")
        require(name not in self.sections, place, "occurs twice")
        require(offset == aligned(end), place, f"at {offset}, but the next one is at {aligned(end)}")
        require(offset <= stated and size <= stated - offset, place, "ends beyond the file")
        require(not flags & PAYLOADS or crc == 0, place, "a checksum of payloads")
        fits = record_size % 8 == 0 and size % record_size == 0 if record_size else True
        require(fits, place, f"{size} bytes, in records of {record_size}")
        section = self.sections[name] = Section(name, flags, offset, size, crc, record_size, self._read)
        if whole:
            require(not any(self._read(end, offset - end)), place, "padding before it is not zero")
            section.data
        return offset + size

    def _check_kind(self, section):
        place = f"section {section.name!r}"
        if section.name not in SECTIONS:
            support(not section.flags & REQUIRED, place, "unknown and required")
            return
        flags, record_size = SECTIONS[section.name]
        require(section.flags & (REQUIRED | PAYLOADS) == flags, place, f"flags {section.flags:#x}, not {flags}")
        fits = section.record_size >= record_size if record_size else section.record_size == 0
        require(fits, place, f"records of {section.record_size} bytes, not {record_size}")
        if record_size:
            require(section.size // section.record_size < 2**32, place, "2^32 records or more")


def _check_identifier(data):
    if not data:
        raise Refused("file", "no bytes", "file_empty")
    if data.startswith((b"NetImmerse File Format", b"Gamebryo File Format")):
        raise Refused("header", "a NetImmerse or Gamebryo model", "foreign_nif")
    identifier = data[: len(IDENTIFIER)]
    if identifier == EARLIER:
        raise Refused("header", "version 1, or an experimental version 2: bake the mesh again", "unsupported_nif")
    rest = identifier[:5] + identifier[7:]
    if rest == IDENTIFIER[:5] + IDENTIFIER[7:] and identifier != IDENTIFIER and identifier[5:7].isdigit():
        raise Refused("header", f"version {identifier[5:7].decode()} of the identifier", "unsupported_nif")
    if IDENTIFIER.startswith(identifier) and len(data) < HEADER:
        raise Refused("header", "the file ends within it", "file_truncated")
    if identifier != IDENTIFIER:
        changed = identifier[0:4] == IDENTIFIER[0:4] or identifier[1:7] == IDENTIFIER[1:7]
        raise Refused("header", "another identifier", "damaged_nif" if changed else "not_a_nif")
