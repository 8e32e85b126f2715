// The first hit of one `spherical` object. Its networks know whether there is one, and not where: t is where
// the segment enters the object's AABB, and there is no normal.
#pragma once

#include "kernels/reference/hit.hpp"
#include "kernels/reference/spherical/query.hpp"

namespace nif::kernels {

inline Hit intersect(const SphericalField& field, const Segment& segment, float = kNoHit) {
  const Answer answer = query(field, segment);
  if (answer.visible) return no_hit(answer.certain);
  Hit hit;
  float enter = max_of(segment.tmin, -kMaxSphericalCoordinate), leave = segment.tmax;
  for (int a = 0; a < 3; ++a) {
    const float d = segment.direction[a];
    if (d == 0) continue;
    const float near = ((d < 0 ? field.high[a] : field.low[a]) - segment.origin[a]) / d;
    if (is_finite(near)) enter = max_of(near, enter);
  }
  hit.t = min_of(enter, leave);
  return hit;
}

}  // namespace nif::kernels
