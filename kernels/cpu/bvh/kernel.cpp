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

}  // namespace nif::kernels::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif  // HWY_TARGET

#if HWY_ONCE
#include "kernels/cpu/dispatch-inl.hpp"

namespace nif::kernels::cpu {

SimdBvhKernel::SimdBvhKernel(const BvhField& field, const KernelOptions& options)
    : tree_(tree_of(field)), answer_(NIF_KERNEL_FOR(Answer, answer_bvh, options.isa)) {}

void SimdBvhKernel::answer(const SegmentBatch& batch, AnswerBatch& answers, void* scratch) const {
  answer_(tree_, batch, answers, scratch);
}

void SimdBvhKernel::intersect(const SegmentBatch& batch, const float* limit, HitBatch& hits, void*) const {
  intersect_each(batch, limit, hits, [&](const Segment& segment, float nearest) {
    return kernels::intersect(tree_.field, segment, nearest);
  });
}

}  // namespace nif::kernels::cpu
#endif
