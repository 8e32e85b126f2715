// The traversal, compiled once for each instruction set.
#include "kernels/cpu/bvh/kernel.hpp"

#include "kernels/reference/batch.hpp"
#include "kernels/reference/bvh/query.hpp"

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

void answer_bvh(const BvhField& field, const SegmentBatch& batch, AnswerBatch& answers) {
  for (uint32_t i = 0; i < batch.count; ++i) {
    const Segment segment = segment_of(batch, i);
    BvhRay ray;
    Answer answer;
    if (prepare_ray(field, segment, ray)) {
      const bool visible = !traverse(field, ray);
      answer = {visible, certain_bvh(field, segment), visible ? kCertainLogit : -kCertainLogit};
    } else {
      answer = answer_no_ray(segment);
    }
    answers.logit[i] = answer.logit;
    answers.certain[i] = answer.certain;
  }
}

}  // namespace nif::kernels::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif  // HWY_TARGET

#if HWY_ONCE
#include "kernels/cpu/dispatch-inl.hpp"

namespace nif::kernels::cpu {

SimdBvhKernel::SimdBvhKernel(const BvhField& field, const KernelOptions& options)
    : field_(field), answer_(NIF_KERNEL_FOR(Answer, answer_bvh, options.isa)) {}

void SimdBvhKernel::answer(const SegmentBatch& batch, AnswerBatch& answers, void*) const {
  answer_(field_, batch, answers);
}

}  // namespace nif::kernels::cpu
#endif
