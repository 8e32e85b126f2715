// Places voxels and children, and finds what is known at a place. See known_cells.hpp.
#include "formats/nif/planes/known_cells.hpp"

#include <algorithm>
#include <bit>

namespace nif::format {

CellCube CellCube::child(uint32_t k) const {
  CellCube half{low, int16_t(side / 2)};
  for (size_t a = 0; a < 3; ++a)
    if (k >> a & 1) half.low[a] = int16_t(low[a] + half.side);
  return half;
}

CellVector FoundCell::normal() const {
  const kernels::CellNormal normal = kernels::cell_normal(word);
  return {normal.x, normal.y, normal.z};
}

KnownCells::KnownCells(const kernels::PlanesField& grid, uint32_t* words) : grid_(grid), words_(words) {
  std::fill_n(words, count(), kUnknownWord);
  grid_.voxel_records = words;
  grid_.children = words + grid.surface_voxels;
  cells_.reserve(count());
  const auto side = int16_t(1 << grid.levels);
  const uint16_t* entry = grid.brick_table;
  for (uint32_t z = 0; z < grid.bricks[2]; ++z)
    for (uint32_t y = 0; y < grid.bricks[1]; ++y)
      for (uint32_t x = 0; x < grid.bricks[0]; ++x, ++entry) {
        if (*entry < kernels::kFirstMixedBrick) continue;
        const kernels::BrickStates& states = grid.brick_states[*entry - kernels::kFirstMixedBrick];
        for (uint64_t left = states.surface & ~states.aux; left != 0; left &= left - 1) {
          const uint32_t bit = uint32_t(std::countr_zero(left));
          cells_.push_back(
              {{int16_t((4 * x + (bit & 3)) << grid.levels), int16_t((4 * y + (bit >> 2 & 3)) << grid.levels),
                int16_t((4 * z + (bit >> 4)) << grid.levels)},
               side});
        }
      }
}

uint32_t KnownCells::level(const CellCube& cell) const {
  return grid_.levels + 1 - uint32_t(std::bit_width(uint32_t(cell.side)));
}

FoundCell KnownCells::look(const CellVector& at, int32_t side) const {
  FoundCell found;
  int32_t voxel[3];
  for (size_t a = 0; a < 3; ++a) {
    voxel[a] = at[a] >> grid_.levels;
    if (at[a] < 0 || voxel[a] >= int32_t(grid_.voxels[a])) return found;
  }
  found.word = kernels::voxel_word(grid_, voxel);
  found.side = 1 << grid_.levels;
  while (found.is_cut() && found.side > side) {
    found.side >>= 1;
    uint32_t octant = 0;
    for (size_t a = 0; a < 3; ++a) octant |= (at[a] & found.side) != 0 ? 1u << a : 0u;
    const bool exists = kernels::link_mask(found.word) >> octant & 1;
    found.word = exists ? grid_.children[kernels::link_child(found.word, octant)] : kernels::kEmptyChild;
  }
  if (found.has_planes())  // others are not asked where they are
    for (size_t a = 0; a < 3; ++a) found.low[a] = at[a] & ~(found.side - 1);
  return found;
}

bool KnownCells::cut(uint32_t i, uint32_t mask) {
  const auto children = uint32_t(std::popcount(mask));
  if (children == 0 || children > count() - named()) return false;
  words_[i] = kernels::make_link(mask, named() - grid_.surface_voxels);
  for (uint32_t k = 0; k < 8; ++k)
    if (mask >> k & 1) cells_.push_back(cells_[i].child(k));
  return true;
}

}  // namespace nif::format
