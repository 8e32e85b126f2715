// The occupancy and the cells of a field as kernels that leap read them (kernels/packed/walk_words.hpp),
// built when an asset is loaded.
#pragma once

#include <cstdint>
#include <limits>
#include <memory_resource>
#include <vector>

#include "kernels/packed/walk_words.hpp"
#include "kernels/reference/planes/field.hpp"

namespace nif::kernels::cpu {

/// Bytes that a word for each voxel may take: half of the second cache of many processors. With bricks, words
/// take down to a sixth of the bytes, and rays up to a quarter longer: the less so the larger the grid, and
/// no longer at some 6 MB (docs/results/cpu-kernels.md).
inline constexpr size_t kMostWithoutBricks = 512 * 1024;
/// Whether there may be any: for a page their code is too much to download.
#ifdef __wasm__
inline constexpr bool kWithBricks = false;
#else
inline constexpr bool kWithBricks = true;
#endif

struct VoxelWords;

struct WalkGrid {
  /// Without bricks unless words for all voxels would take more than so many bytes, and bricks take less.
  WalkGrid(const PlanesField& field, std::pmr::memory_resource* memory,
           size_t most_without_bricks = std::numeric_limits<size_t>::max());

  /// Bricks have 2^brick_levels voxels along each axis: as many as takes fewest bytes, or one.
  uint32_t brick_levels = 0;
  uint32_t size[3];                   ///< bricks along each axis
  std::pmr::vector<uint32_t> bricks;  ///< [z][y][x]; none where a brick is one voxel
  std::pmr::vector<uint32_t> voxels;  ///< [z][y][x], of all or of each brick whose voxels are not alike
  std::pmr::vector<uint32_t> parts;   ///< as PlanesField::parts

  /// Where there are no bricks.
  WalkWords view() const { return {voxels.data(), parts.data()}; }
  /// What leads to a voxel's word: of bricks, or of voxels where there are none.
  const std::pmr::vector<uint32_t>& top() const { return has_bricks() ? bricks : voxels; }
  bool has_bricks() const { return kWithBricks && brick_levels > 0; }
  /// The word of a voxel, or of its brick where all of that are alike.
  uint32_t word_at(const int32_t (&voxel)[3]) const;
  size_t resident_bytes() const {
    return (bricks.capacity() + voxels.capacity() + parts.capacity()) * sizeof(uint32_t);
  }

 private:
  void fill_bricks(const VoxelWords& all, size_t words);
  void add_boxes(const uint32_t (&voxel_count)[3], std::pmr::memory_resource* memory);
};

/// What a field's words take, without making them. Of the field only occupancy and part_count are read.
size_t walk_bytes(const PlanesField& field);

}  // namespace nif::kernels::cpu
