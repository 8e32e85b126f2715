"""`cutout` objects: triangles of which some have holes, and the alpha maps that objects share (docs/format.md, "Holes",
"Alpha map", "The holes payload", "The alpha map payload"; docs/answers.md, "cutout" and "Of `cutout`").
"""

import math
import struct

from coding import Decoder, Models
from extras import unpack
from shell import PAYLOAD, require, require_range, reserved

LAYOUT, MAP_LAYOUT = "4I" + PAYLOAD, "2I2B6B" + PAYLOAD
PATCH = struct.Struct("<2I6i")
MOST_SIDE, MOST_TILES = 16384, 2**24
TILE = 8
CLEAR, SOLID, MIXED = range(3)
REPEAT, MIRROR, CLAMP = range(3)


class AlphaMap:
    """rows: of each row of texels a whole number, with texel x as bit x + MARGIN."""

    MARGIN = 4  # the texels to the left that contexts look at

    def __init__(self, fields, payload, place):
        self.size, self.beyond = fields[0:2], fields[2:4]
        require(all(beyond <= CLAMP for beyond in self.beyond), place, "what is beyond the map is not 0 to 2")
        reserved(fields[4:10], place)
        self.rows = []
        self._decode(Decoder(payload, place), place)

    def _decode(self, decoder, place):
        width, height = self.size
        tiles = [self._bits(left, min(TILE, width - left)) for left in range(0, width, TILE)]
        mixed, solid, texels = Models(), Models(), Models()
        above = [CLEAR] * len(tiles)
        before = [0, 0]  # the two rows above
        for top in range(0, height, TILE):
            kinds = []
            for kind_above in above:
                context = kinds[-1] if kinds else CLEAR, kind_above
                kinds.append(MIXED if decoder.bit(mixed[context]) else SOLID if decoder.bit(solid[context]) else CLEAR)
            known = sum(tile for tile, kind in zip(tiles, kinds) if kind == SOLID)
            columns = [
                x
                for nth, kind in enumerate(kinds)
                if kind == MIXED
                for x in range(TILE * nth, min(TILE * nth + TILE, width))
            ]
            here = []
            for _ in range(min(TILE, height - top)):
                row, (second, first) = known, before
                for x in columns:
                    context = row >> x & 15 | (first >> x + 2 & 31) << 4 | (second >> x + 3 & 7) << 9
                    row |= decoder.bit(texels[context]) << x + self.MARGIN
                here.append(row)
                before = [first, row]
            for nth, (tile, kind) in enumerate(zip(tiles, kinds)):
                if kind == MIXED:
                    differs = any(row & tile for row in here) and any(~row & tile for row in here)
                    require(differs, place, f"tile {nth} at row {top} was called mixed, and is not")
            self.rows += here
            above = kinds
        decoder.finish()

    def _bits(self, left, count):
        return ((1 << count) - 1) << left + self.MARGIN

    def blocks(self, texel):
        x, y = (self._within(*of_axis) for of_axis in zip(texel, self.size, self.beyond))
        return bool(self.rows[y] >> x + self.MARGIN & 1)

    @staticmethod
    def _within(texel, size, beyond):
        if beyond == REPEAT:
            return texel % size
        if beyond == MIRROR:
            r = texel % (2 * size)
            return r if r < size else 2 * size - 1 - r
        return min(max(texel, 0), size - 1)


class Cutout:
    """maps: the numbers of those that its patches name"""

    proven = True

    def __init__(self, tree, patches, numbers, maps):
        self.tree, self.patches, self.numbers = tree, patches, numbers
        self.maps = {patch[0]: maps[patch[0]] for patch in patches}
        self.box, self.scale = tree.box, tree.scale

    def answer(self, *ray):
        return self.tree.answer(*ray, self._blocks)

    def hit(self, *ray):
        return self.tree.hit(*ray, self._blocks)

    def _blocks(self, weight, total, triangle):
        if self.numbers[triangle] == 0:
            return True
        number, shift, *places = self.patches[self.numbers[triangle] - 1]
        second, third = weight[1] / total, weight[2] / total
        texel = []
        for p0, p1, p2 in (places[0::2], places[1::2]):
            at = p0 + second * (p1 - p0) + third * (p2 - p0)
            texel.append(math.floor(at * 2.0 ** (shift - 16)))
        return self.maps[number].blocks(texel)


def check_maps(records):
    """The rules for sizes of all alpha maps of a file, before one is decoded."""
    for number, fields in enumerate(records):
        for side in fields[0:2]:
            require_range(side, 1, MOST_SIDE, f"alpha map {number}", "a side")
    tiles = sum(-(-fields[0] // TILE) * -(-fields[1] // TILE) for fields in records)
    require(tiles <= MOST_TILES, "ALPH", f"{tiles} tiles")


def read_map(number, fields, payloads):
    place = f"alpha map {number}"
    return AlphaMap(fields, payloads.take(fields[10:14], place), place)


def read(item, fields, payloads, maps):
    place = f"{item.place}: holes"
    require("triangles" in item.parts, place, "an object without triangles")
    count, triangles = fields[0], len(item.triangles.triangles)
    require_range(count, 1, triangles, place, "number of patches")
    reserved(fields[1:4], place)
    payload = payloads.take(fields[4:8], place)
    size = PATCH.size * count
    require(len(payload) >= size, place, "the payload ends within the patches")
    patches = list(PATCH.iter_unpack(payload[:size]))
    for nth, (number, shift, *_) in enumerate(patches):
        require(number < len(maps), f"{place}: patch {nth}", f"alpha map {number} of {len(maps)}")
        require_range(shift, 0, 16, f"{place}: patch {nth}", "shift")
    numbers = unpack(payload[size:], triangles, count + 1, place)
    return Cutout(item.triangles, patches, numbers, maps)
