// The `exact` encoding: planes prove most answers, and triangles decide the rest (docs/encodings/exact.md).
//
// Answers and first hits are bit for bit those of the triangles alone: planes only prove what the triangles
// would say, and the part of a ray that they leave open contains every triangle that it can meet. So a scene
// treats such an object like its triangles.
#pragma once

#include "kernels/reference/encoding.hpp"
#include "kernels/reference/encodings/reference_bvh.hpp"
#include "kernels/reference/planes/open.hpp"

namespace nif::kernels {

/// Limit of the mesh's coordinates. It keeps every ray that planes prove anything about near enough for the
/// BVH.
inline constexpr float kMaxExactCoordinate = 0x1p40f;

struct ExactField {
  PlanesField planes;
  TrianglesField triangles;  ///< the same surface
};

inline ObjectBox object_box(const ExactField& field) { return object_box(field.triangles); }
inline float reach_scale(const ExactField& field) { return reach_scale(field.triangles); }
inline Calibration calibration(const ExactField&) { return {}; }

/// Rays that start more extents away are not moved for the planes: there the triangles' error is no longer
/// small compared to a cell.
inline constexpr float kPlanesFarthest = kBvhReach;

/// A segment as the planes see it.
struct SeenSegment {
  Segment segment;
  float start;  ///< the original t at which the segment's own t is 0: start_of() it if moved, else 0
};

/// A segment that starts far away is moved, as for boxes, if what planes prove about the moved one also holds
/// for the original (docs/encodings/exact.md, "Rays from far away"). Not on GPUs, where this would take
/// registers from all rays: there planes see the original ray, and triangles give the same answers.
NIF_RARE_PART_OF_KERNEL SeenSegment seen_by_planes(const ExactField& field, const Segment& segment) {
  const float start = start_of(field.triangles, segment);
  if (start == 0) return {segment, 0};
  const float steepest = largest_of(segment.direction);
  const SeenSegment moved{moved_to(start, segment), start};
  const float reach = max_of(largest_of(moved.segment.origin), field.triangles.extent);
  const bool holds = largest_of(segment.origin) <= field.triangles.extent * kPlanesFarthest &&
                     reach * field.planes.cells_per_unit <= kCullingReach && steepest >= kMinDirection &&
                     steepest <= kMaxDirection && segment.tmin <= segment.tmax;
  return holds ? moved : SeenSegment{segment, 0};
}

/// Whether an answer proven by planes is certain: exactly if that of the triangles is.
inline bool certain_by_planes(const ExactField& field, const Segment& segment, const SeenSegment& seen) {
  return seen.start == 0 || certain_bvh(field.triangles, segment);
}

/// Culls boxes to the interval that the traversal of the planes left open. That segment counts t from
/// `start`. The ray still meets the same triangles.
template <class Real>
NIF_HOST_DEVICE void cull(const PlanesField& field, const Segment& segment, float start,
                          const OpenInterval& open, BvhRayOf<Real>& ray) {
  if (start != ray.start || !is_culled(field, segment)) return;
  ray.enter = max_of(open.begin, ray.enter);
  ray.leave = min_of(open.end, ray.leave);
}

inline Answer query(const ExactField& field, const Segment& segment) {
  BvhRay ray;
  if (!prepare_ray(field.triangles, segment, ray)) return answer_no_ray(segment);
  const SeenSegment seen = seen_by_planes(field, segment);
  TraversalResult traversal;
  OpenInterval open;
  follow_segment(field.planes, seen.segment, traversal, KeepOpen{open}, NoVisit());
  if (traversal.certain) {
    const bool visible = traversal.verdict == Verdict::visible;
    return {visible, certain_by_planes(field, segment, seen), visible ? kCertainLogit : -kCertainLogit};
  }
  if (traversal.verdict == Verdict::open) cull(field.planes, seen.segment, seen.start, open, ray);
  const bool visible = !meets_bvh(field.triangles, ray);
  return {visible, certain_bvh(field.triangles, segment), visible ? kCertainLogit : -kCertainLogit};
}

/// Culls boxes to the interval that holds the first hit, found by an in-order traversal whose open cells are
/// in `open`. Returns false if the ray certainly meets nothing.
NIF_HOST_DEVICE inline bool cull_to_hit(const PlanesField& field, const Segment& segment, float start,
                                        const TraversalResult& traversal, OpenInterval& open, BvhRay& ray) {
  if (traversal.verdict == Verdict::visible && traversal.certain) return false;
  if (traversal.verdict == Verdict::occluded && traversal.certain) {
    if (traversal.interval_count == 0) open.begin = traversal.last_enter;
    open.end = traversal.last_leave;
    cull(field, segment, start, open, ray);
  } else if (traversal.verdict == Verdict::open) {
    cull(field, segment, start, open, ray);
  }
  return true;
}

inline Hit intersect(const ExactField& field, const Segment& segment, float limit = kNoHit) {
  BvhRay ray;
  if (!prepare_ray(field.triangles, segment, ray)) return no_hit(answer_no_ray(segment).certain);
  const SeenSegment seen = seen_by_planes(field, segment);
  TraversalResult traversal;
  OpenInterval open;
  follow_segment<true>(field.planes, seen.segment, traversal, KeepOpen{open}, NoVisit());
  if (!cull_to_hit(field.planes, seen.segment, seen.start, traversal, open, ray))
    return no_hit(certain_by_planes(field, segment, seen));
  return nearest_hit(field.triangles, segment, limit, ray);
}

template <>
struct EncodingOf<ExactField> : MadeOf<PlanesField, TrianglesField> {
  static constexpr EncodingName kName{4, "exact"};
};

}  // namespace nif::kernels
