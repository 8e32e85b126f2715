// Defines what kernels with empty-space skipping read: a word for each voxel. For a surface voxel it is the
// field's record (kernels/reference/planes/cells.hpp). For any other voxel it gives the voxel's state and a
// box around it in which all voxels are alike: a skip ends where the segment leaves that box. So nothing is
// missed, and the crossing at which the skip ends is one that the reference reaches as well.
//
// In large grids CPUs read a word for each brick of voxels instead and, if those are not alike, one word for
// each voxel of the brick. The word of a brick whose voxels are alike has a box around the brick.
// kernels/packed/traversal_grid builds all words.
#pragma once

#include <cstdint>

#include "kernels/reference/planes/cells.hpp"

namespace nif::kernels {

/// How many voxels a box reaches beyond its voxel or brick on one side, at most.
inline constexpr uint32_t kMaxExtent = 15;

/// The bit of an empty word that marks it as a brick's, and the mask by which such a word is recognised.
inline constexpr uint32_t kBrickBit = 1 << 6, kBrickMask = kBrickBit | 15;
NIF_HOST_DEVICE constexpr bool is_brick(uint32_t word) {
  return (word & kBrickMask) == (kBrickBit | kEmptyVoxel);
}

/// For a brick whose voxels are not alike, a word of kind kLink: the index of their first word.
constexpr uint32_t make_voxels(uint32_t first) { return kLink | first << 4; }
NIF_HOST_DEVICE constexpr uint32_t voxels_first(uint32_t word) { return word >> 4; }

/// An empty word with a box: for each axis how far it reaches down, then up.
constexpr uint32_t make_boxed(uint32_t empty, const uint32_t (&extents)[6]) {
  for (uint32_t k = 0; k < 6; ++k) empty |= extents[k] << (8 + 4 * k);
  return empty;
}
/// `up`: 1 for the side towards larger coordinates, or 0.
NIF_HOST_DEVICE constexpr uint32_t extent_of(uint32_t word, uint32_t axis, uint32_t up) {
  return word >> (8 + 8 * axis + 4 * up) & 15;
}

/// More than the rounding of a traversal in finest cells (docs/encodings/segment.md: 0.0063 for the crossing
/// and as much for the position), and far less than a cell: an estimated position lowered by this much is
/// right, or one cell short.
inline constexpr float kEstimateSlack = 1.0f / 32;

/// Number of bricks of 2^brick_levels voxels that cover an axis of `voxels` voxels.
constexpr uint32_t traversal_bricks(uint32_t voxels, uint32_t brick_levels) {
  return (voxels + (1u << brick_levels) - 1) >> brick_levels;
}

/// A field's words, one per voxel.
struct TraversalWords {
  const uint32_t* voxels = nullptr;    ///< [voxels z][y][x]
  const uint32_t* children = nullptr;  ///< as PlanesField::children
};

}  // namespace nif::kernels
