"""The traversal of a ray through a grid of cells with planes (docs/answers.md, "The grid", and
"First hits": "The traversal in order")."""

from dataclasses import dataclass, field

from cells import CUT, KINDS
from grid import INSIDE, OUTSIDE, SURFACE
from single import divide, index, largest, least, single

NEVER = float.fromhex("0x1.fffffep+127")
VISIBLE, OCCLUDED, OPEN = "visible", "occluded", "open"


@dataclass
class Interval:
    begin: float
    end: float
    begin_height: int
    end_height: int


@dataclass
class OpenCell:
    begin: float
    end: float
    enter: float
    leave: float
    number: int


@dataclass
class Traversal:
    verdict: str = OPEN
    certain: bool = False
    O: list = None
    D: list = None
    intervals: list = field(default_factory=list)
    open_t: float = 0.0
    seen_outside: bool = False
    seen_inside: bool = False
    starts_open: bool = False
    ends_open: bool = False
    # Of a traversal in order:
    cells: list = field(default_factory=list)
    last_enter: float = 0.0
    last_leave: float = 0.0

    def stop(self, verdict, certain):
        self.verdict, self.certain = verdict, certain
        return self

    def list_cell(self, cell):
        if len(self.cells) == 64:
            self.cells.pop()
        self.cells.append(cell)

    def see(self, side):
        self.seen_outside |= side == OUTSIDE
        self.seen_inside |= side == INSIDE


def find(cells, c):
    """The cube at a finest cell: (number of its word or None, side or None, low, size)."""
    grid, occupancy = cells.grid, cells.occupancy
    size = 1 << grid.levels
    voxel = tuple(x >> grid.levels for x in c)
    state = occupancy.state(*voxel)
    number = side = None
    if state == SURFACE:
        number = occupancy.word_of[voxel]
        while number is not None and cells.words[number] & 15 == CUT:
            size //= 2
            number = cells.part(number, sum(1 << a for a in range(3) if c[a] & size))
    elif state in (OUTSIDE, INSIDE):
        side = state
    return number, side, [x & ~(size - 1) for x in c], size


def traverse(cells, o, d, tmin, tmax, in_order=False):
    grid, cells_per_unit = cells.grid, cells.cells_per_unit
    n = [count << grid.levels for count in grid.voxels]
    O = [single(single(x - y) * cells_per_unit) for x, y in zip(o, grid.origin)]
    D = [single(x * cells_per_unit) for x in d]
    far, steep = max(map(abs, O)), max(map(abs, D))
    valid = all(x - x == 0 for x in (*O, *D)) and 2.0**-60 <= steep <= 2.0**60
    D = [0.0 if abs(x) < single(steep * 2.0**-40) else x for x in D]
    result = Traversal(O=O, D=D)
    if not tmin <= tmax:
        return result.stop(VISIBLE, tmin > tmax)
    if not valid:
        return result.stop(VISIBLE, False)
    certain = far <= 16384

    enter, leave, clipped_in, clipped_out = tmin, tmax, False, False
    inverse = [0.0] * 3
    for a in range(3):
        if D[a] == 0:
            if not 0 <= O[a] <= n[a]:
                return result.stop(VISIBLE, certain)
            continue
        inverse[a] = single(1 / D[a])
        first, last = single(single(0 - O[a]) * inverse[a]), single(single(n[a] - O[a]) * inverse[a])
        if not D[a] > 0:
            first, last = last, first
        if first > enter:
            enter, clipped_in = first, True
        if last < leave:
            leave, clipped_out = last, True
    if not (enter <= leave and enter <= NEVER):
        return result.stop(VISIBLE, certain)

    c = [index(single(O[a] + single(enter * D[a])), n[a] - 1) for a in range(3)]
    step = [(x > 0) - (x < 0) for x in D]
    plane = [c[a] + (step[a] > 0) for a in range(3)]
    following = [single(single(plane[a] - O[a]) * inverse[a]) if step[a] else NEVER for a in range(3)]
    result.seen_outside = clipped_in or (clipped_out and not in_order)
    now = enter
    ends = False
    while not ends:
        number, side, low, size = find(cells, c)
        entered = now
        while True:
            nearest = 1 if following[1] < following[0] else 0
            if following[2] < following[nearest]:
                nearest = 2
            crossing = following[nearest]
            if not crossing < leave:
                ends = True
                break
            now = largest(crossing, now)
            a = nearest
            c[a] += step[a]
            plane[a] += step[a]
            following[a] = single(single(plane[a] - O[a]) * inverse[a])
            if not low[a] <= c[a] < low[a] + size:
                break
        left = largest(leave, now) if ends else now
        blocked = False
        if number is None:
            result.see(side)
        else:
            blocked, interval = pass_cell(result, cells.planes(number), low, size, entered, left)
            if interval is not None:
                if not result.intervals:
                    result.starts_open = interval.begin == enter and not clipped_in
                result.ends_open = interval.end == leave and not clipped_out
                result.open_t = single(result.open_t + single(interval.end - interval.begin))
                result.intervals.append(interval)
                if in_order:
                    result.list_cell(OpenCell(*(x + 0.0 for x in (interval.begin, interval.end, entered, left)), number))
        stops = blocked or (result.seen_outside and result.seen_inside)
        if stops:
            result.last_enter, result.last_leave = entered + 0.0, (entered if number is None else left) + 0.0
        elif ends and clipped_out and in_order:
            result.seen_outside = True
            if result.seen_inside:
                stops = True
                result.last_enter = result.last_leave = left + 0.0
        if stops:
            return result.stop(OCCLUDED, certain)
    return result.stop(OPEN, False) if result.intervals else result.stop(VISIBLE, certain)


def pass_cell(result, planes, low, size, entered, left):
    """Whether a wall blocks the ray in a cell, and its interval there if the cell is open. Notes sides in the result."""
    E, L = [], []
    for a in range(3):
        start = single(result.O[a] - (low[a] + size / 2))
        E.append(single(planes.normal[a] * single(start + single(entered * result.D[a]))))
        L.append(single(planes.normal[a] * single(start + single(left * result.D[a]))))
    enter_height = single(single(E[0] + E[1]) + E[2])
    leave_height = single(single(L[0] + L[1]) + L[2])
    unit = (31 * size + 1) / 128
    low_plane, high_plane = (planes.lower - 128) * unit, (planes.upper - 128) * unit
    enters_above, enters_below = enter_height > high_plane, enter_height < low_plane
    leaves_above, leaves_below = leave_height > high_plane, leave_height < low_plane

    above, below, wall = KINDS[planes.kind]
    blocked = wall and ((enters_above and leaves_below) or (enters_below and leaves_above))
    if enters_above or leaves_above:
        result.see(above)
    if enters_below or leaves_below:
        result.see(below)
    if (enters_above and leaves_above) or (enters_below and leaves_below):
        return blocked, None

    begin, end = entered, left
    if enters_above or enters_below or leaves_above or leaves_below:
        rate = single(divide(single(left - entered), single(leave_height - enter_height)))

        def passes(height, at_least):
            t = single(entered + single(single(height - enter_height) * rate))
            return least(largest(t, at_least), left)

        if enters_above or enters_below:
            begin = passes(high_plane if enters_above else low_plane, entered)
        if leaves_above or leaves_below:
            end = passes(high_plane if leaves_above else low_plane, begin)
    scale = single(127 / single(high_plane - low_plane))
    heights = [index(single(single(single(h - low_plane) * scale) + 0.5), 127) for h in (enter_height, leave_height)]
    return blocked, Interval(begin, end, *heights)
