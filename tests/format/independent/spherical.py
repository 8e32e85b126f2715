"""`spherical` objects, and fields for primary rays (docs/format.md, "The payloads of `spherical` objects", "The
payload of a field for primary rays"; docs/answers.md, "spherical").
"""

import math
import struct

from bvh import MAX
from container import require_aabb
from hits import Hit, none
from shell import PAYLOAD, Payloads, require, require_range, reserved
from single import divide, index, largest, least, single

LIMIT = 4096.0
LAYOUT, PAIR_LAYOUT, PRIMARY_LAYOUT = "I3H4BH" + PAYLOAD, "If6I4I" + PAYLOAD, "IH2BIf3If4I" + PAYLOAD


def values(data, count, half, place):
    size = (2 if half else 4) * count
    require(len(data) == size, place, f"a payload of {len(data)} bytes, not {size}")
    numbers = struct.unpack(f"<{count}{'e' if half else 'f'}", data)
    require(all(-LIMIT <= x <= LIMIT for x in numbers), place, "a value is NaN or beyond 4096")
    return numbers


class Network:
    """Layers, each a list of inputs of a list of weights, one for each output."""

    def __init__(self, inputs, width, hidden, slope, place):
        require_range(inputs, 1, 24, place, "inputs")
        require(width % 4 == 0 and 4 <= width <= 256, place, f"width is {width}")
        require_range(hidden, 1, 3, place, "hidden layers")
        require(0 <= slope <= 1, place, "slope is not 0 to 1")
        self.inputs, self.slope = inputs, slope
        self.shapes = [(inputs, width)] + [(width, width)] * (hidden - 1) + [(width, 1)]

    def count(self):
        return sum(inputs * outputs for inputs, outputs in self.shapes)

    def take(self, numbers):
        """Takes the weights from an iterator."""
        self.layers = [[[next(numbers) for _ in range(outputs)] for _ in range(inputs)] for inputs, outputs in self.shapes]

    def output(self, x):
        for nth, layer in enumerate(self.layers):
            sums = [0.0] * len(layer[0])
            for value, weights in zip(x, layer):
                sums = [single(s + single(w * value)) for s, w in zip(sums, weights)]
            x = sums
            if nth + 1 < len(self.layers):
                x = [largest(y, single(self.slope * y)) for y in x]
        return x[0]


class Grid:
    """Latent vectors: of `rows` x `columns`."""

    def __init__(self, rows, columns, floats, numbers):
        self.floats, self.columns = floats, columns
        self.numbers = [next(numbers) for _ in range(rows * columns * floats)]

    def at(self, row, column, f):
        return self.numbers[(row * self.columns + column) * self.floats + f]


def between(a, part, b):
    return single(a + single(part * single(b - a)))


def along(s, resolution):
    x = least(largest(single(s * (resolution - 1)), 0.0), float(resolution - 1))
    low = index(x, resolution - 2)
    return low, low + 1, single(x - low)


def around(s, resolution):
    x = least(largest(single(s * resolution), 0.0), float(resolution))
    low = index(x, resolution - 1)
    return low, 0 if low + 1 == resolution else low + 1, single(x - low)


def look_up_angles(grid, theta, phi):
    row, column = along(theta, grid.columns), around(phi, grid.columns)
    result = []
    for f in range(grid.floats):
        upper = between(grid.at(row[0], column[0], f), column[2], grid.at(row[0], column[1], f))
        lower = between(grid.at(row[1], column[0], f), column[2], grid.at(row[1], column[1], f))
        result.append(between(upper, row[2], lower))
    return result


def look_up_distance(grid, rows, s):
    low, high, part = along(s, rows)
    return [between(grid.at(low, 0, f), part, grid.at(high, 0, f)) for f in range(grid.floats)]


_TANGENT = """
    0x1.000000p+0 -0x1.5554d8p-2 0x1.9977cap-3 -0x1.22ff8ep-3 0x1.b47b06p-4
    -0x1.3462e8p-4 0x1.5f83fcp-5 -0x1.08dc04p-6 0x1.77ae94p-9
"""
_TANGENT = [float.fromhex(c) for c in _TANGENT.split()]
_HALF_PI, _PI = float.fromhex("0x1.921fb6p+0"), float.fromhex("0x1.921fb6p+1")
_PER_PI, _PER_TWO_PI = float.fromhex("0x1.45f306p-2"), float.fromhex("0x1.45f306p-3")


def angle(y, x):
    ax, ay = abs(x), abs(y)
    large, small = largest(ax, ay), least(ax, ay)
    ratio = single(small / large) if large > 0 else 0.0
    square = single(ratio * ratio)
    total = _TANGENT[8]
    for c in reversed(_TANGENT[:8]):
        total = single(single(total * square) + c)
    result = single(total * ratio)
    if ay > ax:
        result = single(_HALF_PI - result)
    if x < 0:
        result = single(_PI - result)
    return -result if y < 0 else result


def angles(v):
    across = single(math.sqrt(single(single(v[0] * v[0]) + single(v[1] * v[1]))))
    return single(angle(across, v[2]) * _PER_PI), single(single(angle(v[1], v[0]) * _PER_TWO_PI) + 0.5)


class Field:
    proven = True

    def __init__(self, item, outer, inner, grids, distances):
        self.low, self.high = item.low, item.high
        self.outer, self.inner, self.grids, self.distances = outer, inner, grids, distances
        side = [b - a for a, b in zip(self.low, self.high)]
        diagonal = math.sqrt(side[0] * side[0] + side[1] * side[1] + side[2] * side[2])
        self.centre = [single((a + b) / 2) for a, b in zip(self.low, self.high)]
        self.near_half = single(2 / diagonal)
        self.margin = single(single(diagonal) * 2.0**-14)
        self.reach = single(64 / diagonal)
        self.extent = max(map(abs, (*self.low, *self.high)))

    def answer(self, o, d, tmin, tmax):
        low, high = self.low, self.high
        start = [single(x + single(tmin * y)) for x, y in zip(o, d)]
        finite = all(x - x == 0 for x in (*o, *d))
        far, steep = max(self.extent, *map(abs, o)), max(map(abs, d))
        if not finite or not far <= 2.0**60 or not 2.0**-60 <= steep <= 2.0**60 or not tmin <= tmax:
            return MAX, True, tmin > tmax
        inside = all(a <= x <= b for a, x, b in zip(low, start, high))
        if not inside:
            enter, leave = self._clip(o, d, tmin, tmax, far, steep)
            if not enter <= leave:
                return MAX, True, single(far * self.reach) <= 16384
            start = [least(largest(single(o[a] + single(enter * d[a])), low[a]), high[a]) for a in range(3)]
        start = [single(x - c) for x, c in zip(start, self.centre)]

        position, direction = self.grids[2:4] if inside else self.grids[0:2]
        inputs = look_up_angles(position, *angles(start)) + look_up_angles(direction, *angles(d))
        if inside:
            squares = [single(x * x) for x in start]
            distance = single(single(math.sqrt(single(single(squares[0] + squares[1]) + squares[2]))) * self.near_half)
            inputs += look_up_distance(self.grids[4], self.distances, distance)
        z = (self.inner if inside else self.outer).output(inputs)
        logit = math.floor(single(largest(least(z, 32767.0), -32767.0) * 65536))
        return logit, logit >= 0, False

    def box(self):
        return [x - 8 * self.margin for x in self.low], [x + 8 * self.margin for x in self.high]

    @property
    def scale(self):
        return self.reach

    def hit(self, o, d, tmin, tmax):
        _, visible, certain = self.answer(o, d, tmin, tmax)
        if visible:
            return none(certain)
        enter = largest(tmin, -(2.0**60))
        for a in range(3):
            if d[a] != 0:
                near = single(single((self.high if d[a] < 0 else self.low)[a] - o[a]) / d[a])
                if near - near == 0:
                    enter = largest(near, enter)
        return Hit(t=least(enter, tmax))

    def _clip(self, o, d, tmin, tmax, far, steep):
        padding = single(single(far * 2.0**-20) + self.margin)
        flat = single(steep * 2.0**-30)
        farthest = single(single(8 * far) / steep)
        enter, leave = largest(tmin, -farthest), least(tmax, farthest)
        for a in range(3):
            backwards = d[a] < 0
            first, last = (self.high[a], self.low[a]) if backwards else (self.low[a], self.high[a])
            outward = -padding if backwards else padding
            size = largest(abs(d[a]), flat)
            inverse = single(divide(1.0, -size if backwards else size))
            enter = largest(single(single(first - single(o[a] + outward)) * inverse), enter)
            leave = least(single(single(last - single(o[a] - outward)) * inverse), leave)
        return enter, leave


def read_pair(number, fields, payloads):
    place = f"pair of spherical networks {number}"
    require_range(fields[0], 0, 1, place, "half precision")
    reserved(fields[8:12], place)
    outer, inner = (Network(*fields[at : at + 3], fields[1], place) for at in (2, 5))
    numbers = values(payloads.take(fields[12:16], place), outer.count() + inner.count(), fields[0], place)
    numbers = iter(numbers)
    outer.take(numbers)
    inner.take(numbers)
    return outer, inner


def read(item, fields, payloads, pairs):
    place = f"{item.place}: spherical"
    pair, r, f, half, zero = fields[0], fields[1:4], fields[4:7], fields[7], fields[8]
    require_aabb(item)
    require(pair < len(pairs), place, f"pair of networks {pair} of {len(pairs)}")
    for resolution, floats in zip(r, f):
        require_range(resolution, 2, 2048, place, "resolution")
        require_range(floats, 1, 8, place, "floats of a latent vector")
    require_range(half, 0, 1, place, "half precision")
    reserved((zero,), place)
    outer, inner = pairs[pair]
    match = 2 * f[0] == outer.inputs and 2 * f[1] + f[2] == inner.inputs
    require(match, place, "latent vectors do not match the networks")
    shapes = [(r[0], r[0], f[0])] * 2 + [(r[1], r[1], f[1])] * 2 + [(r[2], 1, f[2])]
    count = sum(rows * columns * floats for rows, columns, floats in shapes)
    numbers = iter(values(payloads.take(fields[9:13], place), count, half, place))
    return Field(item, outer, inner, [Grid(*shape, numbers) for shape in shapes], r[2])


def read_primary(file):
    """Checks the fields for primary rays. No answer depends on them."""
    if "PRIM" not in file.sections:
        return
    payloads = Payloads(file.sections["PVAL"])
    last = -1
    for number, fields in enumerate(file.sections["PRIM"].records(PRIMARY_LAYOUT)):
        item, resolution, floats, half_grids, half, slope, inputs, width, hidden, margin, *rest = fields
        place = f"field for primary rays {number}"
        require(last < item < len(file.objects), place, f"object {item}")
        last = item
        if file.objects[item].unsupported:
            continue
        require_range(resolution, 2, 2048, place, "resolution")
        require_range(floats, 1, 8, place, "floats of a latent vector")
        require_range(half_grids, 0, 1, place, "half precision of grids")
        require_range(half, 0, 1, place, "half precision of weights")
        require(0 <= margin <= 1, place, "margin is not 0 to 1")
        reserved(rest[:4], place)
        require_aabb(file.objects[item])
        network = Network(inputs, width, hidden, slope, place)
        require(inputs == 2 * floats, place, "latent vectors do not match the network")
        data = payloads.take(rest[4:], place)
        grid = 2 * resolution * resolution * floats
        size = grid * (2 if half_grids else 4)
        values(data[:size], grid, half_grids, place)
        values(data[size:], network.count() + 4 * width, half, place)
