// Adds the `bvh` encoding to the list of encodings: its field, its query(), and what a scene must know about
// an object besides its answers.
#pragma once

#include "kernels/reference/encoding.hpp"
#include "kernels/reference/ray.hpp"
#include "kernels/reference/triangles/triangles_field.hpp"
#include "kernels/reference/triangles/triangles_hit.hpp"
#include "kernels/reference/triangles/triangles_query.hpp"

namespace nif::kernels {

/// The box of a `bvh` object contains the boxes of its root, and the margin by which stays_certain() lets a
/// ray move.
inline constexpr float kBvhUnits = 64;
inline constexpr double kBvhMargin = 0x1p-14;  ///< times the extent
inline ObjectBox object_box(const TrianglesField& field) {
  const BvhNode& root = field.nodes[0];
  ObjectBox box;
  for (int a = 0; a < 3; ++a) {
    uint8_t low = 255, high = 0;
    for (uint32_t s = 0; s < kBvhWidth && root.slots[s] != 0; ++s) {
      low = root.low[a][s] < low ? root.low[a][s] : low;
      high = root.high[a][s] > high ? root.high[a][s] : high;
    }
    box.low[a] = double(frame_plane(root.frame[a], low)) - kBvhMargin * double(field.extent);
    box.high[a] = double(frame_plane(root.frame[a], high)) + kBvhMargin * double(field.extent);
  }
  return box;
}

/// kCertainReach counts units; kBvhUnits of them make the extent.
inline float reach_scale(const TrianglesField& field) { return kBvhUnits / field.extent; }
inline Calibration calibration(const TrianglesField&) { return {}; }

template <>
struct EncodingOf<TrianglesField> : MadeOf<TrianglesField> {
  static constexpr EncodingName kName{3, "bvh"};
};

}  // namespace nif::kernels
