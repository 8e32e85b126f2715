// The walk as a thread of a GPU does it: by leaps over voxels that are alike, to the bits of
// kernels/reference/segment/walk.hpp.
//
// As in kernels/cpu/segment/walk-inl.hpp a leap ends at the crossing at which the segment leaves the cube
// that the voxel's code vouches for. Where the other axes stand then follows from their own crossings,
// counted in the reference's order (t, then the lower axis): an estimate from below that is off by at most
// one voxel is put right by one such comparison. Along an axis that goes down voxels and planes are counted
// by their negatives, so that every ray walks upward.
//
// Everything is a whole number in a float: conversions are slow on GPUs, and few registers are to hold a ray.
#pragma once

#include "kernels/gpu/segment/device_field.hpp"
#include "kernels/reference/segment/walk.hpp"

namespace nif::kernels::gpu {

/// a b + c in one instruction, where it does not matter whether the product is rounded by itself: because it
/// is exact, or the sum an estimate.
NIF_HOST_DEVICE inline float multiply_add(float a, float b, float c) {
#if defined(NIF_ON_DEVICE)
  return __builtin_fmaf(a, b, c);
#else
  return a * b + c;
#endif
}

// In one instruction: the other number where one is NaN, and of two zeros either.
NIF_HOST_DEVICE inline float smaller(float a, float b) { return __builtin_fminf(a, b); }
NIF_HOST_DEVICE inline float larger(float a, float b) { return __builtin_fmaxf(a, b); }

/// Four bits for each code.
template <class T>
constexpr uint64_t pack_by_code(const T (&table)[16]) {
  uint64_t packed = 0;
  for (uint32_t code = 0; code < 16; ++code) packed |= uint64_t(table[code]) << 4 * code;
  return packed;
}
inline constexpr uint64_t kPackedDistances = pack_by_code(kCodeDistance),
                          kPackedClasses = pack_by_code(kCodeClass);
NIF_HOST_DEVICE inline uint32_t look_up(uint64_t packed, uint32_t code) {
  return uint32_t(packed >> 4 * code) & 15;
}

/// Walks one segment: what follow_segment() finds out, with the same runs in the same order. `look` is called
/// with the number of each voxel whose code is read.
template <class AddRun, class Look>
NIF_HOST_DEVICE void leap_segment(const DeviceSegmentField& field, const Segment& segment, WalkResult& walk,
                                  const AddRun& add_run, const Look& look) {
  GridPassage passage;
  if (!enter_grid(field, segment, walk, passage)) return;

  // From too far away for estimates that are off by one voxel at most: one voxel at a time, and none.
  const bool near = walk.certain;
  const float slack = near ? kEstimateSlack : bits_as<float>(0x7f800000u);
  // Compilers are to know that these are so small that products of them are simple.
  constexpr uint32_t kFewBricks = kMaxVoxels / 2 - 1;
  const uint32_t row = code_bricks(field.voxels[0]) & kFewBricks,
                 layer = row * (code_bricks(field.voxels[1]) & kFewBricks);
  uint32_t table = 0;
  float sign[3], voxel[3];
  NIF_UNROLL
  for (uint32_t a = 0; a < 3; ++a) {
    const bool down = walk.direction[a] < 0;
    sign[a] = down ? -1.0f : 1.0f;
    voxel[a] = static_cast<float>(down ? -1 - passage.voxel[a] : passage.voxel[a]);
    if (down && field.walk.axis == a) table = field.walk.second;
  }
  // Along an axis that is not moved along: infinite, or NaN where the segment lies on the grid's far side.
  const auto crossing = [&](uint32_t a, float plane) {
    return multiply_add(sign[a], plane, -walk.origin[a]) * passage.inverse[a];
  };

  constexpr uint32_t kNothingYet = 8, kBoth = kOutsideBit | kInsideBit;
  RunRecord run;
  uint32_t seen = 0, last = kNothingYet;  // of VoxelClass
  bool first_surface = false;
  float now = passage.enter;
  for (;;) {
    uint32_t index[3];
    NIF_UNROLL
    for (uint32_t a = 0; a < 3; ++a) {
      // The lowest bits of 2^23 + n are those of n.
      const float shifted = multiply_add(sign[a], voxel[a] + 0.5f, 0x1p23f - 0.5f);
      index[a] = bits_as<uint32_t>(shifted) & (kMaxVoxels - 1);
    }
    const uint32_t number = table + code_number(index[0], index[1], index[2], row, layer);
    look(number);
    const uint32_t code = load_device(field.walk.words, number / 8) >> 4 * (number % 8) & 15,
                   state = look_up(kPackedClasses, code);
    seen |= state;
    const bool blocked = (seen & kBoth) == kBoth;
    if (((state ^ last) & kSurfaceBit) && !blocked) {
      if (state & kSurfaceBit) {
        first_surface |= last == kNothingYet;
        run.start(now);
      } else {
        run.end(now, walk, add_run);
      }
    }
    last = state;

    const float distance = near ? static_cast<float>(look_up(kPackedDistances, code)) : 1;
    float exit[3];
    NIF_UNROLL
    for (uint32_t a = 0; a < 3; ++a) exit[a] = crossing(a, voxel[a] + distance);
    const float t = smaller(smaller(exit[0], exit[1]), exit[2]);
    if (blocked | !(t < passage.leave)) break;
    now = max_of(t, now);
    // In the reference's order the crossing of a lower axis at the same t comes first.
    const bool by_0 = exit[0] == t, by_1 = exit[1] == t;
    NIF_UNROLL
    for (uint32_t a = 0; a < 3; ++a) {
      const float reached = multiply_add(walk.direction[a], t, walk.origin[a]);
      const float estimate = round_down(multiply_add(sign[a], reached, -slack));
      const float before = larger(estimate, voxel[a]), plane = before + 1;
      const float crossed_at = crossing(a, plane);
      const bool later = (a > 0 && by_0) | (a > 1 && by_1);
      const bool crossed = (crossed_at < t) | ((crossed_at == t) & !later);
      voxel[a] = crossed ? plane : before;
    }
  }
  if ((seen & kBoth) == kBoth) {
    walk.verdict = Verdict::occluded;
    return;
  }
  end_walk(
      passage, now,
      Seen{(seen & kOutsideBit) != 0, (seen & kInsideBit) != 0, first_surface, (last & kSurfaceBit) != 0},
      run, walk, add_run);
}

/// The one way in which kernels walk.
template <class AddRun>
NIF_HOST_DEVICE void walk_object(const DeviceSegmentField& field, const Segment& segment, WalkResult& walk,
                                 const AddRun& add_run) {
  leap_segment(field, segment, walk, add_run, [](uint32_t) {});
}

}  // namespace nif::kernels::gpu
