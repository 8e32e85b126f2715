"""The shell of a file and the records that every file has (docs/format.md, "The order of the checks", "The shell",
"Object", "Instance").
"""

import struct

HEADER = 64
ENTRY = 32
MOST_FLOAT = (2 - 2.0**-23) * 2.0**127
LIMIT_SECTIONS = 64
PLACES_NOTHING = 1
IDENTIFIER = b"\xabNIF 10\xbb\r\n\x1a\n"

# The parts of objects, in the order of the object record. The sections of each are all present, or all absent.
PARTS = {
    "planes": "PLAN OCCU CELL".split(),
    "triangles": "TRIS TREE".split(),
    "network": "NETW MLPS WGTS CORN FEAT".split(),
    "spherical": "SPHR SNET SWGT GRID".split(),
}
NO_PART = 2**32 - 1
REQUIRED = {"OBJS", "INST", "NAME", *sum(PARTS.values(), [])}
OPTIONAL = set("PRIM PVAL SRCT SNUM COLR CVAL TRAN META".split())
# Names of objects with exactly these parts.
ENCODINGS = {
    ("planes", "network"): "segment",
    ("spherical",): "spherical",
    ("triangles",): "bvh",
    ("planes", "triangles"): "exact",
    ("planes",): "proof",
}

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
    """The file breaks a rule. Has the place and the reason."""

    def __init__(self, place, what, status="damaged_nif"):
        super().__init__(f"{place}: {what} ({status})")
        self.code = STATUSES[status]


def require(holds, place, what):
    if not holds:
        raise Refused(place, what)


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
    def __init__(self, name, data):
        self.name = name
        self.data = data

    def records(self, layout):
        """The records of this section, each in a struct's format."""
        layout = struct.Struct("<" + layout)
        whole = len(self.data) % layout.size == 0
        require(whole, self.name, f"{len(self.data)} bytes are no whole number of records of {layout.size}")
        return list(layout.iter_unpack(self.data))


class Payloads:
    """Takes the payloads of a section in the order of their records, and checks their positions."""

    def __init__(self, section):
        self.section = section
        self.end = 0

    def take(self, offset, length, place):
        place = f"{place}: payload in {self.section.name}"
        data = self.section.data
        require(offset == aligned(self.end), place, f"at {offset}, but the next one is at {aligned(self.end)}")
        require(length <= len(data) and offset <= len(data) - length, place, "ends beyond its section")
        require(not any(data[self.end : offset]), place, "padding before it is not zero")
        self.end = offset + length
        return data[offset : self.end]

    def finish(self):
        require(self.end == len(self.section.data), self.section.name, "does not end with its last payload")


class File:
    """A file whose shell, objects, instances, names and metadata are checked. `sections` maps names to sections."""

    def __init__(self, data):
        self.sections = _sections(data)
        for name in ("OBJS", "INST", "NAME"):
            require(name in self.sections, "section table", f"{name} is missing")
        names = _Names(self.sections["NAME"].data)
        self.objects = _objects(self.sections["OBJS"], names)
        self.instances = _instances(self.sections["INST"], names, len(self.objects))
        names.finish()
        self.remainders = [(0.0,) * 3] * len(self.instances)
        if "TRAN" in self.sections:
            self.remainders = _translations(self.sections["TRAN"], self.instances)
        self.places_nothing = data[36] & PLACES_NOTHING
        require(not (self.places_nothing and self.instances), "INST", "not empty, though the file places nothing")
        for part, sections in PARTS.items():
            needed = any(part in item.parts for item in self.objects)
            for name in sections:
                require(name in self.sections or not needed, name, "missing, though an object needs it")
                require(name not in self.sections or needed, name, "there without an object that needs it")
        for first, second in (("PRIM", "PVAL"), ("SRCT", "SNUM"), ("COLR", "CVAL")):
            both = (first in self.sections) == (second in self.sections)
            require(both, first, f"{first} and {second} are only there together")
        if "META" in self.sections:
            self.metadata = _metadata(self.sections["META"].data)

    def having(self, part):
        """The objects with a part, in the order of its records."""
        return [item for item in self.objects if part in item.parts]

    def records(self, part, layout):
        """The records of a part: one for each object that has it."""
        records = self.sections[PARTS[part][0]].records(layout)
        require(len(records) == len(self.having(part)), PARTS[part][0], "another number of records than of objects")
        return records


def _sections(data):
    if not data:
        raise Refused("file", "no bytes", "file_empty")
    if data.startswith((b"NetImmerse File Format", b"Gamebryo File Format")):
        raise Refused("header", "a NetImmerse or Gamebryo model", "foreign_nif")
    identifier = data[: len(IDENTIFIER)]
    if IDENTIFIER.startswith(identifier) and len(data) < HEADER:
        raise Refused("header", "the file ends within it", "file_truncated")
    if identifier != IDENTIFIER:
        changed = identifier[0:4] == IDENTIFIER[0:4] or identifier[1:7] == IDENTIFIER[1:7]
        raise Refused("header", "another identifier", "damaged_nif" if changed else "not_a_nif")
    version, length, count, table_crc, header_crc = struct.unpack_from("<IQIII", data, 12)
    require(crc32c(data[:32] + bytes(4) + data[36:HEADER]) == header_crc, "header", "checksum")
    if version != 2:
        raise Refused("header", f"version {version}", "unsupported_nif")
    flags = int.from_bytes(data[36:40], "little")
    require(flags in (0, PLACES_NOTHING), "header", f"flags {flags}")
    require(not any(data[40:HEADER]), "header", "reserved bytes are not zero")
    if len(data) < length:
        raise Refused("header", f"states {length} bytes, but there are {len(data)}", "file_truncated")
    require(len(data) == length, "header", f"states {length} bytes, but there are {len(data)}")
    require(1 <= count <= LIMIT_SECTIONS, "header", f"{count} sections")
    end = HEADER + ENTRY * count
    require(end <= length, "section table", "ends beyond the file")
    require(crc32c(data[HEADER:end]) == table_crc, "section table", "checksum")

    sections = {}
    for kind, flags, offset, size, crc, zero in struct.iter_unpack("<IIQQII", data[HEADER:end]):
        name = kind.to_bytes(4, "little").decode("latin-1")
        place = f"section {name!r}"
        require(flags in (0, 1), place, "unknown flags")
        require(zero == 0, place, "reserved bytes are not zero")
        require(name not in sections, place, "occurs twice")
        require(offset == aligned(end), place, f"at {offset}, but the next one is at {aligned(end)}")
        require(size <= length and offset <= length - size, place, "ends beyond the file")
        require(not any(data[end:offset]), place, "padding before it is not zero")
        end = offset + size
        require(crc32c(data[offset:end]) == crc, place, "checksum")
        if flags and name not in REQUIRED | OPTIONAL:
            raise Refused(place, "unknown and required", "unsupported_nif")
        require(flags or name not in REQUIRED, place, "not marked as required")
        require(not flags or name not in OPTIONAL, place, "marked as required")
        sections[name] = Section(name, data[offset:end])
    require(end == length, "file", "does not end with its last section")
    return sections


class _Names:
    def __init__(self, data):
        self.data = data
        self.end = 0

    def take(self, offset, length, place):
        require(offset == self.end, place, f"name at {offset}, but the next one is at {self.end}")
        require(offset + length < len(self.data), place, "name ends beyond NAME")
        name = self.data[offset : offset + length]
        require(0 not in name, place, "zero within the name")
        require(self.data[offset + length] == 0, place, "no zero after the name")
        self.end = offset + length + 1
        try:
            return name.decode("utf-8")
        except UnicodeDecodeError as error:
            raise Refused(place, "name is not UTF-8") from error

    def finish(self):
        require(self.end == len(self.data), "NAME", "contains more than the names")


class Object:
    def __init__(self, number, fields, names):
        self.place = f"object {number}"
        self.parts = {part: number for part, number in zip(PARTS, fields) if number != NO_PART}
        if tuple(self.parts) not in ENCODINGS:
            raise Refused(self.place, f"parts {' and '.join(self.parts)}", "unsupported_nif")
        self.name = names.take(fields[4], fields[5], self.place)
        self.low, self.high = fields[6:9], fields[9:12]
        self.bias = fields[12]

    @property
    def encoding(self):
        return ENCODINGS[tuple(self.parts)]


def _objects(section, names):
    objects = []
    counts = dict.fromkeys(PARTS, 0)
    for number, fields in enumerate(section.records("6I6ffI2I")):
        place = f"object {number}"
        item = Object(number, fields, names)
        for part, record in item.parts.items():
            require(record == counts[part], place, f"{part} {record}, not {counts[part]}")
            counts[part] += 1
        require(all(x - x == 0 for x in fields[6:13]), place, "bounds or bias are not finite")
        require(all(a <= b for a, b in zip(item.low, item.high)), place, "bounds: minimum above maximum")
        require(item.bias >= 0, place, "bias is negative")
        require(not any(fields[14:]), place, "reserved bytes are not zero")
        objects.append(item)
    require(objects, "OBJS", "no object")
    return objects


def _instances(section, names, objects):
    instances = []
    for number, fields in enumerate(section.records("12f4I")):
        place = f"instance {number}"
        require(all(x - x == 0 for x in fields[:12]), place, "transform is not finite")
        require(fields[12] < objects, place, f"object {fields[12]} of {objects}")
        names.take(fields[13], fields[14], place)
        require(fields[15] == 0, place, "reserved bytes are not zero")
        instances.append(fields[:13])
    return instances


def _translations(section, instances):
    """The remainder of each instance's translation beyond floats."""
    records = section.records("3d")
    require(len(records) == len(instances), "TRAN", f"{len(records)} translations of {len(instances)} instances")
    remainders = []
    for number, (exact, fields) in enumerate(zip(records, instances)):
        for value, rounded in zip(exact, fields[3:12:4]):
            place = f"translation {number}"
            require(abs(value) <= MOST_FLOAT and to_float(value) == rounded, place, "rounds to another float")
            remainders.append(value - rounded)
            require(to_float(remainders[-1]) == remainders[-1], place, "is no sum of two floats")
    require(any(remainders), "TRAN", "floats hold all translations")
    return [tuple(remainders[n : n + 3]) for n in range(0, len(remainders), 3)]


def to_float(value):
    return struct.unpack("<f", struct.pack("<f", value))[0]


def _metadata(data):
    require(data, "META", "empty")
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError as error:
        raise Refused("META", "not UTF-8") from error


def require_aabb(item):
    """The rules for bounds that answers depend on (docs/format.md, "Object")."""
    require(all(abs(x) <= 2.0**60 for x in (*item.low, *item.high)), item.place, "bounds beyond 2^60")
    require(max(b - a for a, b in zip(item.low, item.high)) >= 2.0**-60, item.place, "bounds smaller than 2^-60")


def reserved(fields, place):
    require(not any(fields), place, "reserved bytes are not zero")


def require_range(value, low, high, place, what):
    require(low <= value <= high, place, f"{what} is {value}, not {low} to {high}")
