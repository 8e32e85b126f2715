"""Cells with planes (docs/format.md, "The cells payload", and "Coded payloads": "Cells")."""

import struct
from dataclasses import dataclass

from coding import Decoder, Models
from grid import CODED_CELLS, CODED_KINDS, INSIDE, OUTSIDE
from shell import require
from sides import Sides
from single import single

CUT = 15
BARE = 31 << 4 | 31 << 10 | 0 << 16 | 255 << 24  # u = v = 0, places 0 and 256; without the kind

# (above, below, wall) of each kind.
KINDS = (
    *((None, None, False), (None, OUTSIDE, False), (OUTSIDE, None, False), (None, INSIDE, False), (INSIDE, None, False)),
    *((OUTSIDE, OUTSIDE, False), (OUTSIDE, INSIDE, False), (INSIDE, OUTSIDE, False)),
    *((None, None, True), (None, OUTSIDE, True), (OUTSIDE, None, True), (None, INSIDE, True), (INSIDE, None, True)),
    (OUTSIDE, OUTSIDE, True),
)


def separates(kind):
    above, below, wall = KINDS[kind]
    return wall or (above is not None and below is not None and above != below)


class Planes:
    """The fields of a word with planes."""

    def __init__(self, word):
        self.kind = word & 15
        self.u, self.v = (word >> 4 & 63) - 31, (word >> 10 & 63) - 31
        self.lower, self.upper = word >> 16 & 255, (word >> 24) + 1
        self.normal = (self.u + self.v, self.u - self.v, 62 - 2 * max(abs(self.u), abs(self.v)))
        self.bare = word & ~15 == BARE


class Cells:
    """words     of voxels, then children; None where one is not decoded yet
    low, side    place and side of each word's cell, in finest cells; those of children as links name them
    """

    def __init__(self, grid, occupancy, data):
        self.grid, self.occupancy = grid, occupancy
        self.place = grid.place + ": cells"
        self.cells_per_unit = single(grid.voxels_per_unit * 2**grid.levels)
        size = 1 << grid.levels
        self.count = grid.surface_voxels + grid.child_count
        self.low = [tuple(c << grid.levels for c in at) for at in occupancy.surface]
        self.side = [size] * len(self.low)
        self.words = [None] * self.count
        self._planes = {}
        if grid.forms & CODED_CELLS:
            _Decoding(self, data).run()
        else:
            self._read(data)
            self.check_sides(Sides(self))

    def box(self):
        """For objects with planes and without triangles."""
        grid, voxel = self.grid, 1 / self.grid.voxels_per_unit
        low = [x - 0.125 * voxel for x in grid.origin]
        return low, [x + (count + 0.125) * voxel for x, count in zip(grid.origin, grid.voxels)]

    def _read(self, data):
        for number, word in enumerate(struct.unpack(f"<{self.count}I", data)):
            place = f"{self.place}: word {number}"
            require(number < len(self.low), place, "a child that no link names")
            self.words[number] = word
            if word & 15 == CUT:
                require(word >> 12 == self.parts_named(), place, "a link that does not begin where the one before ends")
                self.name_parts(number, word >> 4 & 255)
                continue
            require(word & 15 < len(KINDS), place, f"kind {word & 15}")
            require(word >> 4 & 63 <= 62 and word >> 10 & 63 <= 62, place, "u or v is not in range")
            require(word >> 24 >= word >> 16 & 255, place, "the upper plane is not above the lower one")
        self.all_named()

    def check_sides(self, sides):
        """Refuses kinds that state a side that is not proven."""
        sides.check_apart()
        for number, word in enumerate(self.words):
            for nth in range(0 if word & 15 == CUT else 2):
                stated = KINDS[word & 15][nth]
                proven = stated is None or stated == sides.side(number, nth)
                require(proven, self.place, f"word {number} states a side that is not proven")

    def parts_named(self):
        return len(self.low) - self.grid.surface_voxels

    def name_parts(self, number, mask):
        place, half = f"{self.place}: word {number}", self.side[number] // 2
        require(mask != 0, place, "a link to no child")
        require(half > 0, place, "cut more often than `levels`")
        for part in range(8):
            if mask >> part & 1:
                self.low.append(tuple(c + half * (part >> a & 1) for a, c in enumerate(self.low[number])))
                self.side.append(half)
        require(len(self.low) <= self.count, place, "a link to more children than there are")

    def all_named(self):
        require(len(self.low) == self.count, self.place, "children that no link names")

    def is_cut(self, number):
        return self.words[number] & 15 == CUT

    def part(self, number, k):
        """The word of child k of a cut cell, or None."""
        mask = self.words[number] >> 4 & 255
        if not mask >> k & 1:
            return None
        return self.grid.surface_voxels + (self.words[number] >> 12) + (mask & ((1 << k) - 1)).bit_count()

    def planes(self, number):
        word = self.words[number]
        if word not in self._planes:
            self._planes[word] = Planes(word)
        return self._planes[word]

    def look(self, at, size):
        """What is found at a place of a size: the number of a word, or None."""
        levels = self.grid.levels
        number = self.occupancy.word_of.get((at[0] >> levels, at[1] >> levels, at[2] >> levels))
        while number is not None and self.side[number] > size:
            if self.words[number] is None or not self.is_cut(number):
                break
            half = self.side[number] // 2
            number = self.part(number, sum(1 << a for a in range(3) if at[a] & half))
        return number


def quotient(x, y):
    """Rounded toward 0; y > 0."""
    return x // y if x >= 0 else -(-x // y)


def rounded(x, y):
    """Rounded to nearest, away from 0 halfway; y > 0."""
    return (x + y // 2) // y if x >= 0 else -((-x + y // 2) // y)


def rank(x, bounds):
    return sum(bound <= x for bound in bounds)


def limit(x, low, high):
    return min(max(x, low), high)


def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@dataclass
class _Hint:
    """A neighbour's prediction of the surface."""

    normal: tuple
    at: tuple  # where the surface is expected, in 1/256 of a finest cell
    weight: int
    thick: int


class _Decoding:
    def __init__(self, cells, data):
        self.cells = cells
        self.coded_kinds = bool(cells.grid.forms & CODED_KINDS)
        self.decoder = Decoder(data, cells.place)
        for name in "cut mask bare kind thickness turned first second lower".split():
            setattr(self, name + "_models", Models())

    def refuse_unless(self, holds, what):
        require(holds, self.where, "coded: " + what)

    def run(self):
        cells = self.cells
        for number in range(cells.count):
            self.where = f"{cells.place}: word {number}"
            self.refuse_unless(number < len(cells.low), "a child that no link names")
            word = self.word(number)
            cells.words[number] = word
            if word & 15 == CUT:
                cells.name_parts(number, word >> 4 & 255)
        cells.all_named()
        self.decoder.finish()
        self.complete(Sides(cells))

    def complete(self, sides):
        """Gives each cell the kind with most that is proven, or checks those that the file states."""
        cells = self.cells
        if self.coded_kinds:
            cells.check_sides(sides)
            return
        sides.check_apart()
        for number, word in enumerate(cells.words):
            if word & 15 == CUT:
                continue
            above, below = sides.side(number, 0), sides.side(number, 1)
            apart = above is not None and below is not None and above != below
            wall = separates(word & 15) and not apart
            if above == below == INSIDE:
                below = None
            cells.words[number] = word & ~15 | KINDS.index((above, below, wall))

    def word(self, number):
        cells, decoder = self.cells, self.decoder
        low, side = cells.low[number], cells.side[number]
        level = cells.grid.levels - side.bit_length() + 1
        unit = 31 * side + 1
        found = []  # (face, word) of neighbours
        for face in range(6):
            at = list(low)
            at[face >> 1] += side if face & 1 else -side
            neighbour = cells.look(at, side)
            if neighbour is not None and cells.words[neighbour] is not None:
                found.append((face, neighbour))
        flat = [(face, n, cells.planes(n)) for face, n in found if not cells.is_cut(n)]

        if side > 1:
            distances = [(p.upper - p.lower) * (31 * cells.side[n] + 1) // 128 for _, n, p in flat]
            widest = max(distances, default=0).bit_length()
            if decoder.bit(self.cut_models[level, min(widest, 7), min(len(found) - len(flat), 4)]):
                return CUT | self.mask(low, side) << 4 | cells.parts_named() << 12

        bare = decoder.bit(self.bare_models[level])
        if self.coded_kinds:
            kind = decoder.symbol(self.kind_models, bare, 4)
            self.refuse_unless(kind < len(KINDS), f"kind {kind}")
        else:
            apart = sum(separates(p.kind) for _, _, p in flat)
            kind = 8 * decoder.bit(self.kind_models[bare, min(apart, 4), min(len(flat) - apart, 3)])
        if bare:
            return kind | BARE

        hints = [self.hint(low, side, face, n, p) for face, n, p in flat if not p.bare]
        total = sum(hint.weight for hint in hints)

        like = quotient(sum(h.weight * h.thick for h in hints) // total, unit) if hints else 0
        size_class = 0
        if like:
            bits = like.bit_length()
            size_class = min(2 * bits - (bits >= 2 and not like >> (bits - 2) & 1), 15)
        thickness = decoder.number(self.thickness_models, (level, separates(kind), size_class), 9) + 1
        self.refuse_unless(thickness <= 256, "planes farther apart than 256 offsets")

        u, v = self.normal(hints, thickness)
        normal = (u + v, u - v, 62 - 2 * max(abs(u), abs(v)))

        middle, doubt = 256, len(hints)
        if hints:
            heights = [dot(normal, [h.at[a] - 128 * (2 * low[a] + side) for a in range(3)]) for h in hints]
            mean = quotient(sum(h.weight * height for h, height in zip(hints, heights)), total)
            middle += limit(rounded(mean, unit), -255, 255)
            if len(hints) > 1:
                doubt = 2 + rank((max(heights) - min(heights)) // unit // 2, (4, 10, 20, 40, 80))
        expected = limit((middle - thickness) >> 1, 0, 256 - thickness)
        lower = expected + decoder.difference(self.lower_models, (doubt, rank(thickness, (6, 12, 24, 48))), 8)
        self.refuse_unless(0 <= lower and lower + thickness <= 256, "offsets beyond 0 to 256")
        return kind | (u + 31) << 4 | (v + 31) << 10 | lower << 16 | (lower + thickness - 1) << 24

    def mask(self, low, side):
        cells, half, mask = self.cells, side // 2, 0
        for k in range(8):
            at = tuple(low[a] + half * (k >> a & 1) for a in range(3))
            before = sum(mask >> (k ^ 1 << a) & 1 for a in range(3) if k >> a & 1)
            beyond = sum(self.beyond(at, half, a, k >> a & 1) for a in range(3)) // 2
            mask |= self.decoder.bit(self.mask_models[k.bit_count(), before, beyond, min(mask.bit_count(), 7)]) << k
        self.refuse_unless(mask, "a mask of 0")
        return mask

    def beyond(self, at, size, axis, above):
        """What is beyond a face of a part, for the third number of its model."""
        cells = self.cells
        place = list(at)
        place[axis] += size if above else -size
        number = cells.look(place, size)
        if number is None:
            return 0
        if cells.words[number] is None:
            return 2 if cells.side[number] == size else 1
        planes, low, side = cells.planes(number), cells.low[number], cells.side[number]
        face = [2 * at[a] + size - 2 * low[a] - side for a in range(3)]
        face[axis] += size if above else -size
        height = dot(planes.normal, face)
        reach = sum(abs(planes.normal[a]) * size for a in range(3) if a != axis)
        unit = 31 * side + 1
        above_lower = 64 * (height + reach) >= (planes.lower - 128) * unit
        below_upper = 64 * (height - reach) <= (planes.upper - 128) * unit
        return 2 if above_lower and below_upper else 0

    def hint(self, low, side, face, number, planes):
        axis, above = face >> 1, face & 1
        other_low, other_side = self.cells.low[number], self.cells.side[number]
        unit = 31 * other_side + 1
        n = planes.normal
        middle = [2 * low[a] + side for a in range(3)]
        middle[axis] += side if above else -side
        away = [middle[a] - 2 * other_low[a] - other_side for a in range(3)]
        lack = (planes.lower + planes.upper - 256) * unit - 128 * dot(n, away)
        step = quotient(lack * 4096, dot(n, n))
        at = tuple(128 * middle[a] + (step * n[a] >> 12) for a in range(3))
        for weight, k in ((8, 90), (5, 154), (2, 230)):
            if lack * lack < (k * side) ** 2 * dot(n, n):
                break
        else:
            weight = 1
        if other_side > side:
            weight = (weight + 1) // 2
        return _Hint(n, at, weight, (planes.upper - planes.lower) * unit * side // other_side)

    def normal(self, hints, thickness):
        decoder = self.decoder
        u = v = doubt = 0
        if hints:
            best = max(hints, key=lambda hint: hint.weight)  # the first one of these
            total = [0, 0, 0]
            for hint in hints:
                sign = -1 if dot(hint.normal, best.normal) < 0 else 1
                for a in range(3):
                    total[a] += sign * hint.weight * hint.normal[a]
            if total[2] < 0:
                total = [-x for x in total]
            size = max(sum(abs(x) for x in total), 1)
            u, v = rounded(31 * (total[0] + total[1]), size), rounded(31 * (total[0] - total[1]), size)
            doubt = 1
            if len(hints) > 1:
                spread = 0
                for hint in hints:
                    sign = -1 if dot(hint.normal, total) < 0 else 1
                    spread += hint.weight * sum(abs(sign * hint.normal[a] - quotient(62 * total[a], size)) for a in range(3))
                doubt = 2 + rank(spread // sum(hint.weight for hint in hints), (3, 6, 10, 16, 24, 40))
            rim = max(abs(u), abs(v))
            if rim >= 22 and decoder.bit(self.turned_models[rim >= 27]):
                u, v = -u, -v
        context = doubt, rank(thickness, (8, 20, 48))
        step = decoder.difference(self.first_models, context, 6)
        u += step
        v += decoder.difference(self.second_models, (*context, rank(abs(step), (1, 3, 7))), 6)
        self.refuse_unless(-31 <= u <= 31 and -31 <= v <= 31, "u or v is not in range")
        return u, v
