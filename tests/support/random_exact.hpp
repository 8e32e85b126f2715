// An `exact` object without the baker: triangles in a slab, and a grid whose planes are those of the slab.
#pragma once

#include "formats/nif/exact/encoding.hpp"
#include "kernels/reference/proof/cells.hpp"
#include "tests/support/random_bvh.hpp"

namespace nif::test {

/// A grid of cubes of unit size around z = 0, whose surface voxels are a layer at most two thick. `wall`: a
/// sheet across all of the grid makes every cell of the layer a wall.
inline format::ExactData random_exact(Random& random, uint32_t max_voxels) {
  format::ExactData exact;
  format::ProofData& grid = exact.proof;
  const uint32_t across = 2 + random.below(max_voxels), high = 3 + random.below(max_voxels);
  grid.voxels = {across, across, high};
  grid.voxels_per_unit = 1;
  const uint32_t layer = random.below(high);
  // Voxel `layer` is from z = -1/2 to 1/2.
  const auto half = static_cast<float>(across) / 2;
  grid.origin = {-half, -half, -0.5f - static_cast<float>(layer)};

  // Triangles from z = -1/8 to 1/8.
  const bool wall = random.below(2) == 0;
  Soup soup = random_soup(random, 1 + random.below(60));
  for (std::array<float, 3>& p : soup.positions) p = {p[0] * half, p[1] * half, p[2] / 8};
  if (wall) {
    const auto first = uint32_t(soup.positions.size());
    for (const float y : {-half - 2, half + 2})
      for (const float x : {-half - 2, half + 2})
        soup.positions.push_back({x, y, random.between(-0.1f, 0.1f)});
    soup.triangles.push_back({first, first + 1, first + 3});
    soup.triangles.push_back({first, first + 3, first + 2});
  }
  exact.bvh = RandomTree(soup).pack(random);

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
  const float step = kernels::plane_step(1);
  const auto reach = uint32_t(std::ceil((0.125f * kernels::kNormalSum + 1) / step));
  for (uint32_t& word : grid.voxel_records) {
    if (random.below(8) == 0) continue;
    const bool sides = random.below(8) != 0;
    word = kernels::make_planes(kernels::kind_of({sides ? uint32_t{kernels::kSeenOutside} : 0u,
                                                  sides ? uint32_t{kernels::kSeenOutside} : 0u, wall}),
                                kernels::kNormalHalf, kernels::kNormalHalf, kernels::kPlanePlaces / 2 - reach,
                                kernels::kPlanePlaces / 2 + reach);
  }
  return exact;
}

}  // namespace nif::test
