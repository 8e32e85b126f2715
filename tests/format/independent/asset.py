"""A file whose rules are checked, and its objects ready to answer: all of it, or one object in pieces (docs/format.md,
"Fetching one object").
"""

import math

import bvh
import exact
import extras
import holes
import planes
import proof
import segment
import spherical
from container import PARTS, File
from scene import IDENTITY
from shell import Payloads, require, support

MODULES = {"planes": planes, "triangles": bvh, "network": segment, "spherical": spherical, "holes": holes}
PAYLOADS = {"planes": 2, "triangles": 1, "network": 2, "spherical": 1, "holes": 1}  # at the end of a record
# Of parts whose records name one in another section: that section, its layout, and what reads a record of it.
SHARED = {
    "network": ("MLPS", segment.MLP_LAYOUT, segment.read_mlp),
    "spherical": ("SNET", spherical.PAIR_LAYOUT, spherical.read_pair),
    "holes": ("ALPH", holes.MAP_LAYOUT, holes.read_map),
}


class Asset:
    """objects: each has answer(origin, direction, tmin, tmax), which returns (logit, visible, certain); hit() of the
    same; and for scenes box(), scale and proven. None where this reader cannot answer it.
    items: their records. encodings: what each one is called.
    numbers: by kind and object. source_triangles: those of kind 1. colours, skins: by object.
    placed: of each instance its object, transform and remainder, and whether a ray can meet it.
    """

    def __init__(self, data):
        file = File(lambda offset, length: data[offset : offset + length], len(data))
        payloads = Payloads(file.sections["DATA"])
        shared = {part: _Shared(file, part, payloads) for part in SHARED}
        objects = [None if item.unsupported else _read(file, item, payloads, shared) for item in file.objects]
        spherical.read_primary(file)
        self._describe(file, objects)

    def _describe(self, file, objects, only=None):
        self.items = file.objects
        self.encodings = [item.encoding for item in file.objects]
        self.objects = [Unproven(item) if item and not file.proven else item for item in objects]
        self.numbers = extras.read_numbers(file, only)
        self.source_triangles = self.numbers[extras.SOURCE_TRIANGLES]
        self.colours = extras.read_colours(file, only)
        self.skins = extras.read_skins(file, self.numbers[extras.SOURCE_VERTICES], only)
        self.instances = file.instances
        self.placed = [(x.item, x.transform, x.remainder, x.can_be_met) for x in file.instances]
        if not file.instances and not file.places_nothing:
            finest = [number for number, item in enumerate(file.objects) if item.level == 0]
            self.placed = [(number, IDENTITY, (0.0,) * 3, True) for number in finest]


class Piece(Asset):
    """An asset of which only one object is read; the others are None.

    read(offset, length): bytes of the file, as many as there are
    """

    def __init__(self, read, which):
        file = File(_exactly(read))
        item = file.objects[which]
        support(not item.unsupported, f"{item.place} ({item.name!r})", item.unsupported)
        data = file.sections["DATA"]
        start, end, used = _range(file, item)
        if end - start <= 2 * used + 4096:  # otherwise there are large holes
            data.read_ahead(start, end)
        shared = {part: _Fetched(file, part) for part in SHARED}
        objects = [None] * len(file.objects)
        objects[which] = _read(file, item, Payloads(data, None), shared)
        self._describe(file, objects, which)


class Unproven:
    """An object of a file in which nothing is proven (docs/answers.md, "Files without proofs")."""

    proven = False

    def __init__(self, item):
        self.item, self.box, self.scale = item, item.box, item.scale

    def answer(self, *ray):
        logit, visible, _ = self.item.answer(*ray)
        return logit, visible, False

    def hit(self, *ray):
        hit = self.item.hit(*ray)
        hit.low, hit.high = -math.inf, math.inf
        return hit


class _Shared(list):
    """All that objects share."""

    def __init__(self, file, part, payloads):
        read = SHARED[part][2]
        self += [read(number, fields, payloads) for number, fields in enumerate(_shared_records(file, part))]


class _Fetched:
    """What objects share, each read when it is asked for."""

    def __init__(self, file, part):
        self.read = SHARED[part][2]
        self.data = file.sections["DATA"]
        self.records = _shared_records(file, part)
        self.found = {}

    def __len__(self):
        return len(self.records)

    def __getitem__(self, number):
        if number not in self.found:
            self.found[number] = self.read(number, self.records[number], Payloads(self.data, None))
        return self.found[number]


def _shared_records(file, part):
    section, layout, _ = SHARED[part]
    records = file.sections[section].records(layout) if section in file.sections else []
    if part == "holes":
        holes.check_maps(records)
    return records


def _exactly(read):
    def exactly(offset, length):
        data = read(offset, length) if length else b""
        if len(data) != length:
            raise ValueError(f"{len(data)} bytes at {offset}, not {length}")
        return data

    return exactly


def _record(file, item, part):
    return file.sections[PARTS[part][0]].records(MODULES[part].LAYOUT)[item.parts[part]]


def _range(file, item):
    """Of DATA: from the first payload of an object to the end of the last one, and how many bytes they have together.
    Their order is not checked yet.
    """
    offsets, ends = [], []
    for part in item.parts:
        payloads = _record(file, item, part)[-4 * PAYLOADS[part] :]
        offsets += payloads[0::4]
        ends += [offset + length for offset, length in zip(offsets[-PAYLOADS[part] :], payloads[1::4])]
    size = file.sections["DATA"].size
    require(max(ends) <= size, item.place, "a payload ends beyond DATA")
    return min(offsets), max(ends), sum(ends) - sum(offsets)


def _read(file, item, payloads, shared):
    """An object, ready to answer."""
    for part in item.parts:  # a network stands on planes, holes are in triangles
        with_shared = (shared[part],) if part in SHARED else ()
        setattr(item, part, MODULES[part].read(item, _record(file, item, part), payloads, *with_shared))
    if item.encoding == "exact":
        return exact.Exact(item.planes, item.triangles)
    if item.encoding == "proof":
        return proof.Proof(item.planes)
    return getattr(item, list(item.parts)[-1])
