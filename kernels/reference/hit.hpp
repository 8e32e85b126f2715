// Describes where a segment first meets an object, in any encoding.
#pragma once

#include <limits>

#include "kernels/reference/arithmetic.hpp"
#include "kernels/reference/ray.hpp"

namespace nif::kernels {

/// The triangle at a hit if the object has no triangles, or none that can be named.
inline constexpr uint32_t kNoTriangle = 0xffffffff;
inline constexpr float kNoHit = std::numeric_limits<float>::infinity();

/// The first hit of a segment with one object, with the segment's own t. It exists if query() says occluded.
/// intersect(field, segment, limit) finds it, in any encoding. If the hit lies beyond `limit`, it suffices
/// that `t` and `low` are above the limit.
struct Hit {
  float t = kNoHit;  ///< kNoHit if there is none; else finite, and from tmin to tmax
  // Proven bounds: nothing is met before `low`, and something is met at `high` or before. Minus infinity and
  // infinity prove nothing; `low` = infinity proves that nothing is met.
  float low = -kNoHit, high = kNoHit;
  float normal[3] = {};  ///< of the surface, in object space, on either side and of any length; may be 0
  uint32_t triangle = kNoTriangle;
  /// The hit is at (1 - u - v) * first vertex + u * second + v * third.
  float u = 0, v = 0;

  NIF_HOST_DEVICE bool certain() const { return high < kNoHit || low == kNoHit; }
};

/// No hit. `certain`: whether that is proven.
NIF_HOST_DEVICE inline Hit no_hit(bool certain) {
  Hit hit;
  if (certain) hit.low = kNoHit;
  return hit;
}

}  // namespace nif::kernels
