"""Grids of voxels in bricks (docs/format.md, "The occupancy payload", and "Coded payloads": "Occupancy")."""

import struct

from coding import Decoder, Models
from shell import require, require_range

OUTSIDE, INSIDE, UNKNOWN, SURFACE = range(4)

# Bits of `forms` of planes.
CODED_OCCUPANCY, CODED_CELLS, CODED_KINDS = 1, 2, 4


class Grid:
    """The members of a record that describe a grid, and the count of its bricks."""

    def __init__(self, place, origin, voxels_per_unit, voxels, levels, mixed_bricks, surface_voxels, child_count, forms):
        self.place = place
        self.origin, self.voxels_per_unit, self.voxels, self.levels = origin, voxels_per_unit, voxels, levels
        self.mixed_bricks, self.surface_voxels, self.child_count, self.forms = mixed_bricks, surface_voxels, child_count, forms
        require(all(x - x == 0 for x in origin), place, "origin is not finite")
        require_range(levels, 0, 4, place, "levels")
        require(voxels_per_unit > 0, place, "voxels_per_unit is not above 0")
        require(voxels_per_unit * 2**levels < 2.0**128, place, "voxels_per_unit is not finite in finest cells")
        for count in voxels:
            require_range(count, 1, min(256, 1024 >> levels), place, "voxels")
        require_range(mixed_bricks, 0, 65533, place, "mixed_bricks")
        require_range(child_count, 0, 2**20, place, "child_count")
        require(not forms & CODED_KINDS or forms & CODED_CELLS, place, "forms: kinds are coded without the cells")
        self.bricks = tuple(count // 4 + 1 for count in voxels)
        self.brick_count = self.bricks[0] * self.bricks[1] * self.bricks[2]

    def brick_places(self):
        """The positions of bricks in voxels, in the order of the table."""
        for z in range(self.bricks[2]):
            for y in range(self.bricks[1]):
                for x in range(self.bricks[0]):
                    yield 4 * x, 4 * y, 4 * z

    def within(self, x, y, z):
        return 0 <= x < self.voxels[0] and 0 <= y < self.voxels[1] and 0 <= z < self.voxels[2]

    def voxel_number(self, x, y, z):
        return x + self.voxels[0] * (y + self.voxels[1] * z)

    def cells_size(self):
        return 4 * (self.surface_voxels + self.child_count)

    def occupancy_size(self):
        return self.mixed_bricks * 20 + 2 * self.brick_count


def check_coding(place, payloads):
    """The rules about sizes of payloads that may be coded. Of each: its bytes, its size uncoded, whether it is coded.
    Returns their bytes in the file.
    """
    for data, size, coded in payloads:
        require(coded or len(data) == size, place, f"a payload has {len(data)} bytes, not {size}")
    in_file = sum(len(data) for data, _, _ in payloads)
    check_expansion(place, any(coded for _, _, coded in payloads), sum(size for _, size, _ in payloads), in_file)
    return in_file


def check_expansion(place, coded, decoded, in_file):
    require(not coded or decoded <= 16 * in_file, place, "coded payloads decode to more than 16 times their size")


class Occupancy:
    """The state of each voxel.

    states           of each voxel, x fastest
    surface          the places (x, y, z) of surface voxels, in the order of their words
    table            as in the file
    """

    def __init__(self, grid, data):
        self.grid = grid
        self.place = grid.place + ": occupancy"
        self.states = bytearray(grid.voxels[0] * grid.voxels[1] * grid.voxels[2])
        if grid.forms & CODED_OCCUPANCY:
            self._decode(data)
        else:
            self._read(data)
        self._number_voxels()
        if not grid.forms & CODED_OCCUPANCY:
            require(self.voxel_base == self.stored_voxel_base, self.place, "voxel_base does not count surface voxels")

    def state(self, x, y, z):
        return self.states[self.grid.voxel_number(x, y, z)]

    def _fill(self, x0, y0, z0, state):
        nx, ny, nz = self.grid.voxels
        for z in range(z0, min(z0 + 4, nz)):
            for y in range(y0, min(y0 + 4, ny)):
                for x in range(x0, min(x0 + 4, nx)):
                    self.states[self.grid.voxel_number(x, y, z)] = state

    def _number_voxels(self):
        grid = self.grid
        self.surface = []
        self.voxel_base = []
        for (x, y, z), entry in zip(grid.brick_places(), self.table):
            if entry < 3:
                continue
            self.voxel_base.append(len(self.surface))
            for bit in range(64):
                at = x + (bit & 3), y + (bit >> 2 & 3), z + (bit >> 4)
                if grid.within(*at) and self.state(*at) == SURFACE:
                    self.surface.append(at)
        count = len(self.surface)
        require(count == grid.surface_voxels, self.place, f"surface_voxels is {grid.surface_voxels}, but there are {count}")
        self.word_of = {at: number for number, at in enumerate(self.surface)}

    def _read(self, data):
        grid, mixed = self.grid, self.grid.mixed_bricks
        offset = 0

        def array(kind, count):
            nonlocal offset
            values = struct.unpack_from(f"<{count}{kind}", data, offset)
            offset += struct.calcsize(f"<{count}{kind}")
            return list(values)

        brick_states = array("Q", 2 * mixed)
        self.stored_voxel_base = array("I", mixed)
        self.table = array("H", grid.brick_count)
        named = [entry - 3 for entry in self.table if entry >= 3]
        require(named == list(range(mixed)), self.place, "brick_table does not name each mixed brick once, in order")
        for place, entry in zip(grid.brick_places(), self.table):
            if entry < 3:
                self._fill(*place, entry)
                continue
            surface, aux = brick_states[2 * (entry - 3) : 2 * (entry - 3) + 2]
            for bit in range(64):
                state = (OUTSIDE, INSIDE, SURFACE, UNKNOWN)[2 * (surface >> bit & 1) + (aux >> bit & 1)]
                at = place[0] + (bit & 3), place[1] + (bit >> 2 & 3), place[2] + (bit >> 4)
                if grid.within(*at):
                    self.states[grid.voxel_number(*at)] = state
                else:
                    require(state == OUTSIDE, self.place, f"bits of a voxel beyond the grid, {at}")

    def _decode(self, data):
        decoder = Decoder(data, self.place)
        kinds = self._decode_bricks(decoder)
        self._decode_voxels(decoder, kinds)
        decoder.finish()

    def _decode_bricks(self, decoder):
        grid, models = self.grid, Models()
        kinds = {}
        self.table = []
        mixed = 0
        for place in grid.brick_places():
            x, y, z = place
            context = kinds.get((x - 4, y, z), 4), kinds.get((x, y - 4, z), 4), kinds.get((x, y, z - 4), 4)
            kind = kinds[place] = decoder.symbol(models, context, 2)
            if kind < 3:
                self._fill(x, y, z, kind)
            self.table.append(kind if kind < 3 else 3 + mixed)
            mixed += kind == 3
            require(mixed <= grid.mixed_bricks, self.place, "coded: more mixed bricks than stated")
        require(mixed == grid.mixed_bricks, self.place, f"coded: {mixed} mixed bricks, not {grid.mixed_bricks}")
        return kinds

    # Which neighbours' surface is the context of a voxel's, bit by bit.
    _AROUND = ((-1, 0, 0), (0, -1, 0), (0, 0, -1), (-1, -1, 0), (-1, 0, -1), (0, -1, -1), (1, -1, 0), (1, 0, -1), (0, 1, -1))
    _AROUND += ((-2, 0, 0), (0, -2, 0), (0, 0, -2))

    def _decode_voxels(self, decoder, kinds):
        grid, states = self.grid, self.states
        surface_models, state_models = Models(), Models()

        def state_at(x, y, z):
            return states[grid.voxel_number(x, y, z)] if grid.within(x, y, z) else OUTSIDE

        def settled(x, y, z):
            return not grid.within(x, y, z) or kinds[x & ~3, y & ~3, z & ~3] != 3

        for (x0, y0, z0), kind in kinds.items():
            if kind != 3:
                continue
            for bit in range(64):
                x, y, z = x0 + (bit & 3), y0 + (bit >> 2 & 3), z0 + (bit >> 4)
                if not grid.within(x, y, z):
                    continue
                after = [at for at in ((x + 1, y, z), (x, y + 1, z), (x, y, z + 1)) if settled(*at)]
                context = 0
                for nth, (dx, dy, dz) in enumerate(self._AROUND):
                    context |= (state_at(x + dx, y + dy, z + dz) == SURFACE) << nth
                context |= bool(after) << 12
                if decoder.bit(surface_models[context]):
                    state = SURFACE
                else:
                    like = 4
                    for at in ((x - 1, y, z), (x, y - 1, z), (x, y, z - 1), *after):
                        near = state_at(*at)
                        like = near if near != SURFACE else like
                    state = decoder.symbol(state_models, like, 2)
                    require(state != 3, self.place, "coded: a state of 3")
                states[grid.voxel_number(x, y, z)] = state
