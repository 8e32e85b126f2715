// The features of a field's corners as the SIMD network gathers them: a voxel's eight in one brick.
//
// Built when an asset is loaded. In the file each corner stands once, in the brick that it is the low end of
// a voxel of; here a brick has the corners of all its voxels, 5 x 5 x 5 of them, those at its far ends too. A
// voxel then needs one look-up in place of up to eight.
#pragma once

#include <bit>
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

  /// Both features of a corner; 0 where no surface voxel touches it.
  uint16_t pair_at(uint32_t x, uint32_t y, uint32_t z) const;

  /// [16 bricks, of voxels, in order of z, y, x]: bit k where brick k has surface voxels; from bit 16, how
  /// many have before these.
  std::pmr::vector<uint32_t> table;
  std::pmr::vector<CornerBrick> bricks;  ///< those with surface voxels; before them, one without corners
  std::pmr::vector<uint16_t> pairs;      ///< both features of each corner, and two more
  uint32_t size[3];                      ///< bricks along each axis

  /// Whether every corner of the field that has features is here: corners that no surface voxel touches are
  /// not, nor is anything where there are not two features a corner.
  bool complete;

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
