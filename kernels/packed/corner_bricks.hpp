// Stores the features of a field's corners so that kernels find them fast: all eight of a voxel in one brick.
//
// In the file each corner is stored once, in the brick whose voxel it is the low end of. Here a brick has the
// corners of all its voxels, 5 x 5 x 5, including those at the far ends. A voxel then needs one look-up
// instead of up to eight. kernels/packed/feature_grid builds them; the CPU's kernels and the GPU's read them.
#pragma once

#include <cstdint>

#include "kernels/reference/host_device.hpp"

namespace nif::kernels {

/// The corners of one brick of voxels that have features, in order of z, y, x.
struct CornerBrick {
  uint32_t first;     ///< feature pair of its first corner
  uint32_t layer[5];  ///< for each z: bit x + 5 y if there is a corner; from bit 25, how many there are below
};

/// The corner bricks of a field with two features per corner.
struct CornerBricks {
  const uint32_t* table = nullptr;      ///< as FeatureGrid::table
  const CornerBrick* bricks = nullptr;  ///< those with surface voxels; before them, one without corners
  const uint16_t* pairs = nullptr;      ///< both features of each corner, and two more
  uint32_t brick_count = 0, pair_count = 0;
};

}  // namespace nif::kernels
