// Answers `segment` objects with SIMD. A batch traverses the grid, then the network answers what is open;
// hard rays and tiny batches go to the reference. Processors with VNNI (dot products of small integers) get
// versions that use it.
#include "kernels/cpu/encodings/cpu_segment.hpp"

#include "kernels/cpu/network/packed_field.hpp"
#include "kernels/cpu/simd_kernel.hpp"
#include "kernels/reference/batch.hpp"
#include "kernels/reference/encodings/reference_segment.hpp"

// AVX3_DL is AVX-512 with VNNI; plain AVX3 is for older machines.
#define HWY_WANT_AVX3_DL 1
#include "kernels/cpu/targets.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/cpu/encodings/cpu_segment.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h

#include <hwy/highway.h>

// For a single lane there is the reference.
#if HWY_TARGET != HWY_SCALAR
#include "kernels/cpu/network/network-inl.hpp"
#include "kernels/cpu/planes/hits-inl.hpp"
#include "kernels/cpu/planes/prove-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace nif::kernels::cpu::HWY_NAMESPACE {

struct Scratch {
  RayTable rays;
  IntervalLog log;
  HardRays hard;
  Pending pending;
  NetworkInputs inputs;
};
static_assert(sizeof(Scratch) <= kKernelScratchBytes);

HWY_NOINLINE void answer_by_reference(const PackedField& field, const SegmentBatch& batch, uint32_t ray,
                                      AnswerBatch& answers) {
  const Answer answer = query_as(field, segment_of(batch, ray));
  answers.logit[ray] = answer.logit;
  answers.certain[ray] = answer.certain;
}

template <bool kAvxVnni>
void answer_segments(const PackedField& field, const SegmentBatch& batch, AnswerBatch& answers,
                     void* memory) {
  if (batch.count <= kFewForTraversal) {
    for (uint32_t i = 0; i < batch.count; ++i) answer_by_reference(field, batch, i, answers);
    return;
  }
  Scratch& s = *static_cast<Scratch*>(memory);
  GridTraversal traversal(field, field.grid, batch, answers, s.rays, s.log, s.hard);
  while (traversal.fill_log())
    answer_open<kAvxVnni>(field, batch, s.log, s.pending, s.inputs, answers, s.hard);
  for (uint32_t k = 0; k < s.hard.count; ++k) answer_by_reference(field, batch, s.hard.ray[k], answers);
}

void prove_segments(const PackedField& field, const SegmentBatch& batch, AnswerBatch& answers,
                    OpenBatch& open, void* memory) {
  prove_rays(field, field.grid, batch, answers, open, memory);
}

struct SegmentHitScratch {
  HitScratch hits;
  Scratch answers;
};
static_assert(sizeof(SegmentHitScratch) <= kKernelScratchBytes);

template <bool kAvxVnni>
void intersect_segments(const PackedField& field, const SegmentBatch& batch, const float* limit,
                        HitBatch& hits, void* memory) {
  auto& s = *static_cast<SegmentHitScratch*>(memory);
  hits_by_planes(
      field, field.grid, batch, limit, hits, s.hits,
      [&](const SegmentBatch& questions, AnswerBatch& answers) {
        answer_segments<kAvxVnni>(field, questions, answers, &s.answers);
      },
      [&](uint32_t i) { return intersect_as(field, segment_of(batch, i), limit[i]); });
}

constexpr SimdFunctions<PackedField> kSegmentFunctions = {
    .answer = answer_segments<false>, .intersect = intersect_segments<false>, .prove = prove_segments};
#if HWY_TARGET == HWY_AVX2
constexpr SimdFunctions<PackedField> kVnniSegmentFunctions = {
    .answer = answer_segments<true>, .intersect = intersect_segments<true>, .prove = prove_segments};
#endif

}  // namespace nif::kernels::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif  // HWY_TARGET

#if HWY_ONCE
#include "kernels/cpu/dispatch-inl.hpp"

namespace nif::kernels::cpu {
namespace {

/// The instruction set must be available().
const SimdFunctions<PackedField>& segment_functions_for(Isa isa) {
#if HWY_TARGETS & HWY_AVX2
  if (isa == Isa::avx2 && has_avx_vnni()) return N_AVX2::kVnniSegmentFunctions;
#endif
#if HWY_TARGETS & HWY_AVX3_DL
  if (isa == Isa::avx512 && has_avx3_dl()) return N_AVX3_DL::kSegmentFunctions;
#endif
  return NIF_FUNCTIONS_FOR(SimdFunctions<PackedField>, kSegmentFunctions, isa);
}

}  // namespace

KernelPointer make_kernel(const SegmentField& field, const KernelOptions& options) {
  return hold_kernel<SimdKernel<PackedField>>(options.memory, segment_functions_for(options.isa),
                                              [&] { return PackedField(field, options); });
}

}  // namespace nif::kernels::cpu
#endif
