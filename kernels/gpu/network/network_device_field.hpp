// A field of the `segment` encoding in device memory, with the words and corner bricks that replace the
// asset's own arrays in traversal and feature look-up.
#pragma once

#include "kernels/gpu/device_memory.hpp"
#include "kernels/packed/corner_bricks.hpp"
#include "kernels/packed/traversal_words.hpp"
#include "kernels/reference/network/network_field.hpp"
#include "kernels/reference/network/samples.hpp"

namespace nif::kernels::gpu {

/// The arrays that describe the surface and its cells are not on the device; `words` replaces them. If there
/// are corner bricks, neither are the asset's arrays of corners and features, nor brick_table.
struct DeviceSegmentField : SegmentField {
  TraversalWords words;
  CornerBricks corner_bricks;  ///< none unless there are two features per corner; without `pairs`
  const uint32_t* next_pairs =
      nullptr;  ///< [corner_bricks.pair_count]: each pair of features, and the next one
};

/// Number of bricks along an axis, as CornerBricks::table numbers them.
NIF_HOST_DEVICE constexpr uint32_t bricks_of(uint32_t voxels) { return (voxels + 3) / 4; }

/// Index of the corner brick of a brick of voxels, or of the one without corners, in words of
/// CornerBricks::bricks.
NIF_HOST_DEVICE inline uint32_t corner_brick(const DeviceSegmentField& field, uint32_t x, uint32_t y,
                                             uint32_t z) {
  const uint32_t number = x + bricks_of(field.voxels[0]) * (y + bricks_of(field.voxels[1]) * z);
  const uint32_t word = load_device(field.corner_bricks.table, number / 16), mark = 1u << number % 16;
  const uint32_t brick = word & mark ? 1 + (word >> 16) + count_bits(word & (mark - 1)) : 0;
  return uint32_t(sizeof(CornerBrick) / sizeof(uint32_t)) * brick;
}

/// The features of one corner, in whichever brick it is; 0 if it has none.
NIF_HOST_DEVICE inline uint32_t find_pair(const DeviceSegmentField& field, const uint32_t (&corner)[3]) {
  const auto* const words = reinterpret_cast<const uint32_t*>(field.corner_bricks.bricks);
  uint32_t first[3], last[3];  // bricks that share the corner: up to two along each axis
  NIF_UNROLL
  for (int a = 0; a < 3; ++a) {
    const uint32_t bricks = bricks_of(field.voxels[a]);
    first[a] = corner[a] > 0 ? (corner[a] - 1) / 4 : 0;
    last[a] = corner[a] / 4 < bricks ? corner[a] / 4 : bricks - 1;
  }
  NIF_NO_UNROLL
  for (uint32_t k = 0; k < 8; ++k) {
    const uint32_t x = first[0] + (k & 1), y = first[1] + (k >> 1 & 1), z = first[2] + (k >> 2);
    if (x > last[0] || y > last[1] || z > last[2]) continue;
    const uint32_t brick = corner_brick(field, x, y, z);
    const uint32_t layer = load_device(words, brick + 1 + (corner[2] - 4 * z)),
                   bit = corner[0] - 4 * x + 5 * (corner[1] - 4 * y);
    if (layer >> bit & 1)
      return load_device(field.next_pairs,
                         load_device(words, brick) + (layer >> 25) + count_bits(layer & ((1u << bit) - 1)));
  }
  return 0;
}

/// Weighted sums of a point's two features over its corners, as for_each_corner() visits them one by one.
NIF_HOST_DEVICE inline void sum_pairs(const DeviceSegmentField& field, const SamplePoint& point,
                                      int32_t& first, int32_t& second) {
  const uint32_t x = point.voxel[0], y = point.voxel[1], z = point.voxel[2];
  const auto* const words = reinterpret_cast<const uint32_t*>(field.corner_bricks.bricks);
  const uint32_t brick = corner_brick(field, x >> 2, y >> 2, z >> 2), origin = load_device(words, brick);
  const uint32_t bit = (x & 3) + 5 * (y & 3), four = 0x63u << bit;
  const uint32_t layers[2] = {load_device(words, brick + 1 + (z & 3)),
                              load_device(words, brick + 2 + (z & 3))};
  first = second = 0;
  if ((layers[0] & layers[1] & four) != four) {
    // Rounding has moved the point out of the surface voxels: other bricks may have its corners.
    NIF_NO_UNROLL
    for (uint32_t c = 0; c < 8; ++c) {
      const uint32_t pair = find_pair(field, {x + (c & 1), y + (c >> 1 & 1), z + (c >> 2)});
      const int32_t weight = corner_weight(point.fraction, int(c));
      first += weight * int8_t(pair);
      second += weight * int8_t(pair >> 8);
    }
    return;
  }
  const auto weight = [&](uint32_t a, uint32_t high) {
    return high ? int32_t(point.fraction[a]) : kFractionOne - int32_t(point.fraction[a]);
  };
  NIF_UNROLL
  for (uint32_t dz = 0; dz < 2; ++dz) {
    NIF_UNROLL
    for (uint32_t dy = 0; dy < 2; ++dy) {
      const uint32_t below = layers[dz] & ((1u << (bit + 5 * dy)) - 1);
      const uint32_t row = load_device(field.next_pairs, origin + (layers[dz] >> 25) + count_bits(below));
      const int32_t across = weight(1, dy) * weight(2, dz);
      first += across * (weight(0, 0) * int8_t(row) + weight(0, 1) * int8_t(row >> 16));
      second += across * (weight(0, 0) * int8_t(row >> 8) + weight(0, 1) * int8_t(row >> 24));
    }
  }
}

}  // namespace nif::kernels::gpu
