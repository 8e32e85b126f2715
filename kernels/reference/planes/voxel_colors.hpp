// The mean base colour of an object's surface in each voxel, if the object has colours.
//
// A colour takes 16 bits, red in the highest 5, green in 6, blue in 5. A step c of n stands for (c / n)^2 in
// linear light: about as fine as sRGB, with the same bits on every machine.
#pragma once

#include <cstdint>

#include "kernels/reference/planes/grid_traversal.hpp"

namespace nif::kernels {

struct VoxelColors {
  const PlanesField* grid = nullptr;
  const uint16_t* values =
      nullptr;  ///< [surface_voxels], in the order of voxel_records; null if there are none
};

/// Red, green and blue that callers get if the object has no colours.
inline constexpr float kNoColor = 0.5f;

NIF_HOST_DEVICE inline void unpack_color(uint16_t packed, float (&color)[3]) {
  const float steps[3] = {static_cast<float>(packed >> 11) / 31.0f,
                          static_cast<float>(packed >> 5 & 63) / 63.0f,
                          static_cast<float>(packed & 31) / 31.0f};
  NIF_UNROLL
  for (int c = 0; c < 3; ++c) color[c] = steps[c] * steps[c];
}

/// Index of the surface voxel; false if the voxel is none.
NIF_HOST_DEVICE inline bool surface_voxel(const PlanesField& field, const int32_t (&voxel)[3],
                                          uint32_t& index) {
  const VoxelAddress at = voxel_address(field, voxel);
  if (at.entry < kFirstMixedBrick) return false;
  const BrickStates& states = field.brick_states[at.entry - kFirstMixedBrick];
  if (state_in(states, at.bit) != VoxelState::surface) return false;
  const uint64_t below = states.surface & ~states.aux & ((uint64_t{1} << at.bit) - 1);
  index = field.voxel_base[at.entry - kFirstMixedBrick] + count_bits(below);
  return true;
}

/// The surface voxel that holds a point of a segment in object space. Rounding may have moved the point, so
/// otherwise the nearest surface voxel around it; the first one if several are equally near. Returns false if
/// there is none.
NIF_HOST_DEVICE inline bool nearest_surface_voxel(const PlanesField& field, const Segment& segment, float t,
                                                  uint32_t& index) {
  double at[3];
  int32_t middle[3];
  NIF_UNROLL
  for (int a = 0; a < 3; ++a) {
    at[a] = ((static_cast<double>(segment.origin[a]) - static_cast<double>(field.origin[a])) +
             static_cast<double>(t) * static_cast<double>(segment.direction[a])) *
            static_cast<double>(field.voxels_per_unit);
    const double last = static_cast<double>(field.voxels[a] - 1);
    middle[a] = at[a] >= 0 ? static_cast<int32_t>(at[a] < last ? at[a] : last) : 0;  // NaN gives 0
  }
  if (surface_voxel(field, middle, index)) return true;
  bool found = false;
  double nearest = 0;
  NIF_NO_UNROLL
  for (int i = 0; i < 27; ++i) {
    const int32_t voxel[3] = {middle[0] + i % 3 - 1, middle[1] + i / 3 % 3 - 1, middle[2] + i / 9 - 1};
    bool inside = true;
    double square = 0;
    NIF_UNROLL
    for (int a = 0; a < 3; ++a) {
      inside = inside && voxel[a] >= 0 && voxel[a] < static_cast<int32_t>(field.voxels[a]);
      const double below = static_cast<double>(voxel[a]) - at[a],
                   above = at[a] - static_cast<double>(voxel[a] + 1);
      const double off = below > 0 ? below : above > 0 ? above : 0;
      square += off * off;
    }
    uint32_t one = 0;
    if (!inside || (found && !(square < nearest)) || !surface_voxel(field, voxel, one)) continue;
    found = true;
    nearest = square;
    index = one;
  }
  return found;
}

/// Linear red, green and blue at the point where a segment in object space meets the surface.
NIF_HOST_DEVICE inline void color_at(const VoxelColors& colors, const Segment& segment, float t,
                                     float (&color)[3]) {
  uint32_t index = 0;
  if (colors.values != nullptr && nearest_surface_voxel(*colors.grid, segment, t, index)) {
    unpack_color(colors.values[index], color);
    return;
  }
  NIF_UNROLL
  for (int c = 0; c < 3; ++c) color[c] = kNoColor;
}

}  // namespace nif::kernels
