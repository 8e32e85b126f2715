// What the kernels that leap over voxels read: a word for each voxel. In a surface voxel it is the record of
// the field (kernels/reference/proof/cells.hpp). In any other it says what the voxel is, and a box around
// it in which all voxels are alike: a leap ends where the segment leaves that box. So nothing is missed, and
// the crossing at which the leap ends is one that the reference comes to as well. kernels/packed/walk_grid
// makes them; the CPU's kernels and the GPU's read them.
#pragma once

#include <cstdint>

#include "kernels/reference/proof/cells.hpp"

namespace nif::kernels {

/// Voxels by which a box reaches beyond its own voxel on one side, at most.
inline constexpr uint32_t kMaxExtent = 15;

/// Of a box: for each axis how far it reaches down, then up.
constexpr uint32_t make_boxed(uint32_t side, const uint32_t (&extents)[6]) {
  uint32_t word = make_empty(side);
  for (uint32_t k = 0; k < 6; ++k) word |= extents[k] << (8 + 4 * k);
  return word;
}
/// `up`: 1 for the side to which coordinates grow, or 0.
NIF_HOST_DEVICE constexpr uint32_t extent_of(uint32_t word, uint32_t axis, uint32_t up) {
  return word >> (8 + 8 * axis + 4 * up) & 15;
}

/// More than the walk's rounding in finest cells (docs/encodings/segment.md: 0.0063 for the crossing and as
/// much for the place), less than a cell by far: an estimate of where a segment is that is this much too low
/// is right, or one cell short.
inline constexpr float kEstimateSlack = 1.0f / 32;

/// A field's words.
struct WalkWords {
  const uint32_t* voxels = nullptr;  ///< [voxels z][y][x]
  const uint32_t* parts = nullptr;   ///< as ProofField::parts
};

}  // namespace nif::kernels
