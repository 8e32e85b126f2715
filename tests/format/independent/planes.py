"""The planes of objects (docs/format.md, "Planes, 80 bytes")."""

from cells import Cells
from container import Payloads, require
from grid import CODED_CELLS, CODED_KINDS, CODED_OCCUPANCY, Grid, Occupancy, check_coding


def read(file):
    occupancies, cells = (Payloads(file.sections[name]) for name in ("OCCU", "CELL"))
    planes = []
    for number, fields in enumerate(file.records("planes", "4f3I5I4Q")):
        place = f"planes {number}"
        levels, mixed, surface, parts, forms = fields[7:12]
        require(not forms & ~(CODED_OCCUPANCY | CODED_CELLS | CODED_KINDS), place, f"forms is {forms}")
        grid = Grid(place, fields[0:3], fields[3], fields[4:7], levels, mixed, surface, parts, forms)
        occupancy, words = occupancies.take(*fields[12:14], place), cells.take(*fields[14:16], place)
        in_file = check_coding(
            place,
            [
                (occupancy, grid.occupancy_size(), forms & CODED_OCCUPANCY),
                (words, grid.cells_size(), forms & CODED_CELLS),
            ],
        )
        if forms & (CODED_OCCUPANCY | CODED_CELLS):
            require(grid.brick_count <= in_file // 2, place, "more bricks than coded payloads may have")
        planes.append(Cells(grid, Occupancy(grid, occupancy), words))
    occupancies.finish()
    cells.finish()
    return planes
