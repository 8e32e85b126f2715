// What one thread needs to answer a batch of rays. Queries allocate nothing: this memory comes from the
// caller (scratch) or from the device, which keeps some ready.
#pragma once

#include "kernels/reference/object_kernel.hpp"
#include "kernels/reference/scene.hpp"
#include "kernels/reference/scene_hit.hpp"
#include "kernels/reference/top_level.hpp"

namespace nif::runtime {

using kernels::Cursor;
using kernels::kBatchRays;

/// An instance to be asked about a ray of the batch.
struct Pair {
  uint32_t object, instance, ray;
};

/// Nothing in it is initialised, and only what a batch needs is touched.
struct alignas(64) WorkArea {
  kernels::SegmentBatch rays;  ///< the batch, in world space
  uint32_t mask[kBatchRays];   ///< of each ray, if the query has masks

  // The batch's answers. Of the logits the sign always counts, the rest where details are asked for.
  kernels::AnswerBatch answers;
  float probability[kBatchRays];
  uint8_t visible[kBatchRays];
  uint64_t fallback_rays[kBatchRays];  ///< numbers within the query

  // For scenes of several instances.
  float inverse[3][kBatchRays];  ///< BoxRay
  Cursor cursors[kBatchRays];
  uint16_t active[kBatchRays];  ///< rays that are not yet decided
  Pair pairs[2][kBatchRays];
  kernels::CombinedAnswer combined[kBatchRays];

  // Rays as one object sees them, and what it answers.
  kernels::SegmentBatch object_rays;
  kernels::AnswerBatch object_answers;

  // For rays that stay open: the part of each that has to be looked at, and what one object says of that.
  kernels::OpenBatch open, object_open;
  uint32_t open_rays[kBatchRays];      ///< numbers within the query
  uint32_t open_instance[kBatchRays];  ///< the one that leaves the ray open; kernels::kNoInstance: several

  // For first hits: of the batch, and of one object.
  kernels::HitBatch hits, object_hits;
  uint32_t hit_instance[kBatchRays];  ///< kernels::kNoInstance: none
  float hit_limit[kBatchRays];        ///< [as object_hits]

  alignas(64) std::byte kernel_scratch[kernels::kKernelScratchBytes];
};

}  // namespace nif::runtime
