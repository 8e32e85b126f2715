// The occupancy and the cells of a field as kernels that leap read them (kernels/packed/walk_words.hpp),
// built when an asset is loaded.
#pragma once

#include <cstdint>
#include <memory_resource>
#include <vector>

#include "kernels/packed/walk_words.hpp"
#include "kernels/reference/proof/field.hpp"

namespace nif::kernels::cpu {

/// Bytes that a word for each voxel may take: half of the second cache of many processors. A brick's word and
/// then a voxel's take up to a fifth longer to read than that, and half to a sixth of its bytes. Where a word
/// for each voxel does not fit the caches, bricks are faster as well (docs/results/cpu-kernels.md).
inline constexpr size_t kMostWithoutBricks = 512 * 1024;

struct WalkGrid {
  WalkGrid(const ProofField& field, std::pmr::memory_resource* memory,
           size_t most_without_bricks = kMostWithoutBricks);

  // As WalkWords has them. Bricks are of the size that takes fewest bytes, or of one voxel where that takes
  // few enough.
  std::pmr::vector<uint32_t> bricks, voxels, parts;
  uint32_t brick_levels = 0;
  uint32_t size[3];  ///< bricks along each axis

  WalkWords view() const { return {bricks.data(), voxels.data(), parts.data(), brick_levels}; }
  /// The word of a voxel, or of its brick where all of that are alike.
  uint32_t word_at(const int32_t (&voxel)[3]) const;
  size_t resident_bytes() const {
    return (bricks.capacity() + voxels.capacity() + parts.capacity()) * sizeof(uint32_t);
  }
};

/// What a field's words take, without making them. Of the field only occupancy and part_count are read.
size_t walk_bytes(const ProofField& field);

}  // namespace nif::kernels::cpu
