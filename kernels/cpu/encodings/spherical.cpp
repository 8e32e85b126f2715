// Answers `spherical` objects with SIMD. Only answers for several rays are in SIMD (answer-inl.hpp); a single
// ray and first hits go to the reference.
#include "kernels/cpu/encodings/spherical.hpp"

#include "kernels/cpu/spherical/single_weights.hpp"
#include "kernels/reference/batch.hpp"
#include "kernels/reference/spherical/hit.hpp"
#include "kernels/reference/spherical/query.hpp"

#include "kernels/cpu/targets.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/cpu/encodings/spherical.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h

#include <hwy/highway.h>

// For a single lane there is the reference.
#if HWY_TARGET != HWY_SCALAR
#include "kernels/cpu/spherical/answer-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace nif::kernels::cpu::HWY_NAMESPACE {

void answer_spherical(const SphericalField& field, const SegmentBatch& batch, AnswerBatch& answers,
                      void* memory) {
  // Too few rays to fill the lanes.
  constexpr uint32_t kFewRays = 1;
  if (batch.count <= kFewRays) {
    for (uint32_t i = 0; i < batch.count; ++i) {
      const Answer answer =
          query(field, {{batch.origin[0][i], batch.origin[1][i], batch.origin[2][i]},
                        {batch.direction[0][i], batch.direction[1][i], batch.direction[2][i]},
                        batch.tmin[i],
                        batch.tmax[i]});
      answers.logit[i] = answer.logit;
      answers.certain[i] = answer.certain;
    }
    return;
  }
  NoClock clock;
  answer_batch(field, batch, answers, memory, clock);
}

}  // namespace nif::kernels::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif  // HWY_TARGET

#if HWY_ONCE
#include "kernels/cpu/dispatch-inl.hpp"

namespace nif::kernels::cpu {

SimdSphericalKernel::SimdSphericalKernel(const SphericalField& field, const KernelOptions& options)
    : field_(with_single_weights(field, options.copies)),
      answer_(NIF_KERNEL_FOR(Answer, answer_spherical, options.isa)) {}

void SimdSphericalKernel::answer(const SegmentBatch& batch, AnswerBatch& answers, void* scratch) const {
  answer_(field_, batch, answers, scratch);
}

void SimdSphericalKernel::intersect(const SegmentBatch& batch, const float* limit, HitBatch& hits,
                                    void*) const {
  intersect_each(batch, limit, hits, [&](const Segment& segment, float nearest) {
    return kernels::intersect(field_, segment, nearest);
  });
}

}  // namespace nif::kernels::cpu
#endif
