// The answer of one `exact` object: what the planes prove, and where they leave it open, the triangles.
//
// It is the answer of a `bvh` object with the same triangles, bit by bit: planes prove what triangles would
// say, and the part of a ray that they leave open has all triangles that it can meet
// (docs/encodings/exact.md).
#pragma once

#include "kernels/reference/bvh/query.hpp"
#include "kernels/reference/exact/field.hpp"
#include "kernels/reference/proof/open.hpp"

namespace nif::kernels {

/// Culls boxes by what a walk leaves open. The triangles that a ray meets are the same.
template <class Real>
NIF_HOST_DEVICE void cull(const ProofField& field, const Segment& segment, const OpenInterval& open,
                          BvhRayOf<Real>& ray) {
  if (!is_culled(field, segment)) return;
  ray.enter = max_of(open.begin, ray.enter);
  ray.leave = min_of(open.end, ray.leave);
}

inline Answer query(const ExactField& field, const Segment& segment) {
  BvhRay ray;
  if (!prepare_ray(field.bvh, segment, ray)) return answer_no_ray(segment);
  WalkResult walk;
  OpenInterval open;
  follow_segment(field.proof, segment, walk, KeepOpen{open}, NoVisit());
  if (walk.certain) {
    const bool visible = walk.verdict == Verdict::visible;
    return {visible, true, visible ? kCertainLogit : -kCertainLogit};
  }
  if (walk.verdict == Verdict::ambiguous) cull(field.proof, segment, open, ray);
  const bool visible = !meets_bvh(field.bvh, ray);
  return {visible, certain_bvh(field.bvh, segment), visible ? kCertainLogit : -kCertainLogit};
}

}  // namespace nif::kernels
