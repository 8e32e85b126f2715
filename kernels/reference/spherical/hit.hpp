// The first hit of one `spherical` object. Its networks know whether there is one, but not where: t is where
// the segment enters the object's AABB, and there is no normal.
#pragma once

#include "kernels/reference/hit.hpp"
#include "kernels/reference/spherical/query.hpp"

namespace nif::kernels {

/// The hit of a segment with this answer: a visible one has none.
NIF_HOST_DEVICE inline Hit hit_on_box(const SphericalBounds& bounds, const Segment& segment, bool visible,
                                      bool certain) {
  if (visible) return no_hit(certain);
  Hit hit;
  float enter = max_of(segment.tmin, -kMaxSphericalCoordinate), leave = segment.tmax;
  NIF_UNROLL
  for (int a = 0; a < 3; ++a) {
    const float d = segment.direction[a];
    if (d == 0) continue;
    const float near = ((d < 0 ? bounds.high[a] : bounds.low[a]) - segment.origin[a]) / d;
    if (is_finite(near)) enter = max_of(near, enter);
  }
  hit.t = min_of(enter, leave);
  return hit;
}

inline Hit intersect(const SphericalField& field, const Segment& segment, float = kNoHit) {
  const Answer answer = query(field, segment);
  return hit_on_box(field, segment, answer.visible, answer.certain);
}

}  // namespace nif::kernels
