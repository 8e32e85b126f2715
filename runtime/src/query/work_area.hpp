// All memory that one thread needs to answer a batch of rays. Queries allocate nothing: the memory comes from
// the caller (scratch) or from the device, which keeps some ready.
#pragma once

#include "kernels/reference/object_kernel.hpp"
#include "kernels/reference/scene.hpp"
#include "kernels/reference/scene_hit.hpp"
#include "kernels/reference/top_level.hpp"

namespace nif::runtime {

using kernels::Cursor;
using kernels::kBatchRays;

/// A ray of the batch, and an instance to test it against.
struct Pair {
  uint32_t object, instance, ray;
};

/// Nothing in it is initialised, and a batch touches only what it needs.
struct alignas(64) WorkArea {
  kernels::SegmentBatch rays;  ///< the batch, in world space
  uint32_t mask[kBatchRays];   ///< the rays' masks, if the query has any

  // The batch's answers. The sign of a logit is always valid, its value only if details are wanted.
  kernels::AnswerBatch answers;
  float probability[kBatchRays];
  uint8_t visible[kBatchRays];
  uint64_t fallback_rays[kBatchRays];  ///< numbers within the query

  // For scenes of several instances.
  float inverse[3][kBatchRays];  ///< BoxRay
  Cursor cursors[kBatchRays];
  uint16_t active[kBatchRays];  ///< undecided rays
  Pair pairs[2][kBatchRays];
  kernels::CombinedAnswer combined[kBatchRays];

  // Rays in one object's space, and its answers.
  kernels::SegmentBatch object_rays;
  kernels::AnswerBatch object_answers;

  // The intervals in which rays stay open: of the batch, and according to one object.
  kernels::OpenBatch open, object_open;
  uint32_t open_rays[kBatchRays];      ///< numbers within the query
  uint32_t open_instance[kBatchRays];  ///< the only one with the ray open; kernels::kNoInstance: several

  // First hits: of the batch, and of one object.
  kernels::HitBatch hits, object_hits;
  uint32_t hit_instance[kBatchRays];  ///< kernels::kNoInstance: none
  float hit_limit[kBatchRays];        ///< [as object_hits]

  alignas(64) std::byte kernel_scratch[kernels::kKernelScratchBytes];
};

}  // namespace nif::runtime
