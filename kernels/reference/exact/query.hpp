// The answer of one `exact` object: what the planes prove, and where they leave it open, the triangles.
//
// It is the answer of a `bvh` object with the same triangles, bit by bit: planes prove what triangles would
// say, and the part of a ray that they leave open has all triangles that it can meet
// (docs/encodings/exact.md).
#pragma once

#include "kernels/reference/bvh/query.hpp"
#include "kernels/reference/exact/field.hpp"
#include "kernels/reference/proof/walk.hpp"

namespace nif::kernels {

/// Where a walk leaves a segment open: from its first run to its last, as t.
struct OpenInterval {
  float begin = 0, end = 0;
};
/// Is called with each run in turn. A structure, because GPU compilers want to know of a lambda that a device
/// could call it.
struct KeepOpen {
  OpenInterval& open;
  NIF_HOST_DEVICE void operator()(uint32_t number, const Run& run) const {
    if (number == 0) open.begin = run.begin;
    open.end = run.end;
  }
};

/// From this far away, in finest cells, the ends of runs are so near to where they should be that no triangle
/// lies beyond them. Rays from farther away are looked at as a whole.
inline constexpr float kCullingReach = kCertainReach / 4;

NIF_HOST_DEVICE inline bool is_culled(const ProofField& field, const Segment& segment) {
  bool near = true;
  NIF_UNROLL
  for (int a = 0; a < 3; ++a)
    near = near && magnitude(segment.origin[a] - field.origin[a]) * field.cells_per_unit <= kCullingReach;
  return near;
}

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
