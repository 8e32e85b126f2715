// The first hit of one `exact` object: that of a `bvh` object with the same triangles, bit by bit. Planes
// only save time, as in query.hpp: they say which segments meet nothing, and where the first hit of others is
// at the earliest and at the latest.
#pragma once

#include "kernels/reference/bvh/hit.hpp"
#include "kernels/reference/exact/query.hpp"

namespace nif::kernels {

/// Culls boxes by a walk in order, whose open cells are in `open`, to where the first hit is. False where
/// nothing is met, for certain.
NIF_HOST_DEVICE inline bool cull_to_hit(const ProofField& field, const Segment& segment, float start,
                                        const WalkResult& walk, OpenInterval& open, BvhRay& ray) {
  if (walk.verdict == Verdict::visible && walk.certain) return false;
  if (walk.verdict == Verdict::occluded && walk.certain) {
    if (walk.run_count == 0) open.begin = walk.last_enter;
    open.end = walk.last_leave;
    cull(field, segment, start, open, ray);
  } else if (walk.verdict == Verdict::ambiguous) {
    cull(field, segment, start, open, ray);
  }
  return true;
}

inline Hit intersect(const ExactField& field, const Segment& segment, float limit = kNoHit) {
  BvhRay ray;
  if (!prepare_ray(field.bvh, segment, ray)) return no_hit(answer_no_ray(segment).certain);
  const SeenSegment seen = seen_by_planes(field, segment);
  WalkResult walk;
  OpenInterval open;
  follow_segment<true>(field.proof, seen.segment, walk, KeepOpen{open}, NoVisit());
  if (!cull_to_hit(field.proof, seen.segment, seen.start, walk, open, ray))
    return no_hit(certain_by_planes(field, segment, seen));
  return nearest_hit(field.bvh, segment, limit, ray);
}

}  // namespace nif::kernels
