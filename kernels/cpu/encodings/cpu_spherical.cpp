// Answers `spherical` objects with SIMD. Only answers for several rays are in SIMD (answer-inl.hpp); a single
// ray and first hits go to the reference.
#include "kernels/cpu/encodings/cpu_spherical.hpp"

#include "kernels/cpu/simd_kernel.hpp"
#include "kernels/cpu/spherical/single_weights.hpp"
#include "kernels/reference/batch.hpp"
#include "kernels/reference/spherical/spherical_query.hpp"

#include "kernels/cpu/targets.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/cpu/encodings/cpu_spherical.cpp"
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

constexpr SimdFunctions<SphericalField> kSphericalFunctions = {.answer = answer_spherical,
                                                               .intersect = nullptr};

}  // namespace nif::kernels::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif  // HWY_TARGET

#if HWY_ONCE
#include "kernels/cpu/dispatch-inl.hpp"

namespace nif::kernels::cpu {
namespace {

void intersect_by_reference(const SphericalField& field, const SegmentBatch& batch, const float* limit,
                            HitBatch& hits, void*) {
  intersect_each(batch, limit, hits, [&](const Segment& segment, float nearest) {
    return kernels::intersect(field, segment, nearest);
  });
}

}  // namespace

KernelPointer make_kernel(const SphericalField& field, const KernelOptions& options) {
  auto functions = NIF_FUNCTIONS_FOR(SimdFunctions<SphericalField>, kSphericalFunctions, options.isa);
  functions.intersect = intersect_by_reference;
  return hold_kernel<SimdKernel<SphericalField>>(options.memory, functions,
                                                 [&] { return with_single_weights(field, options.copies); });
}

}  // namespace nif::kernels::cpu
#endif
