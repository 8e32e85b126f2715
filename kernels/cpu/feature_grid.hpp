// The features of a field's corners as the SIMD network gathers them: a voxel's eight in one brick.
//
// Built when an asset is loaded. In the file each corner stands once, in the brick that it is the low end of
// a voxel of; here a brick has the corners of all its voxels, 5 x 5 x 5 of them, those at its far ends too. A
// voxel then needs one look-up in place of up to eight.
#pragma once

#include <cstdint>
#include <memory_resource>
#include <vector>

#include "kernels/field.hpp"

namespace nif::kernels::cpu {

/// The corners of one brick of voxels that have features, in order of z, y, x.
struct CornerBrick {
  uint32_t first;  ///< feature pair of its first corner
  uint32_t
      layer[5];  ///< of each z: bit x + 5 y where there is a corner; from bit 25, how many there are below
};

struct FeatureGrid {
  /// Empty unless the field has two features a corner.
  FeatureGrid(const SegmentField& field, std::pmr::memory_resource* memory);

  std::pmr::vector<uint16_t> table;  ///< [bricks z][y][x] of voxels: 1 + index in `bricks`, 0 where no voxel
                                     ///< is surface
  std::pmr::vector<CornerBrick> bricks;  ///< the first has no corners
  std::pmr::vector<uint16_t> pairs;      ///< both features of each corner, and one more
  uint32_t size[3];                      ///< bricks along each axis

  size_t resident_bytes() const {
    return table.capacity() * sizeof(table[0]) + bricks.capacity() * sizeof(bricks[0]) +
           pairs.capacity() * sizeof(pairs[0]);
  }
};

}  // namespace nif::kernels::cpu
