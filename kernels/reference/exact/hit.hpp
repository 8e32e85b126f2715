// The first hit of one `exact` object: that of a `bvh` object with the same triangles, bit by bit. Planes
// only save time, as in query.hpp: they say which segments meet nothing, and where the first hit of others is
// at the earliest and at the latest.
#pragma once

#include "kernels/reference/bvh/hit.hpp"
#include "kernels/reference/exact/query.hpp"

namespace nif::kernels {

inline Hit intersect(const ExactField& field, const Segment& segment, float limit = kNoHit) {
  BvhRay ray;
  if (!prepare_ray(field.bvh, segment, ray)) return no_hit(answer_no_ray(segment).certain);
  WalkResult walk;
  OpenInterval open;
  follow_segment<true>(field.proof, segment, walk, KeepOpen{open}, NoVisit());
  if (walk.verdict == Verdict::visible && walk.certain) return no_hit(true);
  if (walk.verdict == Verdict::occluded && walk.certain) {
    if (walk.run_count == 0) open.begin = walk.last_enter;
    open.end = walk.last_leave;
    cull(field.proof, segment, open, ray);
  } else if (walk.verdict == Verdict::ambiguous) {
    cull(field.proof, segment, open, ray);
  }
  return nearest_hit(field.bvh, segment, limit, ray);
}

}  // namespace nif::kernels
