// The `exact` objects on GPUs: the walk of kernels/gpu/proof, and the traversal of kernels/gpu/bvh.
#pragma once

#include "kernels/gpu/bvh/kernels.hpp"
#include "kernels/gpu/proof/leaping_walk.hpp"
#include "kernels/reference/exact/hit.hpp"
#include "kernels/reference/exact/query.hpp"

namespace nif::kernels::gpu {

/// In device memory. The grid's own arrays are not there: `walk` says what they do.
struct DeviceExactField : ExactField {
  WalkWords walk;
};

/// `stack` as for meets_nodes().
template <uint32_t kStride>
NIF_HOST_DEVICE ObjectAnswer answer_exact_ray(const DeviceExactField& field, const Segment& segment,
                                              uint32_t* stack) {
  WalkResult walk;
  OpenInterval open;
  walk_object(field.proof, field.walk, segment, walk, KeepOpen{open});
  BvhRay ray;
  if (!prepare_ray(field.bvh, segment, ray)) {
    const Answer none = answer_no_ray(segment);
    return {none.logit, none.certain};
  }
  if (walk.certain) return {walk.verdict == Verdict::visible ? kCertainLogit : -kCertainLogit, true};
  if (walk.verdict == Verdict::ambiguous) cull(field.proof, segment, 0, open, ray);
  return {meets_nodes<kStride>(field.bvh, ray, stack) ? -kCertainLogit : kCertainLogit,
          certain_bvh(field.bvh, segment)};
}

/// As intersect(). `stack` as for meets_nodes().
template <uint32_t kStride>
NIF_HOST_DEVICE Hit find_exact_hit(const DeviceExactField& field, const Segment& segment, float limit,
                                   uint32_t* stack) {
  WalkResult walk;
  OpenInterval open;
  walk_object<true>(field.proof, field.walk, segment, walk, KeepOpen{open});
  BvhRay ray;
  if (!prepare_ray(field.bvh, segment, ray)) return no_hit(answer_no_ray(segment).certain);
  if (!cull_to_hit(field.proof, segment, 0, walk, open, ray)) return no_hit(true);
  return nearest_bvh_hit<kStride>(field.bvh, segment, limit, ray, stack);
}

}  // namespace nif::kernels::gpu
