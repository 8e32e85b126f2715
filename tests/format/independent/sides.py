"""Which side each region of space without triangles is on (docs/format.md, "Sides")."""

from grid import INSIDE, OUTSIDE, SURFACE, UNKNOWN
from shell import require


class Sides:
    """Regions by number: 0 outside, 1 inside, then two for each word (above, below), then children that are not there.

    Something that has a face is the number of a word, or a region of which all points are: ("all", region), or None.
    """

    def __init__(self, cells):
        self.cells = cells
        self.parents = list(range(2 + 2 * cells.count))
        self.missing = {}
        occupancy, levels = cells.occupancy, cells.grid.levels
        size = 1 << levels
        for number, at in enumerate(occupancy.surface):
            for axis in range(3):
                for above in (0, 1):
                    place = list(at)
                    place[axis] += 1 if above else -1
                    other = self._voxel(place)
                    if not above and isinstance(other, int):
                        continue  # the other one takes this pair
                    corner = [c << levels for c in at]
                    corner[axis] += size * above
                    self._face(*((number, other) if above else (other, number)), axis, corner, size)
        for number in range(cells.count):
            if cells.is_cut(number):
                half = cells.side[number] // 2
                for axis in range(3):
                    for k in range(8):
                        if k >> axis & 1:
                            corner = [c + half * (k >> a & 1) for a, c in enumerate(cells.low[number])]
                            self._face(self._part(number, k ^ 1 << axis), self._part(number, k), axis, corner, half)

    def check_apart(self):
        require(self._root(OUTSIDE) != self._root(INSIDE), self.cells.place, "something is both outside and inside")

    def side(self, number, below):
        root = self._root(2 + 2 * number + below)
        return next((side for side in (OUTSIDE, INSIDE) if root == self._root(side)), None)

    def _root(self, region):
        while self.parents[region] != region:
            self.parents[region] = self.parents[self.parents[region]]
            region = self.parents[region]
        return region

    def _voxel(self, at):
        if not self.cells.grid.within(*at):
            return "all", OUTSIDE
        state = self.cells.occupancy.state(*at)
        if state == SURFACE:
            return self.cells.occupancy.word_of[tuple(at)]
        return None if state == UNKNOWN else ("all", state)

    def _part(self, number, k):
        part = self.cells.part(number, k)
        if part is not None:
            return part
        if (number, k) not in self.missing:
            self.missing[number, k] = len(self.parents)
            self.parents.append(len(self.parents))
        return "all", self.missing[number, k]

    def _face(self, lower, upper, axis, corner, size):
        """Joins what meets on a square between something below and something above along an axis."""
        is_cut = [isinstance(x, int) and self.cells.is_cut(x) for x in (lower, upper)]
        first, second = (a for a in range(3) if a != axis)
        if any(is_cut):
            half = size // 2
            for quarter in range(4):
                bits = (quarter & 1) << first | (quarter >> 1) << second
                at = [c + half * (bits >> a & 1) for a, c in enumerate(corner)]
                below = self._part(lower, bits | 1 << axis) if is_cut[0] else lower
                above = self._part(upper, bits) if is_cut[1] else upper
                self._face(below, above, axis, at, half)
            return
        corners = []
        for nth in range(4):
            at = list(corner)
            at[first] += size * (nth & 1)
            at[second] += size * (nth >> 1)
            corners.append(at)
        for a, f in self._regions(lower, corners):
            for b, g in self._regions(upper, corners):
                if meet(f, g):
                    self.parents[self._root(a)] = self._root(b)

    def _regions(self, item, corners):
        """Pairs of a region and how far each corner is beyond its plane."""
        if item is None:
            return []
        if not isinstance(item, int):
            return [(item[1], (1, 1, 1, 1))]
        planes, low, side = self.cells.planes(item), self.cells.low[item], self.cells.side[item]
        step = 2 * (31 * side + 1)
        (nx, ny, nz), (x, y, z) = planes.normal, (2 * c + side for c in low)
        heights = [128 * (nx * (2 * at[0] - x) + ny * (2 * at[1] - y) + nz * (2 * at[2] - z)) for at in corners]
        return [
            (2 + 2 * item, [h - (planes.upper - 128) * step for h in heights]),
            (3 + 2 * item, [(planes.lower - 128) * step - h for h in heights]),
        ]


def meet(f, g):
    """Whether a point of a square lies beyond both planes; f and g say by how much its corners do."""
    if max(f) <= 0 or max(g) <= 0:
        return False
    if min(f) > 0 or min(g) > 0:
        return True
    return any(_meet_border(f[i], f[j], g[i], g[j]) for i, j in ((0, 1), (2, 3), (0, 2), (1, 3)))


def _meet_border(fi, fj, gi, gj):
    if (fi > 0 and gi > 0) or (fj > 0 and gj > 0):
        return True
    if fi > 0 and gj > 0:
        return -gi * (fi - fj) < fi * (gj - gi)
    if fj > 0 and gi > 0:
        return -gj * (fj - fi) < fj * (gi - gj)
    return False
