// Adds the `exact` encoding to the list of encodings (kernels/gpu/encoding_list.hpp): the traversals of
// kernels/gpu/planes and of kernels/gpu/triangles.
#pragma once

#include "kernels/gpu/encoding_list.hpp"
#include "kernels/gpu/encodings/gpu_bvh.hpp"
#include "kernels/gpu/planes/planes_device_field.hpp"
#include "kernels/gpu/planes/skipping_traversal.hpp"
#include "kernels/reference/encodings/reference_exact.hpp"

namespace nif::kernels::gpu {

/// In device memory. It lacks the grid's own arrays; `words` replaces them.
struct DeviceExactField : ExactField {
  TraversalWords words;
};

/// `stack`: as for meets_nodes().
template <uint32_t kStride>
NIF_HOST_DEVICE ObjectAnswer answer_exact_ray(const DeviceExactField& field, const Segment& segment,
                                              uint32_t* stack) {
  TraversalResult traversal;
  OpenInterval open;
  traverse_object(field.planes, field.words, segment, traversal, KeepOpen{open});
  BvhRay ray;
  if (!prepare_ray(field.triangles, segment, ray)) {
    const Answer none = answer_no_ray(segment);
    return {none.logit, none.certain};
  }
  if (traversal.certain)
    return {traversal.verdict == Verdict::visible ? kCertainLogit : -kCertainLogit, true};
  if (traversal.verdict == Verdict::open) cull(field.planes, segment, 0, open, ray);
  return {meets_nodes<kStride>(field.triangles, ray, stack) ? -kCertainLogit : kCertainLogit,
          certain_bvh(field.triangles, segment)};
}

/// Like intersect(). `stack`: as for meets_nodes().
template <uint32_t kStride>
NIF_HOST_DEVICE Hit find_exact_hit(const DeviceExactField& field, const Segment& segment, float limit,
                                   uint32_t* stack) {
  TraversalResult traversal;
  OpenInterval open;
  traverse_object<true>(field.planes, field.words, segment, traversal, KeepOpen{open});
  BvhRay ray;
  if (!prepare_ray(field.triangles, segment, ray)) return no_hit(answer_no_ray(segment).certain);
  if (!cull_to_hit(field.planes, segment, 0, traversal, open, ray)) return no_hit(true);
  return nearest_bvh_hit<kStride>(field.triangles, segment, limit, ray, stack);
}

struct ExactEncoding {
  using Field = DeviceExactField;
  enum Kind : uint32_t { kProvenFirst = 1 };
  static constexpr uint32_t kKinds = 1;
  static constexpr bool kHasItems = false, kProves = false;

  template <uint32_t kSet, class Thread>
  NIF_HOST_DEVICE NIF_INLINE static ObjectAnswer ask(const Thread&, const SceneObject& object, uint32_t,
                                                     const Segment& ray, uint32_t* row) {
    return answer_exact_ray<1>(*static_cast<const Field*>(object.field), ray, row);
  }
  template <uint32_t kSet>
  NIF_HOST_DEVICE NIF_INLINE static bool traverse(const SceneObject& object, const Segment& ray,
                                                  uint32_t* column, OpenItem&, ObjectAnswer& answer) {
    answer = answer_exact_ray<kBlockThreads>(*static_cast<const Field*>(object.field), ray, column);
    return true;
  }
  template <uint32_t kSet, class Thread>
  NIF_HOST_DEVICE NIF_INLINE static Hit intersect(const Thread&, const SceneObject& object, uint32_t,
                                                  const Segment& ray, float limit, uint32_t* row) {
    return find_exact_hit<1>(*static_cast<const Field*>(object.field), ray, limit, row);
  }

  template <class Hash>
  static constexpr void describe(Hash& hash) {
    describe_planes(hash);
    BvhEncoding::describe(hash);
    hash.template structure<ExactField>({&ExactField::planes, &ExactField::triangles});
  }
  static FieldUpload* upload(const ExactField& field);
};
template <>
struct GpuEncodingOf<ExactField> {
  using Encoding = ExactEncoding;
};

}  // namespace nif::kernels::gpu
