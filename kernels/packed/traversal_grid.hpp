// The occupancy and the cells of a field in the layout of kernels with empty-space skipping
// (kernels/packed/traversal_words.hpp), built when an asset is loaded.
#pragma once

#include <cstdint>
#include <limits>
#include <memory_resource>
#include <vector>

#include "kernels/packed/traversal_words.hpp"
#include "kernels/reference/planes/planes_field.hpp"

namespace nif::kernels::cpu {

/// Maximum size in bytes of one word per voxel: half of the second-level cache of many processors. With
/// bricks, words take as little as a sixth of the bytes, and rays up to a quarter longer; the larger the grid
/// the less so, and not at all from some 6 MB on (docs/results/cpu-kernels.md).
inline constexpr size_t kMostWithoutBricks = 512 * 1024;
/// Whether bricks may be used: on a web page their code is too much to download.
#ifdef __wasm__
inline constexpr bool kWithBricks = false;
#else
inline constexpr bool kWithBricks = true;
#endif

struct VoxelWords;

struct TraversalGrid {
  /// Uses bricks only if words for all voxels would take more than this many bytes, and bricks take fewer.
  TraversalGrid(const PlanesField& field, std::pmr::memory_resource* memory,
                size_t most_without_bricks = std::numeric_limits<size_t>::max());

  /// Bricks have 2^brick_levels voxels along each axis: what takes the fewest bytes, or one.
  uint32_t brick_levels = 0;
  uint32_t size[3];                   ///< bricks along each axis
  std::pmr::vector<uint32_t> bricks;  ///< [z][y][x]; empty if a brick is one voxel
  std::pmr::vector<uint32_t> voxels;  ///< [z][y][x], of the grid, or of each brick whose voxels are not alike
  std::pmr::vector<uint32_t> children;  ///< as PlanesField::children

  /// Requires that there are no bricks.
  TraversalWords view() const { return {voxels.data(), children.data()}; }
  /// What leads to a voxel's word: the words of bricks, or of voxels if there are no bricks.
  const std::pmr::vector<uint32_t>& top() const { return has_bricks() ? bricks : voxels; }
  bool has_bricks() const { return kWithBricks && brick_levels > 0; }
  /// The word of a voxel, or of its brick if all voxels there are alike.
  uint32_t word_at(const int32_t (&voxel)[3]) const;
  size_t resident_bytes() const {
    return (bricks.capacity() + voxels.capacity() + children.capacity()) * sizeof(uint32_t);
  }

 private:
  void fill_bricks(const VoxelWords& all, size_t words);
  void add_boxes(const uint32_t (&voxel_count)[3], std::pmr::memory_resource* memory);
};

/// Bytes of a field's words, without building them. Reads only the field's occupancy and child_count.
size_t traversal_bytes(const PlanesField& field);

}  // namespace nif::kernels::cpu
