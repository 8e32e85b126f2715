"""`segment` objects (docs/format.md, "`segment`, 120 bytes", "Network", "The feature payload", "The weights
payload", and "Coded payloads": "Features"; docs/answers.md, "segment").
"""

import math
import struct
from operator import mul

from cells import Cells
from coding import Decoder, Models
from container import Payloads, require, require_range, reserved
from grid import CODED_CELLS, CODED_FEATURES, CODED_OCCUPANCY, Grid, Occupancy, check_coding
from proof import proven
from single import divide, index, least, single
from walk import OPEN, walk


class Network:
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


def _features(grid, corners, floats, data):
    """A tuple of values for each corner."""
    count = corners * floats
    if grid.forms & CODED_FEATURES:
        decoder, models = Decoder(data, grid.place + ": features"), Models()
        numbers = [decoder.symbol(models, n % floats, 8) for n in range(count)]
        decoder.finish()
        numbers = [n - 256 if n > 127 else n for n in numbers]
    else:
        numbers = struct.unpack(f"<{count}b", data)
    require(-128 not in numbers, grid.place, "a feature of -128")
    return [tuple(numbers[n : n + floats]) for n in range(0, count, floats)]


class Segment:
    def __init__(self, cells, features, floats, samples, length_scale, network):
        self.cells, self.features, self.floats, self.samples = cells, features, floats, samples
        self.network = network
        self.voxels_per_cell = 1.0 / (1 << cells.grid.levels)
        self.total_scale = single(length_scale * self.voxels_per_cell)

    def answer(self, o, d, tmin, tmax):
        result = walk(self.cells, o, d, tmin, tmax)
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

    def _points(self, result):
        """(t, height) of each point, in the order of the ray."""
        spacing = single(result.open_t / self.samples)
        before = 0.0
        points = []
        for nth, run in enumerate(result.runs):
            length = single(run.end - run.begin)
            last = nth + 1 == len(result.runs)
            while len(points) < self.samples:
                s = single((len(points) + 0.5) * spacing)
                if not last and s > single(before + length):
                    before = single(before + length)
                    break
                t = least(single(run.begin + single(s - before)), run.end)
                share = single(divide(single(t - run.begin), length))
                rise = single((run.end_height - run.begin_height) * share)
                points.append((t, index(single(single(run.begin_height + rise) + 0.5), 127)))
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
            corner = self.cells.occupancy.corner(*(voxel[a] + (b >> a & 1) for a in range(3)))
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


def read(file):
    records = file.sections["SEGM"].records("I4f3I4If5I6Q")
    require(len(records) == len(file.of_encoding(1)), "SEGM", "a record that belongs to no object")
    payloads = Payloads(file.sections["WGTS"])
    networks = []
    for number, fields in enumerate(file.sections["NETS"].records("If12IiIQQ")):
        place = f"network {number}"
        networks.append(Network(fields, payloads.take(*fields[16:18], place), place))
    payloads.finish()

    occupancies, features, cells = (Payloads(file.sections[name]) for name in ("OCCU", "FEAT", "CELL"))
    objects = []
    for number, fields in enumerate(records):
        place = f"segment {number}"
        network, mixed, corners, floats, samples, length_scale = fields[0], *fields[8:13]
        levels, surface, parts, forms, zero = fields[13:18]
        require(network < len(networks), place, f"network {network} of {len(networks)}")
        require_range(floats, 1, 8, place, "features_per_corner")
        require(samples % 4 == 0 and 4 <= samples <= 32, place, f"samples is {samples}")
        require(samples * (floats + 1) + 8 == networks[network].inputs, place, "the network has another number of inputs")
        require(length_scale >= 0 and length_scale - length_scale == 0, place, "length_scale is not finite and at least 0")
        require(forms < 32, place, f"forms is {forms}")
        reserved((zero,), place)
        grid = Grid(place, fields[1:4], fields[4], fields[5:8], levels, mixed, surface, parts, forms)
        of_occupancy, of_features, of_cells = (
            p.take(*fields[18 + 2 * nth : 20 + 2 * nth], place) for nth, p in enumerate((occupancies, features, cells))
        )
        require(corners <= 64 * mixed, place, f"{corners} corners in {mixed} mixed bricks")
        check_coding(
            grid,
            [
                (of_occupancy, grid.occupancy_size(True), forms & CODED_OCCUPANCY),
                (of_features, corners * floats, forms & CODED_FEATURES),
                (of_cells, grid.cells_size(), forms & CODED_CELLS),
            ],
        )
        occupancy = Occupancy(grid, of_occupancy, True)
        require(occupancy.corners == corners, place, f"corners is {corners}, but there are {occupancy.corners}")
        vectors = _features(grid, corners, floats, of_features)
        objects.append(Segment(Cells(grid, occupancy, of_cells), vectors, floats, samples, length_scale, networks[network]))
    for payloads in (occupancies, features, cells):
        payloads.finish()
    return objects
