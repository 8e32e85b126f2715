// A row of voxels in which every other one is open: rays along it have more open cells than kernels have room
// for.
#pragma once

#include <nif/nif.h>

#include <cmath>
#include <vector>

#include "tests/support/random_asset.hpp"

namespace nif::test {

/// The network is random.
inline format::Asset asset_of_a_row(uint64_t seed) {
  format::Asset asset = random_asset(seed, {.objects = 1, .instances = 0, .features = 2});
  format::PlanesData& row = *asset.objects[0].planes;
  format::NetworkData& network = *asset.objects[0].network;
  row.voxels = {kernels::kMaxVoxels, 1, 1};
  row.levels = 0;
  row.brick_table.clear();
  // Surface and unknown voxels alternate, without features.
  const uint32_t bricks = kernels::kMaxVoxels / kernels::kBrickSide;
  for (uint32_t b = 0; b < bricks; ++b) row.brick_table.push_back(uint16_t(kernels::kFirstMixedBrick + b));
  row.brick_table.push_back(kernels::kBrickOutside);
  row.brick_states.assign(bricks, {0b1111, 0b1010});
  network.brick_corners.assign(bricks, 0);
  network.corner_base.assign(bricks, 0);
  network.corners = 0;
  network.features.clear();
  format::leave_bare(row);
  return asset;
}

/// From anywhere in the row to its end, or only a few voxels long.
inline std::vector<NifRay> rays_in_a_row(Random& random, const kernels::PlanesField& field, size_t count) {
  std::vector<NifRay> rays(count);
  for (NifRay& ray : rays) {
    const bool up = random.below(2), is_long = random.below(2);
    const float x = random.unit() * float(field.voxels[0]), side = up ? 1.0f : -1.0f;
    ray = {{field.origin[0] + x / field.voxels_per_unit, field.origin[1] + 0.5f / field.voxels_per_unit,
            field.origin[2] + 0.5f / field.voxels_per_unit},
           0,
           {side, random.between(-1e-3f, 1e-3f), 0},
           INFINITY};
    if (!is_long) ray.tmax = float(random.below(20)) / field.voxels_per_unit;
  }
  return rays;
}

}  // namespace nif::test
