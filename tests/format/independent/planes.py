"""The planes of objects (docs/format.md, "Planes")."""

from cells import Cells
from grid import CODED_CELLS, CODED_KINDS, CODED_OCCUPANCY, Grid, Occupancy, check_coding
from shell import PAYLOAD, require

LAYOUT = "4f3I5I" + 2 * PAYLOAD


def read(item, fields, payloads):
    place = f"{item.place}: planes"
    levels, mixed, surface, parts, forms = fields[7:12]
    require(not forms & ~(CODED_OCCUPANCY | CODED_CELLS | CODED_KINDS), place, f"forms is {forms}")
    grid = Grid(place, fields[0:3], fields[3], fields[4:7], levels, mixed, surface, parts, forms)
    occupancy, words = payloads.take(fields[12:16], place), payloads.take(fields[16:20], place)
    in_file = check_coding(
        place,
        [
            (occupancy, grid.occupancy_size(), forms & CODED_OCCUPANCY),
            (words, grid.cells_size(), forms & CODED_CELLS),
        ],
    )
    if forms & (CODED_OCCUPANCY | CODED_CELLS):
        require(grid.brick_count <= in_file // 2, place, "more bricks than coded payloads may have")
    return Cells(grid, Occupancy(grid, occupancy), words)
