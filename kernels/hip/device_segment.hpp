// A field of the `segment` encoding in device memory: with what the walk and the gathering of features read
// in place of the asset's own arrays.
#pragma once

#include "kernels/corner_bricks.hpp"
#include "kernels/field.hpp"
#include "kernels/reference/samples.hpp"
#include "kernels/walk_codes.hpp"

namespace nif::kernels::hip {

/// Where there are corner bricks, the asset's own arrays of corners and features are not on the device, and
/// brick_states are not in any case. brick_table then is neither.
struct DeviceSegmentField : SegmentField {
  WalkCodes walk;
  CornerBricks corner_bricks;  ///< none unless there are two features a corner; without `pairs`
  const uint32_t* next_pairs =
      nullptr;  ///< [corner_bricks.pair_count]: each pair of features, and the next one
};

/// Words of its codes.
inline size_t walk_words(const DeviceSegmentField& field) {
  size_t words = field.walk.second ? 16 : 8;
  for (const uint32_t voxels : field.voxels) words *= code_bricks(voxels);
  return words;
}

/// array[i] of device memory. Where a pointer to it was itself read from there, AMD's compiler does not know
/// what it points to, and would load as if from any memory, which takes longer.
template <class T>
NIF_HOST_DEVICE inline T load_device(const T* array, uint32_t i) {
#if defined(__HIP__) && defined(NIF_ON_DEVICE)
  using Known = __attribute__((address_space(1))) const T;
  return ((Known*)array)[i];
#else
  return array[i];
#endif
}

/// Sums of a point's two features, as for_each_corner() finds them one by one: each corner's times its
/// weight.
NIF_HOST_DEVICE inline void sum_pairs(const DeviceSegmentField& field, const SamplePoint& point,
                                      int32_t& first, int32_t& second) {
  const CornerBricks& corners = field.corner_bricks;
  const uint32_t x = point.voxel[0], y = point.voxel[1], z = point.voxel[2];
  const uint32_t number =
      (x >> 2) + code_bricks(field.voxels[0]) * ((y >> 2) + code_bricks(field.voxels[1]) * (z >> 2));
  const uint32_t word = load_device(corners.table, number / 16), mark = 1u << number % 16;
  const uint32_t brick = word & mark ? 1 + (word >> 16) + count_bits(word & (mark - 1)) : 0;
  const auto* const words = reinterpret_cast<const uint32_t*>(corners.bricks);  // of CornerBricks
  constexpr uint32_t kWords = sizeof(CornerBrick) / sizeof(uint32_t);
  const uint32_t origin = load_device(words, kWords * brick);
  const auto weight = [&](uint32_t a, uint32_t high) {
    return high ? int32_t(point.fraction[a]) : kFractionOne - int32_t(point.fraction[a]);
  };
  first = second = 0;
  NIF_UNROLL
  for (uint32_t dz = 0; dz < 2; ++dz) {
    const uint32_t layer = load_device(words, kWords * brick + 1 + (z & 3) + dz);
    NIF_UNROLL
    for (uint32_t dy = 0; dy < 2; ++dy) {
      const uint32_t bit = (x & 3) + 5 * ((y & 3) + dy), there = layer >> bit;
      const uint32_t pairs =
          load_device(field.next_pairs, origin + (layer >> 25) + count_bits(layer & ((1u << bit) - 1)));
      const uint32_t low = there & 1 ? pairs : 0, high = there & 2 ? pairs >> 16 * (there & 1) : 0;
      const int32_t across = weight(1, dy) * weight(2, dz);
      first += across * (weight(0, 0) * int8_t(low) + weight(0, 1) * int8_t(high));
      second += across * (weight(0, 0) * int8_t(low >> 8) + weight(0, 1) * int8_t(high >> 8));
    }
  }
}

}  // namespace nif::kernels::hip
