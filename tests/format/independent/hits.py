"""The first hit of an object, and of one with planes (docs/answers.md, "First hits")."""

import math
from dataclasses import dataclass

from single import largest, least, single
from traversal import NEVER, OCCLUDED, OPEN, VISIBLE, traverse

NONE = 2**32 - 1


@dataclass
class Hit:
    t: float = math.inf
    low: float = -math.inf
    high: float = math.inf
    normal: tuple = (0.0, 0.0, 0.0)
    triangle: int = NONE
    u: float = 0.0
    v: float = 0.0


def none(certain):
    return Hit(low=math.inf if certain else -math.inf)


def hit_by_planes(cells, o, d, tmin, tmax, is_visible=None):
    """is_visible(tmax): the object's answer to the ray up to tmax, if it has a network."""
    result = traverse(cells, o, d, tmin, tmax, in_order=True)
    if result.verdict == VISIBLE:
        return none(result.certain)
    hit = Hit()
    near = all(single(abs(single(x - y)) * cells.cells_per_unit) <= 4096 for x, y in zip(o, cells.grid.origin))
    proven = result.verdict == OCCLUDED and result.certain
    if near:
        hit.low = result.cells[0].enter if result.cells else result.last_enter
    elif proven:
        hit.low = tmin
    if proven:
        hit.high = result.last_leave
    if not result.cells:
        hit.t = result.last_enter
        return hit
    found = len(result.cells) - 1
    if is_visible:
        if result.verdict == OPEN and is_visible(tmax):
            return hit
        first = 0
        while first < found:
            middle = (first + found) // 2
            if is_visible(result.cells[middle].leave):
                first = middle + 1
            else:
                found = middle
    cell = result.cells[found]
    middle = single(cell.begin + single(0.5 * single(cell.end - cell.begin)))
    hit.t = largest(least(middle, least(cell.end, NEVER)), -NEVER)
    planes = cells.planes(cell.number)
    if not (planes.bare and planes.kind == 0):
        hit.normal = tuple(map(float, planes.normal))
    return hit
