// The features of a field's corners as fast kernels look them up: a voxel's eight in one brick.
//
// In the file each corner stands once, in the brick that it is the low end of a voxel of; here a brick has
// the corners of all its voxels, 5 x 5 x 5 of them, those at its far ends too. A voxel then needs one look-up
// in place of up to eight. kernels/packed/feature_grid makes them; the CPU's kernels and the GPU's read them.
#pragma once

#include <cstdint>

#include "kernels/reference/host_device.hpp"

namespace nif::kernels {

/// The corners of one brick of voxels that have features, in order of z, y, x.
struct CornerBrick {
  uint32_t first;  ///< feature pair of its first corner
  uint32_t
      layer[5];  ///< of each z: bit x + 5 y where there is a corner; from bit 25, how many there are below
};

/// A field's, which has two features a corner.
struct CornerBricks {
  const uint32_t* table = nullptr;      ///< as FeatureGrid::table
  const CornerBrick* bricks = nullptr;  ///< those with surface voxels; before them, one without corners
  const uint16_t* pairs = nullptr;      ///< both features of each corner, and two more
  uint32_t brick_count = 0, pair_count = 0;
};

}  // namespace nif::kernels
