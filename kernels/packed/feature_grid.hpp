// Builds the corner bricks of kernels/packed/corner_bricks.hpp, when an asset is loaded or copied to a GPU.
#pragma once

#include <bit>
#include <cstdint>
#include <memory_resource>
#include <vector>

#include "kernels/packed/corner_bricks.hpp"
#include "kernels/reference/network/network_field.hpp"

namespace nif::kernels::cpu {

struct FeatureGrid {
  /// Empty unless the field has two features per corner.
  FeatureGrid(const SegmentField& field, std::pmr::memory_resource* memory);

  /// Both features of a corner; 0 if no surface voxel touches it.
  uint16_t pair_at(uint32_t x, uint32_t y, uint32_t z) const;

  /// One entry per 16 bricks of voxels, in order of z, y, x: bit k is set if brick k has surface voxels; from
  /// bit 16, the number of such bricks before these.
  std::pmr::vector<uint32_t> table;
  std::pmr::vector<CornerBrick> bricks;  ///< those with surface voxels; before them, one without corners
  std::pmr::vector<uint16_t> pairs;      ///< both features of each corner, and two more
  uint32_t size[3];                      ///< bricks along each axis

  /// Whether it has every corner of the field with features: it lacks corners that no surface voxel touches,
  /// and is empty unless there are two features per corner.
  bool complete;

  /// [pairs]: each pair, and the next one in the upper half, as GPUs read them.
  std::vector<uint32_t> next_pairs() const;

  /// Requires a complete grid.
  CornerBricks view() const {
    return {table.data(), bricks.data(), pairs.data(), uint32_t(bricks.size()), uint32_t(pairs.size())};
  }

  size_t resident_bytes() const {
    return table.capacity() * sizeof(table[0]) + bricks.capacity() * sizeof(bricks[0]) +
           pairs.capacity() * sizeof(pairs[0]);
  }

  /// Index in `bricks` of the brick with the given number.
  uint32_t index_of(size_t number) const {
    const uint32_t word = table[number / 16], bit = 1u << (number % 16);
    return word & bit ? 1 + (word >> 16) + uint32_t(std::popcount(word & (bit - 1))) : 0;
  }

 private:
  const uint16_t* find(uint32_t x, uint32_t y, uint32_t z) const;
};

}  // namespace nif::kernels::cpu
