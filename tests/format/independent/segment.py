"""The networks of objects, and `segment` objects: planes, and a network for what they leave open (docs/format.md,
"Network", "MLP", "The corners payload", "The feature payload", "The weights payload", and "Coded
payloads": "Features"; docs/answers.md, "segment").
"""

import math
import struct
from operator import mul

from coding import Decoder, Models
from grid import SURFACE, check_expansion
from hits import hit_by_planes
from proof import proven
from shell import PAYLOAD, require, require_range, reserved
from single import divide, index, least, single
from traversal import OPEN, traverse

LAYOUT, MLP_LAYOUT = "4IfI2I" + 2 * PAYLOAD, "If12IiI" + PAYLOAD
# Bits of `forms` of networks.
CODED_FEATURES, CORNERS_AROUND = 1, 2


class Mlp:
    def __init__(self, fields, payload, place):
        count, logit_scale, shapes, threshold, zero = fields[0], fields[1], fields[2:14], fields[14], fields[15]
        require_range(count, 1, 4, place, "number of layers")
        require(logit_scale > 0 and logit_scale - logit_scale == 0, place, "logit_scale is not finite and above 0")
        require_range(threshold, -(2**27), 2**27, place, "threshold")
        reserved((zero, *shapes[3 * count :]), place)
        self.inputs = shapes[0]
        require(self.inputs % 4 == 0 and 4 <= self.inputs <= 296, place, f"{self.inputs} inputs")
        self.layers = []
        offset, inputs = 0, self.inputs
        for nth in range(count):
            stated, outputs, shift = shapes[3 * nth : 3 * nth + 3]
            last = nth + 1 == count
            require(stated == inputs, place, f"layer {nth} has {stated} inputs, not {inputs}")
            allowed = outputs == 1 if last else outputs % 4 == 0 and 4 <= outputs <= 128
            require(allowed, place, f"layer {nth} has {outputs} outputs")
            require_range(shift, 0, 24, place, "shift")
            size = outputs * (4 + inputs)
            require(offset + size <= len(payload), place, "the payload ends before its last layer")
            biases = struct.unpack_from(f"<{outputs}i", payload, offset)
            weights = struct.unpack_from(f"<{outputs * inputs}b", payload, offset + 4 * outputs)
            require(all(abs(b) <= 2**26 for b in biases), place, f"layer {nth}: a bias is not in range")
            require(-128 not in weights, place, f"layer {nth}: a weight of -128")
            self.layers.append(([(b, weights[i * inputs : (i + 1) * inputs]) for i, b in enumerate(biases)], shift, last))
            offset += size
            inputs = outputs
        require(offset == len(payload), place, "the payload goes on behind its last layer")

    def logit(self, x):
        for neurons, shift, last in self.layers:
            sums = [bias + sum(map(mul, weights, x)) for bias, weights in neurons]
            if last:
                return sums[0]
            half = (1 << shift) >> 1
            x = [min(max((s + half) >> shift, 0), 127) for s in sums]


class Corners:
    """The corners with features, and the number of each."""

    def __init__(self, occupancy, data, around, place):
        self.occupancy = occupancy
        mixed = occupancy.grid.mixed_bricks
        if around:
            self.masks = self._around()
        else:
            self.masks = struct.unpack_from(f"<{mixed}Q", data)
        self.base, self.count = [], 0
        for mask in self.masks:
            self.base.append(self.count)
            self.count += mask.bit_count()
        if not around:
            stored = list(struct.unpack_from(f"<{mixed}I", data, 8 * mixed))
            require(stored == self.base, place, "corner_base does not count corners")

    def _around(self):
        """The corners around surface voxels."""
        occupancy, grid = self.occupancy, self.occupancy.grid

        def surface(x, y, z):
            return grid.within(x, y, z) and occupancy.state(x, y, z) == SURFACE

        masks = []
        for (x0, y0, z0), entry in zip(grid.brick_places(), occupancy.table):
            if entry < 3:
                continue
            mask = 0
            for bit in range(64):
                x, y, z = x0 + (bit & 3), y0 + (bit >> 2 & 3), z0 + (bit >> 4)
                mask |= any(surface(x - (b & 1), y - (b >> 1 & 1), z - (b >> 2)) for b in range(8)) << bit
            masks.append(mask)
        return masks

    def number(self, x, y, z):
        """The number of a corner's feature vector, or None."""
        bricks = self.occupancy.grid.bricks
        entry = self.occupancy.table[(x >> 2) + bricks[0] * ((y >> 2) + bricks[1] * (z >> 2))]
        if entry < 3:
            return None
        mask = self.masks[entry - 3]
        bit = (x & 3) + 4 * (y & 3) + 16 * (z & 3)
        if not mask >> bit & 1:
            return None
        return self.base[entry - 3] + (mask & ((1 << bit) - 1)).bit_count()


def _features(coded, corners, floats, data, place):
    """A tuple of values for each corner."""
    count = corners * floats
    if coded:
        decoder, models = Decoder(data, place + ": features"), Models()
        numbers = [decoder.symbol(models, n % floats, 8) for n in range(count)]
        decoder.finish()
        numbers = [n - 256 if n > 127 else n for n in numbers]
    else:
        numbers = struct.unpack(f"<{count}b", data)
    require(-128 not in numbers, place, "a feature of -128")
    return [tuple(numbers[n : n + floats]) for n in range(0, count, floats)]


class Segment:
    proven = True

    def __init__(self, cells, corners, features, floats, samples, length_scale, network):
        self.cells, self.corners, self.features, self.floats, self.samples = cells, corners, features, floats, samples
        self.network = network
        self.box, self.scale = cells.box, cells.cells_per_unit
        self.voxels_per_cell = 1.0 / (1 << cells.grid.levels)
        self.total_scale = single(length_scale * self.voxels_per_cell)

    def answer(self, o, d, tmin, tmax):
        result = traverse(self.cells, o, d, tmin, tmax)
        if result.verdict != OPEN:
            return proven(result)
        D = result.D
        turned = D[2] < 0 or (D[2] == 0 and (D[1] < 0 or (D[1] == 0 and D[0] < 0)))
        points = self._points(result)
        if turned:
            points.reverse()
        inputs = [f for t, _ in points for f in self._features_at(result, t)]
        inputs += [height for _, height in points]
        inputs += self._direction(result, turned)
        ends = (result.starts_open, result.ends_open)
        inputs += [127 * flag for flag in (result.seen_outside, result.seen_inside, *(reversed(ends) if turned else ends))]
        logit = self.network.logit(inputs)
        return logit, logit >= 0, False

    def hit(self, o, d, tmin, tmax):
        return hit_by_planes(self.cells, o, d, tmin, tmax, lambda end: self.answer(o, d, tmin, end)[1])

    def _points(self, result):
        """(t, height) of each point, in the order of the ray."""
        spacing = single(result.open_t / self.samples)
        before = 0.0
        points = []
        for nth, interval in enumerate(result.intervals):
            length = single(interval.end - interval.begin)
            last = nth + 1 == len(result.intervals)
            while len(points) < self.samples:
                s = single((len(points) + 0.5) * spacing)
                if not last and s > single(before + length):
                    before = single(before + length)
                    break
                t = least(single(interval.begin + single(s - before)), interval.end)
                share = single(divide(single(t - interval.begin), length))
                rise = single((interval.end_height - interval.begin_height) * share)
                points.append((t, index(single(single(interval.begin_height + rise) + 0.5), 127)))
        return points

    def _features_at(self, result, t):
        voxel, fraction = [], []
        for a in range(3):
            at = single(single(result.O[a] + single(t * result.D[a])) * self.voxels_per_cell)
            voxel.append(index(at, self.cells.grid.voxels[a] - 1))
            fraction.append(index(single(single(single(at - voxel[a]) * 128) + 0.5), 128))
        sums = [(127 << 21) + (1 << 21)] * self.floats
        for b in range(8):
            weight = 1
            for a in range(3):
                weight *= fraction[a] if b >> a & 1 else 128 - fraction[a]
            corner = self.corners.number(*(voxel[a] + (b >> a & 1) for a in range(3)))
            if corner is not None:
                sums = [s + weight * f for s, f in zip(sums, self.features[corner])]
        return [s >> 22 for s in sums]

    def _direction(self, result, turned):
        D = result.D
        length = single(math.sqrt(single(single(single(D[0] * D[0]) + single(D[1] * D[1])) + single(D[2] * D[2]))))
        inputs = []
        for a in range(3):
            part = single(divide(D[a], length))
            part = -part if turned else part
            inputs.append(index(single(64 + single(63.5 * part)), 127))
        total = single(single(result.open_t * length) * self.total_scale)
        return inputs + [index(single(total + 0.5), 127)]


def read_mlp(number, fields, payloads):
    place = f"mlp {number}"
    return Mlp(fields, payloads.take(fields[16:20], place), place)


def read(item, fields, payloads, mlps):
    place = f"{item.place}: network"
    mlp, corners, floats, samples, length_scale, forms = fields[0:6]
    cells = item.planes
    require(mlp < len(mlps), place, f"mlp {mlp} of {len(mlps)}")
    require_range(floats, 1, 8, place, "features_per_corner")
    require(samples % 4 == 0 and 4 <= samples <= 32, place, f"samples is {samples}")
    require(samples * (floats + 1) + 8 == mlps[mlp].inputs, place, "the network has another number of inputs")
    require(length_scale >= 0 and length_scale - length_scale == 0, place, "length_scale is not finite and at least 0")
    require(forms < 4, place, f"forms is {forms}")
    reserved(fields[6:8], place)
    of_corners, of_features = payloads.take(fields[8:12], place), payloads.take(fields[12:16], place)
    mixed = cells.grid.mixed_bricks
    require(corners <= 64 * mixed, place, f"{corners} corners in {mixed} mixed bricks")
    around, coded = forms & CORNERS_AROUND, forms & CODED_FEATURES
    size = 0 if around else 12 * mixed
    require(len(of_corners) == size, place, f"a payload of corners has {len(of_corners)} bytes, not {size}")
    size = corners * floats
    require(coded or len(of_features) == size, place, f"a payload of features has {len(of_features)} bytes, not {size}")
    check_expansion(place, forms, 12 * mixed + corners * floats, len(of_corners) + len(of_features))
    where = Corners(cells.occupancy, of_corners, around, place)
    require(where.count == corners, place, f"corners is {corners}, but there are {where.count}")
    vectors = _features(coded, corners, floats, of_features, place)
    return Segment(cells, where, vectors, floats, samples, length_scale, mlps[mlp])
