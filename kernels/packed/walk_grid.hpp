// The occupancy of a field as kernels that leap read it (kernels/packed/walk_codes.hpp), built when an asset
// is loaded.
//
// With one table the cube of a leap lies around the voxel. With two there is one for segments that go up
// along an axis, where the cube's lower half is left out, and one for those that go down: leaps away from a
// surface are longer, for twice the memory.
#pragma once

#include <cstdint>
#include <memory_resource>
#include <vector>

#include "kernels/packed/walk_codes.hpp"
#include "kernels/reference/segment/field.hpp"

namespace nif::kernels::cpu {

struct WalkGrid {
  /// Whether voxels can be numbered at all: that is done in single precision, exact up to 2^24.
  static bool can_hold(const SegmentField& field, uint32_t tables = 1);
  /// What a grid with so many tables holds in memory.
  static size_t bytes_of(const SegmentField& field, uint32_t tables);
  /// Tables for kernels that number voxels otherwise and are to have them all: 2 where they can be held, or
  /// 1, or 0.
  static uint32_t most_tables(const SegmentField& field);

  /// The grid must be able to hold the field with so many tables, 1 or 2. With 0 there is one, for a field of
  /// any size, which is made quickly and whose distances are all 1.
  WalkGrid(const SegmentField& field, uint32_t tables, std::pmr::memory_resource* memory);

  /// Voxel n's code stands in bits 4 (n % 8) of word n / 8, where n is code_number(), or the sum over the
  /// axes of stride[a] (v + beyond[a] floor(v / 4)), whole numbers all of them. In the second table n is
  /// higher by `second`.
  std::pmr::vector<uint32_t> codes;
  static constexpr float stride[3] = {1, 4, 16};
  float beyond[3];
  uint32_t bricks[3];  ///< along each axis
  uint32_t axis;       ///< segments that go down along it have a table of their own: the shortest axis
  uint32_t second;     ///< 0 where there is one table

  /// The code of one voxel.
  uint32_t code_at(uint32_t x, uint32_t y, uint32_t z) const {
    return code_in(codes.data(), code_number(x, y, z, bricks[0], bricks[0] * bricks[1]));
  }
  WalkCodes view() const { return {codes.data(), axis, second}; }

  size_t resident_bytes() const { return codes.capacity() * sizeof(codes[0]); }

 private:
  /// A byte for each voxel: its state, and this distance.
  static void classify(const SegmentField& field, uint8_t distance, std::pmr::vector<uint8_t>& voxels);
  /// Shortens the distances by what lies on one side, -1 or 1, along the axis. The two one after the other
  /// give the distance to what is nearest on both: a shortest way to it never has to turn back.
  void sweep(const uint32_t (&size)[3], std::pmr::vector<uint8_t>& voxels, int32_t side) const;
  void put(uint32_t number, uint8_t voxel);
};

}  // namespace nif::kernels::cpu
