#include "kernels/cpu/exact/kernel.hpp"

#include "kernels/reference/batch.hpp"
#include "kernels/reference/exact/query.hpp"

#include "kernels/cpu/targets.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/cpu/exact/kernel.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h

#include <hwy/highway.h>

// One lane is what the reference is for.
#if HWY_TARGET != HWY_SCALAR
#include "kernels/cpu/bvh/traverse-inl.hpp"
#include "kernels/cpu/proof/walk-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace nif::kernels::cpu::HWY_NAMESPACE {

struct ExactScratch {
  RayTable rays;
  WalkLog log;
  OpenRays open;
  HardRays hard;
};
static_assert(sizeof(ExactScratch) <= kKernelScratchBytes);

HWY_NOINLINE void answer_exact_by_reference(const ExactField& field, const SegmentBatch& batch, uint32_t ray,
                                            AnswerBatch& answers) {
  const Answer answer = query(field, segment_of(batch, ray));
  answers.logit[ray] = answer.logit;
  answers.certain[ray] = answer.certain;
}

void answer_exact(const ExactField& field, const WalkGrid& grid, const SegmentBatch& batch,
                  AnswerBatch& answers, void* memory) {
  // Too few rays to fill the lanes: the reference is done before the walk in SIMD has been set up.
  constexpr uint32_t kFewRays = 2;
  if (batch.count <= kFewRays) {
    for (uint32_t i = 0; i < batch.count; ++i) answer_exact_by_reference(field, batch, i, answers);
    return;
  }
  auto& s = *static_cast<ExactScratch*>(memory);
  Walker walker(field.proof, grid, batch, answers, s.rays, s.log, s.open, s.hard);
  while (walker.walk()) {
    for (uint32_t k = 0; k < s.open.count; ++k) {
      const auto i = uint32_t(s.log.end_info[k] >> kRayShift);
      const int32_t first = s.open.first[k], last = first + s.open.runs[k] - 1;
      const Segment segment = segment_of(batch, i);
      BvhRay ray;
      prepare_ray(field.bvh, segment, ray);  // the walk takes no ray that the BVH does not
      narrow(field.proof, segment, {s.open.begin[first], s.open.end[last]}, ray);
      answers.logit[i] = traverse(field.bvh, ray) ? -kCertainLogit : kCertainLogit;
      answers.certain[i] = certain_bvh(field.bvh, segment);
    }
  }
  for (uint32_t k = 0; k < s.hard.count; ++k) answer_exact_by_reference(field, batch, s.hard.ray[k], answers);
}

}  // namespace nif::kernels::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif  // HWY_TARGET

#if HWY_ONCE
#include "kernels/cpu/dispatch-inl.hpp"

namespace nif::kernels::cpu {

SimdExactKernel::SimdExactKernel(const ExactField& field, const KernelOptions& options)
    : field_(field),
      walk_(field.proof, options.memory),
      answer_(NIF_KERNEL_FOR(Answer, answer_exact, options.isa)) {}

void SimdExactKernel::answer(const SegmentBatch& batch, AnswerBatch& answers, void* scratch) const {
  answer_(field_, walk_, batch, answers, scratch);
}

}  // namespace nif::kernels::cpu
#endif
