// Looks around a cell. See cell_neighbours.hpp.
#include "formats/nif/planes/cell_neighbours.hpp"

#include <algorithm>
#include <bit>
#include <cstdlib>

#include "formats/nif/planes/check_planes.hpp"

namespace nif::format {
namespace {

/// Does a point of the cube's face lie between the planes of the cell beyond it, or on one of them? That cell
/// is no smaller than the cube, and its planes count as unbounded.
bool planes_meet_face(const FoundCell& found, const CellCube& cube, size_t axis, bool above) {
  const CellVector normal = found.normal();
  int64_t height = 0, reach = 0;  // twice the height of the face's middle, and how much its points differ
  for (size_t a = 0; a < 3; ++a) {
    int32_t from = 2 * (cube.low[a] - found.low[a]) + cube.side - found.side;
    if (a == axis)
      from += above ? cube.side : -cube.side;
    else
      reach += std::abs(normal[a]) * cube.side;
    height += normal[a] * from;
  }
  const int64_t unit = offset_unit(found.side);
  return 64 * (height + reach) >= (found.lower() - 128) * unit &&
         64 * (height - reach) <= (found.upper() - 128) * unit;
}

}  // namespace

Neighbours neighbours_of(const KnownCells& cells, const CellCube& cell) {
  Neighbours neighbours;
  for (size_t face = 0; face < 6; ++face) {
    CellVector at = cell.place();
    at[face / 2] += face % 2 ? cell.side : -cell.side;
    const FoundCell& found = neighbours.faces[face] = cells.look(at, cell.side);
    neighbours.cut += found.is_cut();
    if (!found.has_planes()) continue;
    ++(separates(kernels::word_kind(found.word)) ? neighbours.separating : neighbours.passable);
    const int32_t distance = (found.upper() - found.lower()) * offset_unit(found.side) / 128;
    neighbours.thickest = std::max(neighbours.thickest, uint32_t(std::bit_width(uint32_t(distance))));
  }
  return neighbours;
}

uint32_t surface_beyond(const KnownCells& cells, const CellCube& cell, uint32_t octant) {
  const CellCube cube = cell.child(octant);
  uint32_t sure = 0;
  for (size_t a = 0; a < 3; ++a) {
    const bool above = octant >> a & 1;
    CellVector at = cube.place();
    at[a] += above ? cube.side : -cube.side;
    const FoundCell found = cells.look(at, cube.side);
    if (found.is_unknown())
      sure += found.side == cube.side ? 2 : 1;
    else if (found.has_planes() && planes_meet_face(found, cube, a, above))
      sure += 2;
  }
  return sure;
}

}  // namespace nif::format
