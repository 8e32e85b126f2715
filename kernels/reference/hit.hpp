// Where a segment first meets an object, in any encoding.
#pragma once

#include <limits>

#include "kernels/reference/arithmetic.hpp"
#include "kernels/reference/ray.hpp"

namespace nif::kernels {

/// Of the surface at a hit where the object has no triangles, or none that can be named.
inline constexpr uint32_t kNoTriangle = 0xffffffff;
inline constexpr float kNoHit = std::numeric_limits<float>::infinity();

/// The first hit of a segment with one object; t as the segment has it. There is one where query() says
/// occluded. intersect(field, segment, limit) finds it, in any encoding. Of what is met beyond `limit` it
/// need only say that: `t` and `low` above the limit.
struct Hit {
  float t = kNoHit;  ///< kNoHit: there is none; else finite, and from tmin to tmax
  // What is proven: nothing is met before `low`, and something at `high` or before. Minus infinity and
  // infinity prove nothing; infinity as `low` proves that nothing is met.
  float low = -kNoHit, high = kNoHit;
  float normal[3] = {};  ///< of the surface there, in object space, of either side and any length; may be 0
  uint32_t triangle = kNoTriangle;
  /// The point is 1 - u - v of the triangle's first vertex, u of its second, v of its third.
  float u = 0, v = 0;

  NIF_HOST_DEVICE bool certain() const { return high < kNoHit || low == kNoHit; }
};

/// Nothing is met, and that is proven or not.
NIF_HOST_DEVICE inline Hit no_hit(bool certain) {
  Hit hit;
  if (certain) hit.low = kNoHit;
  return hit;
}

}  // namespace nif::kernels
