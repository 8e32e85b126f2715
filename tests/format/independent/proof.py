"""`proof` objects: planes alone (docs/answers.md, "proof")."""

from bvh import MAX
from hits import hit_by_planes
from traversal import OPEN, VISIBLE, traverse


def proven(result):
    """The answer of a traversal that is not open."""
    visible = result.verdict == VISIBLE
    return (MAX if visible else -MAX), visible, result.certain


class Proof:
    proven = True

    def __init__(self, cells):
        self.cells = cells
        self.box, self.scale = cells.box, cells.cells_per_unit

    def answer(self, o, d, tmin, tmax):
        result = traverse(self.cells, o, d, tmin, tmax)
        return (-1, False, False) if result.verdict == OPEN else proven(result)

    def hit(self, o, d, tmin, tmax):
        return hit_by_planes(self.cells, o, d, tmin, tmax)
