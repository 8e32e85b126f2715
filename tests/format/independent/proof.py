"""`proof` objects (docs/format.md, "`proof`, 80 bytes"; docs/answers.md, "proof")."""

from bvh import MAX
from cells import Cells
from container import Payloads, require
from grid import CODED_CELLS, CODED_KINDS, CODED_OCCUPANCY, Grid, Occupancy, check_coding
from walk import OPEN, VISIBLE, walk


def proven(result):
    """The answer of a walk that is not open."""
    visible = result.verdict == VISIBLE
    return (MAX if visible else -MAX), visible, result.certain


class Proof:
    def __init__(self, cells):
        self.cells = cells

    def answer(self, o, d, tmin, tmax):
        result = walk(self.cells, o, d, tmin, tmax)
        return (-1, False, False) if result.verdict == OPEN else proven(result)


def check_forms(forms, place):
    require(not forms & ~(CODED_OCCUPANCY | CODED_CELLS | CODED_KINDS), place, f"forms is {forms}")


def read_cells(grid, occupancy, cells):
    """The cells of a grid without features, from its two payloads."""
    check_coding(
        grid,
        [
            (occupancy, grid.occupancy_size(False), grid.forms & CODED_OCCUPANCY),
            (cells, grid.cells_size(), grid.forms & CODED_CELLS),
        ],
    )
    return Cells(grid, Occupancy(grid, occupancy, False), cells)


def read(file):
    records = file.sections["PROF"].records("4f3I5I4Q")
    require(len(records) == len(file.of_encoding(5)), "PROF", "a record that belongs to no object")
    occupancies, cells = (Payloads(file.sections[name]) for name in ("POCC", "PCEL"))
    objects = []
    for number, fields in enumerate(records):
        place = f"proof {number}"
        levels, mixed, surface, parts, forms = fields[7:12]
        check_forms(forms, place)
        grid = Grid(place, fields[0:3], fields[3], fields[4:7], levels, mixed, surface, parts, forms)
        objects.append(Proof(read_cells(grid, occupancies.take(*fields[12:14], place), cells.take(*fields[14:16], place))))
    occupancies.finish()
    cells.finish()
    return objects
