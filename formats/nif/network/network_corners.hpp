// Finds the corners that have features if the file does not list them: those around surface voxels.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "kernels/reference/planes/planes_field.hpp"

namespace nif::format {

/// Position of a brick in the grid of bricks.
using BrickAt = std::array<int32_t, 3>;

/// Surface voxels of a brick, and of those below it, spread upward by one along axis 0 to `axis`. Along all
/// three: the corners of the brick that surface voxels touch.
inline uint64_t corners_around(const kernels::PlanesField& field, const BrickAt& brick, int axis = 2) {
  for (size_t a = 0; a < 3; ++a)
    if (brick[a] < 0) return 0;
  if (axis < 0) {
    const size_t row = size_t(brick[1]) + field.bricks[1] * size_t(brick[2]);
    const uint16_t entry = field.brick_table[size_t(brick[0]) + field.bricks[0] * row];
    if (entry < kernels::kFirstMixedBrick) return 0;
    const kernels::BrickStates& states = field.brick_states[entry - kernels::kFirstMixedBrick];
    return states.surface & ~states.aux;
  }
  static constexpr uint64_t kLast[3] = {0x8888888888888888u, 0xf000f000f000f000u, 0xffff000000000000u};
  const uint32_t step = 1u << 2 * axis;
  BrickAt below = brick;
  --below[size_t(axis)];
  const uint64_t own = corners_around(field, brick, axis - 1),
                 before = corners_around(field, below, axis - 1), last = kLast[axis];
  return own | (own & ~last) << step | (before & last) >> 3 * step;
}

/// Calls visit(entry of the brick table, place) for each brick, in the order of the table.
template <class Visit>
void for_each_brick(const kernels::PlanesField& field, const Visit& visit) {
  const uint16_t* entry = field.brick_table;
  for (int32_t z = 0; z < int32_t(field.bricks[2]); ++z)
    for (int32_t y = 0; y < int32_t(field.bricks[1]); ++y)
      for (int32_t x = 0; x < int32_t(field.bricks[0]); ++x) visit(*entry++, BrickAt{x, y, z});
}

}  // namespace nif::format
