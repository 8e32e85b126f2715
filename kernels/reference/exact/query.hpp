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

/// Rays that start more extents away are not moved for planes: what triangles are off by there is no longer
/// small beside a cell.
inline constexpr float kPlanesFarthest = kBvhReach;

/// What planes see of a segment.
struct SeenSegment {
  Segment segment;
  float start;  ///< from which it counts t; start_of() it where it is moved
};

/// A segment from far away is moved, as for boxes, where what planes prove of it then is true of the segment
/// as it is (docs/encodings/exact.md, "Rays from far away"). Not on GPUs, where that would take registers
/// from all rays: planes see the ray as it is there, and triangles give the same answers.
NIF_RARE_PART_OF_KERNEL SeenSegment seen_by_planes(const ExactField& field, const Segment& segment) {
  const float start = start_of(field.bvh, segment);
  if (start == 0) return {segment, 0};
  const float steepest = largest_of(segment.direction);
  const SeenSegment moved{moved_to(start, segment), start};
  const float reach = max_of(largest_of(moved.segment.origin), field.bvh.extent);
  const bool holds = largest_of(segment.origin) <= field.bvh.extent * kPlanesFarthest &&
                     reach * field.proof.cells_per_unit <= kCullingReach && steepest >= kMinDirection &&
                     steepest <= kMaxDirection && segment.tmin <= segment.tmax;
  return holds ? moved : SeenSegment{segment, 0};
}

/// Whether an answer that planes have proven is certain: it is that of the triangles.
inline bool certain_by_planes(const ExactField& field, const Segment& segment, const SeenSegment& seen) {
  return seen.start == 0 || certain_bvh(field.bvh, segment);
}

/// Culls boxes by what a walk leaves open of a segment, which counts t from `start`. The triangles that a ray
/// meets are the same.
template <class Real>
NIF_HOST_DEVICE void cull(const ProofField& field, const Segment& segment, float start,
                          const OpenInterval& open, BvhRayOf<Real>& ray) {
  if (start != ray.start || !is_culled(field, segment)) return;
  ray.enter = max_of(open.begin, ray.enter);
  ray.leave = min_of(open.end, ray.leave);
}

inline Answer query(const ExactField& field, const Segment& segment) {
  BvhRay ray;
  if (!prepare_ray(field.bvh, segment, ray)) return answer_no_ray(segment);
  const SeenSegment seen = seen_by_planes(field, segment);
  WalkResult walk;
  OpenInterval open;
  follow_segment(field.proof, seen.segment, walk, KeepOpen{open}, NoVisit());
  if (walk.certain) {
    const bool visible = walk.verdict == Verdict::visible;
    return {visible, certain_by_planes(field, segment, seen), visible ? kCertainLogit : -kCertainLogit};
  }
  if (walk.verdict == Verdict::ambiguous) cull(field.proof, seen.segment, seen.start, open, ray);
  const bool visible = !meets_bvh(field.bvh, ray);
  return {visible, certain_bvh(field.bvh, segment), visible ? kCertainLogit : -kCertainLogit};
}

}  // namespace nif::kernels
