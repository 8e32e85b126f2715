// What the kernels that leap over voxels read: four bits a voxel that say what it is and how far a segment
// may leap from it. kernels/packed/walk_grid makes them; the CPU's kernels and the GPU's read them.
//
// A leap of distance d ends where the segment leaves the cube of voxels less than d away (Chebyshev), all of
// which have the voxel's own state. So nothing is missed, and the crossing at which the leap ends is one that
// the reference comes to as well.
#pragma once

#include <cstdint>

#include "kernels/reference/host_device.hpp"

namespace nif::kernels {

/// What a code's voxel is; unknown is none of these.
enum VoxelClass : int32_t { kSurfaceBit = 1, kOutsideBit = 2, kInsideBit = 4 };

/// The sixteen codes: state and distance, rounded down to the next that there is. Of a state they are in
/// order of distance, from the first to the last.
alignas(64) inline constexpr int32_t kCodeClass[16] = {kSurfaceBit, 2, 2, 2, 2, 2, 2, 2,
                                                       2,           2, 4, 4, 4, 4, 0, 0};
alignas(64) inline constexpr float kCodeDistance[16] = {1, 1, 2, 3, 4, 5, 6, 8, 11, 15, 1, 2, 3, 5, 1, 3};

/// More than the walk's rounding in voxels (docs/encodings/segment.md: 0.0061 for the crossing and as much
/// for the place), less than a voxel by far: an estimate of where a segment is that is this much too low is
/// right, or one voxel short.
inline constexpr float kEstimateSlack = 1.0f / 32;

/// Bricks of 4 voxels along each axis of the grid of codes.
NIF_HOST_DEVICE constexpr uint32_t code_bricks(uint32_t voxels) { return (voxels + 3) / 4; }

/// Voxels are numbered brick by brick, so that neighbours share a cache line. `row` is how many bricks lie
/// along x, `layer` how many in a layer of z.
NIF_HOST_DEVICE constexpr uint32_t code_number(uint32_t x, uint32_t y, uint32_t z, uint32_t row,
                                               uint32_t layer) {
  const uint32_t brick = (x >> 2) + row * (y >> 2) + layer * (z >> 2);
  return 64 * brick + ((x & 3) | (y & 3) << 2 | (z & 3) << 4);
}
/// Of the voxel of that number.
NIF_HOST_DEVICE inline uint32_t code_in(const uint32_t* codes, uint32_t number) {
  return codes[number / 8] >> (4 * (number % 8)) & 15;
}

/// A field's codes. Where there are two tables, the second is for segments that go down along `axis`.
struct WalkCodes {
  const uint32_t* words = nullptr;  ///< [tables][voxels of all bricks / 8]
  uint32_t axis = 0;
  uint32_t second = 0;  ///< added to a voxel's number in the second table; 0 where there is none
};

}  // namespace nif::kernels
