// Makes an `exact` object without the baker: triangles in a slab, and a grid whose planes are those of the
// slab.
#pragma once

#include <bit>
#include <cmath>

#include "formats/nif/parts.hpp"
#include "kernels/reference/planes/grid_traversal.hpp"
#include "tests/support/random_bvh.hpp"

namespace nif::test {

struct RandomExact {
  format::PlanesData planes;
  format::TrianglesData triangles;

  kernels::ExactField field() const { return {format::field_of(planes), format::field_of(triangles)}; }
};

/// A grid of cubes of unit size around z = 0, whose surface voxels are one layer. A sheet across the
/// layer, if there is one, makes all but its outermost cells walls.
inline RandomExact random_exact(Random& random, uint32_t max_voxels) {
  RandomExact exact;
  format::PlanesData& grid = exact.planes;
  const uint32_t across = 3 + random.below(max_voxels), high = 3 + random.below(max_voxels);
  grid.voxels = {across, across, high};
  grid.voxels_per_unit = 1;
  const uint32_t layer = random.below(high);
  // Voxel `layer` is from z = -1/2 to 1/2.
  const auto half = static_cast<float>(across) / 2;
  grid.origin = {-half, -half, -0.5f - static_cast<float>(layer)};

  // Triangles from z = -1/8 to 1/8.
  const bool wall = random.below(2) == 0;
  Soup soup = random_soup(random, 1 + random.below(60));
  for (std::array<float, 3>& p : soup.positions) p = {p[0] * (half - 0.25f), p[1] * (half - 0.25f), p[2] / 8};
  if (wall) {
    const auto first = uint32_t(soup.positions.size());
    for (const float y : {-half + 0.5f, half - 0.5f})
      for (const float x : {-half + 0.5f, half - 0.5f})
        soup.positions.push_back({x, y, random.between(-0.1f, 0.1f)});
    soup.triangles.push_back({first, first + 1, first + 3});
    soup.triangles.push_back({first, first + 3, first + 2});
  }
  exact.triangles = RandomTree(soup).pack(random);

  const uint32_t bricks[3] = {format::bricks_for(across), format::bricks_for(across),
                              format::bricks_for(high)};
  for (uint32_t b = 0; b < bricks[0] * bricks[1] * bricks[2]; ++b) {
    const uint32_t low[3] = {b % bricks[0] * 4, b / bricks[0] % bricks[1] * 4, b / bricks[0] / bricks[1] * 4};
    kernels::BrickStates states{};
    for (uint32_t bit = 0; bit < 64; ++bit)
      if (low[0] + (bit & 3) < across && low[1] + (bit >> 2 & 3) < across && low[2] + (bit >> 4) == layer)
        states.surface |= uint64_t{1} << bit;
    if (states.surface == 0) {
      grid.brick_table.push_back(kernels::kBrickOutside);
      continue;
    }
    grid.brick_table.push_back(uint16_t(kernels::kFirstMixedBrick + grid.brick_states.size()));
    grid.brick_states.push_back(states);
  }
  format::leave_bare(grid);
  // The normal along z, with room for the margin of heights.
  const auto reach = uint32_t(std::ceil((0.125f * kernels::kNormalSum + 1) / kernels::plane_step(1)));
  const kernels::PlanesField field = format::field_of(grid);
  for (int32_t y = 0; y < int32_t(across); ++y)
    for (int32_t x = 0; x < int32_t(across); ++x) {
      if (random.below(8) == 0) continue;  // bare
      const uint32_t side = random.below(8) ? uint32_t{kernels::kSeenOutside} : 0u;
      const bool walled = wall && x > 0 && y > 0 && x + 1 < int32_t(across) && y + 1 < int32_t(across);
      const int32_t voxel[3] = {x, y, int32_t(layer)};
      const kernels::VoxelAddress at = kernels::voxel_address(field, voxel);
      const uint32_t brick = at.entry - kernels::kFirstMixedBrick;
      const uint64_t before = grid.brick_states[brick].surface & ((uint64_t{1} << at.bit) - 1);
      grid.voxel_records[grid.voxel_base[brick] + uint32_t(std::popcount(before))] = kernels::make_planes(
          kernels::kind_of({side, side, walled}), kernels::kNormalHalf, kernels::kNormalHalf,
          kernels::kPlaneOffsets / 2 - reach, kernels::kPlaneOffsets / 2 + reach);
    }
  return exact;
}

}  // namespace nif::test
