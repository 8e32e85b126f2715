// The occupancy of a field as the SIMD walk reads it: four bits a voxel that say what it is and how far a
// segment may leap from it.
//
// Built when an asset is loaded. A leap of distance d ends where the segment leaves the cube of voxels less
// than d away (Chebyshev), all of which have the voxel's own state. So nothing is missed, and the crossing at
// which the leap ends is one that the reference comes to as well.
//
// With one table the cube lies around the voxel. With two there is one for segments that go up along an axis,
// where the cube's lower half is left out, and one for those that go down: leaps away from a surface are
// longer, for twice the memory.
#pragma once

#include <cstdint>
#include <memory_resource>
#include <vector>

#include "kernels/field.hpp"

namespace nif::kernels::cpu {

/// What a code's voxel is; unknown is none of these.
enum VoxelClass : int32_t { kSurfaceBit = 1, kOutsideBit = 2, kInsideBit = 4 };

/// The sixteen codes: state and distance, rounded down to the next that there is.
alignas(64) inline constexpr int32_t kCodeClass[16] = {kSurfaceBit, 2, 2, 2, 2, 2, 2, 2,
                                                       2,           2, 4, 4, 4, 4, 0, 0};
alignas(64) inline constexpr float kCodeDistance[16] = {1, 1, 2, 3, 4, 5, 6, 8, 11, 15, 1, 2, 3, 5, 1, 3};

struct WalkGrid {
  /// Whether voxels can be numbered at all: that is done in single precision, exact up to 2^24.
  static bool can_hold(const SegmentField& field, uint32_t tables = 1);
  /// What a grid with so many tables holds in memory.
  static size_t bytes_of(const SegmentField& field, uint32_t tables);

  /// The grid must be able to hold the field with so many tables, 1 or 2.
  WalkGrid(const SegmentField& field, uint32_t tables, std::pmr::memory_resource* memory);

  /// Voxels are numbered brick by brick, so that neighbours share a cache line: n = sum over the axes of
  /// stride[a] (v + beyond[a] floor(v / 4)), whole numbers all of them. Voxel n's code stands in bits 4 (n %
  /// 8) of word n / 8. In the second table its number is higher by `second`.
  std::pmr::vector<uint32_t> codes;
  static constexpr float stride[3] = {1, 4, 16};
  float beyond[3];
  uint32_t bricks[3];  ///< along each axis
  uint32_t axis;       ///< segments that go down along it have a table of their own: the shortest axis
  uint32_t second;     ///< 0 where there is one table

  /// The code of one voxel.
  uint32_t code_at(uint32_t x, uint32_t y, uint32_t z) const {
    const size_t brick = (x >> 2) + bricks[0] * (size_t(y >> 2) + bricks[1] * size_t(z >> 2));
    const uint32_t local = (x & 3) + 4 * (y & 3) + 16 * (z & 3);
    return codes[8 * brick + local / 8] >> (4 * (local % 8)) & 15;
  }

  size_t resident_bytes() const { return codes.capacity() * sizeof(codes[0]); }

 private:
  void put(uint32_t number, uint8_t voxel);
};

}  // namespace nif::kernels::cpu
