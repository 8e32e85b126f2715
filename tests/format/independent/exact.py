"""`exact` objects (docs/format.md, "`exact`, 112 bytes"; docs/answers.md, "exact")."""

from bvh import Tree
from container import Payloads, require, reserved
from grid import Grid
from proof import check_forms, proven, read_cells
from single import single
from walk import walk

LIMIT = 2.0**41


class Exact:
    def __init__(self, cells, tree):
        self.cells, self.tree = cells, tree

    def answer(self, o, d, tmin, tmax):
        answer = self.tree.settled(o, d, tmin, tmax)
        if answer is not None:
            return answer
        result = walk(self.cells, o, d, tmin, tmax)
        return proven(result) if result.certain else self.tree.answer(o, d, tmin, tmax)


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


def read(file):
    records = file.sections["EXCT"].records("4f3I5I4I6Q")
    require(len(records) == len(file.of_encoding(4)), "EXCT", "a record that belongs to no object")
    occupancies, cells, trees = (Payloads(file.sections[name]) for name in ("EOCC", "ECEL", "EBVH"))
    objects = []
    for number, fields in enumerate(records):
        place = f"exact {number}"
        levels, mixed, surface, parts, forms = fields[7:12]
        nodes, vertices, triangles, zero = fields[12:16]
        require(all(-LIMIT <= x <= LIMIT for x in fields[0:3]), place, "origin is beyond 2^41")
        check_forms(forms, place)
        reserved((zero,), place)
        grid = Grid(place, fields[0:3], fields[3], fields[4:7], levels, mixed, surface, parts, forms)
        payloads = [p.take(*fields[16 + 2 * nth : 18 + 2 * nth], place) for nth, p in enumerate((occupancies, cells, trees))]
        tree = Tree(payloads[2], nodes, vertices, triangles, place)
        _check_near(grid, tree)
        objects.append(Exact(read_cells(grid, *payloads[0:2]), tree))
    for payloads in (occupancies, cells, trees):
        payloads.finish()
    return objects
