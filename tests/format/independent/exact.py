"""`exact` objects: planes, and triangles for what they leave open (docs/format.md, "Planes and triangles";
docs/answers.md, "exact").
"""

from proof import proven
from shell import require
from single import single
from traversal import traverse

LIMIT = 2.0**41


class Exact:
    proven = True

    def __init__(self, cells, tree):
        self.cells, self.tree = cells, tree
        self.box, self.scale = tree.box, tree.scale
        _check_near(cells.grid, tree)

    def answer(self, o, d, tmin, tmax):
        answer = self.tree.settled(o, d, tmin, tmax)
        if answer is not None:
            return answer
        result = traverse(self.cells, o, d, tmin, tmax)
        return proven(result) if result.certain else self.tree.answer(o, d, tmin, tmax)

    def hit(self, o, d, tmin, tmax):
        return self.tree.hit(o, d, tmin, tmax)


def _check_near(grid, tree):
    cell = single(1 / single(grid.voxels_per_unit * 2**grid.levels))
    require(tree.extent <= LIMIT, grid.place, "the BVH extends beyond 2^41")
    for a in range(3):
        side = single(grid.voxels[a] / grid.voxels_per_unit)
        low = grid.origin[a]
        high = single(low + side)
        require(low >= -LIMIT and high <= LIMIT, grid.place, "the grid extends beyond 2^41")
        require(tree.root_low[a] >= single(single(low - side) - cell), grid.place, "the BVH lies far below the grid")
        require(tree.root_high[a] <= single(single(high + side) + cell), grid.place, "the BVH lies far above the grid")
