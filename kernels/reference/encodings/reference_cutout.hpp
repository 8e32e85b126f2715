// The `cutout` encoding: exact triangles of which some have holes (docs/encodings/cutout.md).
//
// Holes only take away what blocks a ray. So boxes, margins and what is certain are those of `bvh`.
#pragma once

#include "kernels/reference/encodings/reference_bvh.hpp"
#include "kernels/reference/holes/holes_field.hpp"

namespace nif::kernels {

struct CutoutField {
  TrianglesField triangles;
  HolesField holes;
};

inline ObjectBox object_box(const CutoutField& field) { return object_box(field.triangles); }
inline float reach_scale(const CutoutField& field) { return reach_scale(field.triangles); }
inline Calibration calibration(const CutoutField&) { return {}; }

inline Answer query(const CutoutField& field, const Segment& segment) {
  BvhRay ray;
  if (!prepare_ray(field.triangles, segment, ray)) return answer_no_ray(segment);
  const bool visible = !meets_bvh(field.triangles, ray, nullptr, BlockingTriangles{field.holes});
  return {visible, certain_bvh(field.triangles, segment), visible ? kCertainLogit : -kCertainLogit};
}

inline Hit intersect(const CutoutField& field, const Segment& segment, float limit = kNoHit) {
  BvhRay ray;
  if (!prepare_ray(field.triangles, segment, ray)) return no_hit(answer_no_ray(segment).certain);
  return nearest_hit(field.triangles, segment, limit, ray, BlockingTriangles{field.holes});
}

template <>
struct EncodingOf<CutoutField> : MadeOf<TrianglesField, HolesField> {
  static constexpr EncodingName kName{6, "cutout"};
};

}  // namespace nif::kernels
