// What the kernels that leap over voxels read: a word for each voxel. In a surface voxel it is the record of
// the field (kernels/reference/planes/cells.hpp). In any other it says what the voxel is, and a box around it
// in which all voxels are alike: a leap ends where the segment leaves that box. So nothing is missed, and the
// crossing at which the leap ends is one that the reference comes to as well.
//
// In large grids CPUs read a word for each brick of voxels instead and, where these are not alike, one for
// each of them. The word of a brick whose voxels are alike has a box around the brick.
// kernels/packed/walk_grid makes all of them.
#pragma once

#include <cstdint>

#include "kernels/reference/planes/cells.hpp"

namespace nif::kernels {

/// Voxels by which a box reaches beyond its own voxel or brick on one side, at most.
inline constexpr uint32_t kMaxExtent = 15;

/// The bit of an empty word that says that it is a brick's, and those by which such a word is known.
inline constexpr uint32_t kBrickBit = 1 << 6, kBrickMask = kBrickBit | 15;
NIF_HOST_DEVICE constexpr bool is_brick(uint32_t word) {
  return (word & kBrickMask) == (kBrickBit | kEmptyVoxel);
}

/// Of a brick whose voxels are not alike, a word of kind kLink: where the first of their words is.
constexpr uint32_t make_voxels(uint32_t first) { return kLink | first << 4; }
NIF_HOST_DEVICE constexpr uint32_t voxels_first(uint32_t word) { return word >> 4; }

/// An empty word with a box: for each axis how far it reaches down, then up.
constexpr uint32_t make_boxed(uint32_t empty, const uint32_t (&extents)[6]) {
  for (uint32_t k = 0; k < 6; ++k) empty |= extents[k] << (8 + 4 * k);
  return empty;
}
/// `up`: 1 for the side to which coordinates grow, or 0.
NIF_HOST_DEVICE constexpr uint32_t extent_of(uint32_t word, uint32_t axis, uint32_t up) {
  return word >> (8 + 8 * axis + 4 * up) & 15;
}

/// More than the walk's rounding in finest cells (docs/encodings/segment.md: 0.0063 for the crossing and as
/// much for the place), less than a cell by far: an estimate of where a segment is that is this much too low
/// is right, or one cell short.
inline constexpr float kEstimateSlack = 1.0f / 32;

/// Bricks of 2^brick_levels voxels along an axis that so many voxels need.
constexpr uint32_t walk_bricks(uint32_t voxels, uint32_t brick_levels) {
  return (voxels + (1u << brick_levels) - 1) >> brick_levels;
}

/// A field's words, one for each voxel.
struct WalkWords {
  const uint32_t* voxels = nullptr;  ///< [voxels z][y][x]
  const uint32_t* parts = nullptr;   ///< as PlanesField::parts
};

}  // namespace nif::kernels
