#include "kernels/cpu/bvh/kernel.hpp"

#include "kernels/reference/batch.hpp"
#include "kernels/reference/bvh/hit.hpp"

#include "kernels/cpu/targets.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/cpu/bvh/kernel.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h

#include <hwy/highway.h>

// One lane is what the reference is for.
#if HWY_TARGET != HWY_SCALAR
#include "kernels/cpu/bvh/traverse-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace nif::kernels::cpu::HWY_NAMESPACE {

static_assert(sizeof(BvhScratch) <= kKernelScratchBytes);

void answer_bvh(const BvhTree& tree, const SegmentBatch& batch, AnswerBatch& answers, void* memory) {
  traverse(tree, batch, batch.tmin, batch.tmax, answers, *static_cast<BvhScratch*>(memory));
}

struct BvhIntersectScratch {
  float leave[kBatchRays];
  BvhHitScratch hits;
};
static_assert(sizeof(BvhIntersectScratch) <= kKernelScratchBytes);

void intersect_bvh(const BvhTree& tree, const SegmentBatch& batch, const float* limit, HitBatch& hits,
                   void* memory) {
  auto& s = *static_cast<BvhIntersectScratch*>(memory);
  for (uint32_t i = 0; i < batch.count; ++i) s.leave[i] = min_of(next_above(limit[i]), batch.tmax[i]);
  traverse_to_hits(tree, batch, batch.tmin, s.leave, hits, s.hits);
}

}  // namespace nif::kernels::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif  // HWY_TARGET

#if HWY_ONCE
#include "kernels/cpu/dispatch-inl.hpp"

namespace nif::kernels::cpu {

SimdBvhKernel::SimdBvhKernel(const BvhField& field, const KernelOptions& options)
    : tree_(tree_of(field)),
      answer_(NIF_KERNEL_FOR(Answer, answer_bvh, options.isa)),
      intersect_(NIF_KERNEL_FOR(Intersect, intersect_bvh, options.isa)) {}

void SimdBvhKernel::answer(const SegmentBatch& batch, AnswerBatch& answers, void* scratch) const {
  answer_(tree_, batch, answers, scratch);
}

void SimdBvhKernel::intersect(const SegmentBatch& batch, const float* limit, HitBatch& hits,
                              void* scratch) const {
  intersect_(tree_, batch, limit, hits, scratch);
}

}  // namespace nif::kernels::cpu
#endif
