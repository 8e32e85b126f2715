"""First hits of a scene: placed objects, and what callers get (docs/answers.md, "Instances" and "First hits").
"""

import math
import struct

from grid import SURFACE
from hits import NONE, none
from single import divide, largest, least, single

IDENTITY = (1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0)


def next_above(x):
    if x == math.inf or x != x:
        return x
    (bits,) = struct.unpack("<i", struct.pack("<f", x))
    if x == 0:
        bits = 1
    else:
        bits += 1 if x > 0 else -1
    return struct.unpack("<f", struct.pack("<i", bits))[0]


def next_below(x):
    return -next_above(-x)


def product(m, v):
    """In single precision, of row-major 3x3."""
    terms = [[single(a * b) for a, b in zip(m[3 * r : 3 * r + 3], v)] for r in range(3)]
    return [single(single(x + y) + z) for x, y, z in terms]


class Instance:
    """item, number of the object; can_be_placed"""

    def __init__(self, number, item, transform, remainder):
        self.number, self.item, self.R = number, item, remainder
        self.T = transform[3::4]
        self.identical = transform == IDENTITY and not any(remainder)
        m = [transform[0:3], transform[4:7], transform[8:11]]
        inverse = [[0.0] * 3 for _ in range(3)]
        for r in range(3):
            for c in range(3):
                a, b, e, f = (c + 1) % 3, (c + 2) % 3, (r + 1) % 3, (r + 2) % 3
                inverse[r][c] = m[a][e] * m[b][f] - m[a][f] * m[b][e]
        determinant = m[0][0] * inverse[0][0] + m[0][1] * inverse[1][0] + m[0][2] * inverse[2][0]
        inverse = [divide(x, determinant) for row in inverse for x in row]
        norm = inverse_norm = 0.0
        for x, y in zip((x for row in m for x in row), inverse):
            norm += x * x
            inverse_norm += y * y
        self.good = math.sqrt(norm) * math.sqrt(inverse_norm) <= 12288
        self.I = [single(x) for x in inverse]
        self.can_be_placed = all(x - x == 0 for x in (*self.I, *transform))
        self._find_box(m, *item.box())
        low, high = item.box()
        self.good &= all(max(-a, b) * item.scale <= 2048 for a, b in zip(low, high))

    def _find_box(self, m, low, high):
        self.min, self.max = [], []
        for r in range(3):
            lowest = highest = self.T[r] + self.R[r]
            for a in range(3):
                below, above = (high[a], low[a]) if m[r][a] < 0 else (low[a], high[a])
                lowest += m[r][a] * below
                highest += m[r][a] * above
            self.min.append(min(next_below(single(lowest)), 2.0**127))
            self.max.append(max(next_above(single(highest)), -(2.0**127)))

    def passage(self, o, d, tmin, tmax):
        """enter and leave of the box."""
        near, far = [], []
        for a in range(3):
            inverse = single(1 / d[a]) if abs(d[a]) >= 2.0**-126 else math.inf
            x, y = (single(single(plane - o[a]) * inverse) for plane in (self.min[a], self.max[a]))
            near.append(least(x, y))
            far.append(largest(y, x))
        enter = largest(near[2], largest(near[1], largest(near[0], -math.inf)))
        leave = least(far[2], least(far[1], least(far[0], math.inf)))
        less, more = 1 - 2.0**-16, 1 + 2.0**-16
        first = single(least(single(enter * less), single(enter * more)) - 2.0**-130)
        last = single(largest(single(leave * less), single(leave * more)) + 2.0**-130)
        return largest(least(first, 2.0**127), tmin), least(largest(last, -(2.0**127)), tmax)

    def _from_translation(self, o):
        return [single(single(x - t) - r) for x, t, r in zip(o, self.T, self.R)]

    def to_object(self, o, d):
        if self.identical:
            return o, d
        return product(self.I, self._from_translation(o)), product(self.I, d)

    def hit(self, o, d, tmin, tmax):
        local = self.to_object(o, d)
        hit = self.item.hit(*local, tmin, tmax)
        if not (self.identical or tmin > tmax or (self.good and self._is_near(o, d, local[1]))):
            hit.low, hit.high = -math.inf, math.inf
        return hit

    def _is_near(self, o, d, local_d):
        far = spread = 0.0
        p = self._from_translation(o)
        for r in range(3):
            start = along = 0.0
            for c in range(3):
                start = single(start + single(abs(self.I[3 * r + c]) * abs(p[c])))
                along = single(along + single(abs(self.I[3 * r + c]) * abs(d[c])))
            far, spread = largest(start, far), largest(along, spread)
        steep = 0.0
        for x in local_d:
            steep = largest(abs(x), steep)
        if any(self.R):
            far = single(far * 1.25)
        return single(far * self.item.scale) <= 2048 and spread <= single(4 * steep)

    def world_normal(self, normal, d):
        n = normal
        if not self.identical:
            m = self.I
            n = [m[a] * normal[0] + m[3 + a] * normal[1] + m[6 + a] * normal[2] for a in range(3)]
        square = n[0] * n[0] + n[1] * n[1] + n[2] * n[2]
        if not square > 0:
            n = [-x for x in d]
            square = n[0] * n[0] + n[1] * n[1] + n[2] * n[2]
        length = math.sqrt(square)
        along = n[0] * d[0] + n[1] * d[1] + n[2] * d[2]
        return [single((-x if along > 0 else x) / length) for x in n]


class Scene:
    """instances: of objects of one asset"""

    def __init__(self, asset, instances):
        self.asset, self.instances = asset, instances

    def outputs(self, o, d, tmin, tmax):
        """The members of golden hits in order, from t on."""
        hit, instance = self._hit(o, d, tmin, tmax)
        if not all(instance.item.proven for instance in self.instances):
            hit.low = -math.inf
        is_hit = hit.t < math.inf
        certain = hit.high < math.inf or hit.low == math.inf
        normal = colour = (0.0, 0.0, 0.0)
        number = item = triangle = NONE
        if is_hit:
            normal = instance.world_normal(hit.normal, d)
            number, item = instance.number, self.asset.objects.index(instance.item)
            triangle = hit.triangle
            source = self.asset.source_triangles.get(item)
            if source and triangle != NONE:
                triangle = source[triangle]
            colour = self._colour(item, *instance.to_object(o, d), hit.t)
        return hit.t, hit.low, hit.high, *normal, number, item, triangle, hit.u, hit.v, *colour, is_hit, certain, 0

    def _hit(self, o, d, tmin, tmax):
        if len(self.instances) == 1:
            return self.instances[0].hit(o, d, tmin, tmax), self.instances[0]
        steep = max(map(abs, d))
        valid = all(abs(x) < 2.0**126 for x in o) and all(x - x == 0 for x in d)
        if not valid or not 2.0**-60 <= steep <= 2.0**60 or not tmin <= tmax:
            return none(tmin > tmax), None
        best, nearest = none(True), None
        for instance in self.instances:
            enter, leave = instance.passage(o, d, tmin, tmax)
            if not enter <= leave:
                continue
            hit = instance.hit(o, d, tmin, tmax)
            if enter < 2.0**127:
                hit.low = largest(hit.low, enter)
                if hit.t < math.inf:
                    hit.t = largest(hit.t, enter)
            lowest, highest = least(hit.low, best.low) + 0.0, least(hit.high, best.high) + 0.0
            if hit.t < best.t:  # of several at the same t the first
                best, nearest = hit, instance
            best.low, best.high = lowest, highest
        return best, nearest

    def _colour(self, item, o, d, t):
        colours = self.asset.colours.get(item)
        number = colours and _voxel_near(self.asset.items[item].planes, o, d, t)
        if number is None:
            return 0.5, 0.5, 0.5
        value = colours[number]
        shares = [single(c / n) for c, n in ((value >> 11, 31), (value >> 5 & 63, 63), (value & 31, 31))]
        return [single(x * x) for x in shares]


def _voxel_near(cells, o, d, t):
    """The number of a surface voxel near a point of a ray, or None."""
    grid, occupancy = cells.grid, cells.occupancy
    at = [((o[a] - grid.origin[a]) + t * d[a]) * grid.voxels_per_unit for a in range(3)]
    middle = [int(min(at[a], grid.voxels[a] - 1)) if at[a] >= 0 else 0 for a in range(3)]

    def surface(voxel):
        return grid.within(*voxel) and occupancy.state(*voxel) == SURFACE

    if surface(middle):
        return occupancy.word_of[tuple(middle)]
    found, nearest = None, 0.0
    for i in range(27):
        voxel = middle[0] + i % 3 - 1, middle[1] + i // 3 % 3 - 1, middle[2] + i // 9 - 1
        if not surface(voxel):
            continue
        off = [max(v - x, x - (v + 1), 0.0) for v, x in zip(voxel, at)]
        square = off[0] * off[0] + off[1] * off[1] + off[2] * off[2]
        if found is None or square < nearest:
            found, nearest = occupancy.word_of[voxel], square
    return found


def object_scene(asset, item):
    return Scene(asset, [Instance(0, asset.objects[item], IDENTITY, (0.0,) * 3)])


def whole_scene(asset):
    """As the asset places its objects; None if one cannot be placed."""
    if any(asset.objects[item] is None for item, _, _, _ in asset.placed):
        return None
    placed = [(Instance(n, asset.objects[item], t, r), met) for n, (item, t, r, met) in enumerate(asset.placed)]
    if not all(x.can_be_placed for x, _ in placed):
        return None
    return Scene(asset, [x for x, met in placed if met])
