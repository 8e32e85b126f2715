"""What every file has: objects, instances, names and metadata (docs/format.md, "Object", "Objects that a reader cannot
answer", "Levels", "Instance", "Names").
"""

import struct

from shell import MUST_KNOW, Refused, Shell, require, require_range, reserved, support

MOST_FLOAT = (2 - 2.0**-23) * 2.0**127
NONE = 2**32 - 1
LIMIT_LEVEL = 15
DISABLED = 1
CUT_OUTS = 1
RECORD = "6I2I6ffIf3I"

# The parts of objects, in the order of the object record. The sections of each are all present, or all absent; the
# first has a record for each object with the part.
PARTS = {
    "planes": ["PLAN"],
    "triangles": ["TRIS"],
    "network": ["NETW", "MLPS"],
    "spherical": ["SPHR", "SNET"],
    "holes": ["HOLE", "ALPH"],
}
# What objects with these parts and no others are called.
ENCODINGS = {
    ("planes", "network"): "segment",
    ("spherical",): "spherical",
    ("triangles",): "bvh",
    ("planes", "triangles"): "exact",
    ("planes",): "proof",
    ("triangles", "holes"): "cutout",
}


class File(Shell):
    """A file whose shell, objects, instances, names and metadata are checked.

    objects, instances
    """

    def __init__(self, read, length=None):
        super().__init__(read, length)
        names = _Names(self.sections["NAME"].data)
        objects = self.sections["OBJS"]
        layout = RECORD + "I" if objects.record_size >= struct.calcsize(RECORD) + 8 else RECORD
        self.objects = [Object(number, fields, names) for number, fields in enumerate(objects.records(layout))]
        self._check_objects()
        layout = "3d9fI2IQ4I"
        self.instances = [
            Instance(number, fields, names, self.objects)
            for number, fields in enumerate(self.sections["INST"].records(layout))
        ]
        names.finish()
        require(not (self.places_nothing and self.instances), "INST", "not empty, though the file places nothing")
        if "META" in self.sections:
            self.metadata = _metadata(self.sections["META"].data)

    def _check_objects(self):
        require(self.objects, "OBJS", "no object")
        for item, following in zip(self.objects, [*self.objects[1:], None]):
            follows = item.level == 0 or (following and following.level == item.level - 1)
            require(follows, item.place, f"no object of level {item.level - 1} after this one of level {item.level}")
        for part, sections in PARTS.items():
            indices = [item.parts[part] for item in self.objects if part in item.parts]
            require(indices == list(range(len(indices))), "OBJS", f"{part} do not count up")
            for name in sections:
                require(name in self.sections or not indices, name, "missing, though an object needs it")
                require(name not in self.sections or indices, name, "there without an object that needs it")
            if indices:
                section = self.sections[sections[0]]
                count = section.size // section.record_size
                require(count == len(indices), section.name, f"{count} records for {len(indices)} objects")


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
    """parts: of each the number of its record. unsupported: why it cannot be answered, or None."""

    def __init__(self, number, fields, names):
        place = self.place = f"object {number}"
        self.number, self.level = number, fields[5]
        # Shorter records end before the last part.
        self.parts = {part: index for part, index in zip(PARTS, (*fields[1:5], *fields[20:])) if index != NONE}
        self.name = names.take(fields[6], fields[7], place)
        self.low, self.high = fields[8:11], fields[11:14]
        self.bias, self.error = fields[14], fields[16]
        require_range(self.level, 0, LIMIT_LEVEL, place, "level")
        finite = all(x - x == 0 for x in (*self.low, *self.high, self.bias, self.error))
        require(finite, place, "bounds, bias or error are not finite")
        require(all(a <= b for a, b in zip(self.low, self.high)), place, "bounds: minimum above maximum")
        require(self.bias >= 0, place, "bias is negative")
        require(self.error >= 0, place, "error is negative")
        reserved(fields[17:20], place)
        flags = fields[0] & MUST_KNOW
        require(bool(flags & CUT_OUTS) == ("holes" in self.parts), place, "cut-outs without holes, or holes without")
        self.unsupported = None
        if flags & ~CUT_OUTS:
            self.unsupported = f"flags {flags:#x}"
        elif tuple(self.parts) not in ENCODINGS:
            self.unsupported = f"parts {' and '.join(self.parts) or 'none'}"

    @property
    def encoding(self):
        return None if self.unsupported else ENCODINGS[tuple(self.parts)]


class Instance:
    """transform, of 12 singles; remainder; item: the number of its object"""

    def __init__(self, number, fields, names, objects):
        place = f"instance {number}"
        translation, linear = fields[0:3], fields[3:12]
        self.item, self.user, self.mask, self.flags, self.parent = fields[12], *fields[15:19]
        require(all(x - x == 0 for x in linear), place, "transform is not finite")
        require(all(abs(x) <= MOST_FLOAT for x in translation), place, "translation is not finite in single precision")
        rounded = [to_float(x) for x in translation]
        self.remainder = tuple(x - y for x, y in zip(translation, rounded))
        require(all(to_float(x) == x for x in self.remainder), place, "translation is no sum of two singles")
        self.transform = tuple(x for r in range(3) for x in (*linear[3 * r : 3 * r + 3], rounded[r]))
        require(self.item < len(objects), place, f"object {self.item} of {len(objects)}")
        level = objects[self.item].level
        require(level == 0, place, f"object {self.item} has level {level}")
        names.take(fields[13], fields[14], place)
        support(not self.flags & MUST_KNOW & ~DISABLED, place, f"flags {self.flags:#x}")
        require(self.parent == NONE or self.parent < number, place, f"parent {self.parent}")
        reserved(fields[19:], place)

    @property
    def can_be_met(self):
        return self.mask != 0 and not self.flags & DISABLED


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
