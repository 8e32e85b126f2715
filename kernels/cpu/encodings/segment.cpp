// Answers `segment` objects with SIMD. A batch traverses the grid, then the network answers what is open;
// hard rays and tiny batches go to the reference. Processors with VNNI (dot products of small integers) get
// versions that use it.
#include "kernels/cpu/encodings/segment.hpp"

#include "kernels/reference/batch.hpp"
#include "kernels/reference/encodings/segment.hpp"

// AVX3_DL is AVX-512 with VNNI; plain AVX3 is for older machines.
#define HWY_WANT_AVX3_DL 1
#include "kernels/cpu/targets.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/cpu/encodings/segment.cpp"
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
  WalkLog log;
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
void answer_with(const PackedField& field, const SegmentBatch& batch, AnswerBatch& answers, void* memory) {
  // Too few rays to fill the lanes: the reference is faster than setting up the SIMD traversal.
  constexpr uint32_t kFewRays = 2;
  if (batch.count <= kFewRays) {
    for (uint32_t i = 0; i < batch.count; ++i) answer_by_reference(field, batch, i, answers);
    return;
  }
  Scratch& s = *static_cast<Scratch*>(memory);
  Walker walker(field, field.walk, batch, answers, s.rays, s.log, s.hard);
  while (walker.walk())
    answer_open<kAvxVnni>(field, batch, s.log, s.log.open, s.pending, s.inputs, answers, s.hard);
  for (uint32_t k = 0; k < s.hard.count; ++k) answer_by_reference(field, batch, s.hard.ray[k], answers);
}

void answer_segments(const PackedField& field, const SegmentBatch& batch, AnswerBatch& answers,
                     void* memory) {
  answer_with<false>(field, batch, answers, memory);
}
void prove_segments(const PackedField& field, const SegmentBatch& batch, AnswerBatch& answers,
                    OpenBatch& open, void* memory) {
  prove_rays(field, field.walk, batch, answers, open, memory);
}
struct SegmentHitScratch {
  HitScratch hits;
  Scratch answers;
};
static_assert(sizeof(SegmentHitScratch) <= kKernelScratchBytes);

/// `answer`: what answers the questions to the network.
void intersect_segments(const PackedField& field, AnswerSegments answer, const SegmentBatch& batch,
                        const float* limit, HitBatch& hits, void* memory) {
  auto& s = *static_cast<SegmentHitScratch*>(memory);
  hits_by_planes(
      field, field.walk, batch, limit, hits, s.hits,
      [&](const SegmentBatch& questions, AnswerBatch& answers) {
        answer(field, questions, answers, &s.answers);
      },
      [&](uint32_t i) { return intersect_as(field, segment_of(batch, i), limit[i]); });
}
#if HWY_TARGET == HWY_AVX2
void answer_segments_vnni(const PackedField& field, const SegmentBatch& batch, AnswerBatch& answers,
                          void* memory) {
  answer_with<true>(field, batch, answers, memory);
}
#endif

}  // namespace nif::kernels::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif  // HWY_TARGET

#if HWY_ONCE
#include "kernels/cpu/dispatch-inl.hpp"

namespace nif::kernels::cpu {
namespace {

/// The instruction set must be available().
AnswerSegments kernel_for(Isa isa) {
#if HWY_TARGETS & HWY_AVX2
  if (isa == Isa::avx2 && has_avx_vnni()) return N_AVX2::answer_segments_vnni;
#endif
#if HWY_TARGETS & HWY_AVX3_DL
  if (isa == Isa::avx512 && has_avx3_dl()) return N_AVX3_DL::answer_segments;
#endif
  return NIF_KERNEL_FOR(AnswerSegments, answer_segments, isa);
}

using IntersectSegments = void (*)(const PackedField&, AnswerSegments, const SegmentBatch&, const float*,
                                   HitBatch&, void*);

IntersectSegments intersector_for(Isa isa) {
#if HWY_TARGETS & HWY_AVX3_DL
  if (isa == Isa::avx512 && has_avx3_dl()) return N_AVX3_DL::intersect_segments;
#endif
  return NIF_KERNEL_FOR(IntersectSegments, intersect_segments, isa);
}

using ProveSegments = void (*)(const PackedField&, const SegmentBatch&, AnswerBatch&, OpenBatch&, void*);

ProveSegments prover_for(Isa isa) {
#if HWY_TARGETS & HWY_AVX3_DL
  if (isa == Isa::avx512 && has_avx3_dl()) return N_AVX3_DL::prove_segments;
#endif
  return NIF_KERNEL_FOR(ProveSegments, prove_segments, isa);
}

}  // namespace

SimdSegmentKernel::SimdSegmentKernel(const SegmentField& field, const KernelOptions& options)
    : field_(field, options),
      answer_(kernel_for(options.isa)),
      prove_(prover_for(options.isa)),
      intersect_(intersector_for(options.isa)) {}

void SimdSegmentKernel::answer(const SegmentBatch& batch, AnswerBatch& answers, void* scratch) const {
  answer_(field_, batch, answers, scratch);
}

void SimdSegmentKernel::prove(const SegmentBatch& batch, AnswerBatch& answers, OpenBatch& open,
                              void* scratch) const {
  prove_(field_, batch, answers, open, scratch);
}

void SimdSegmentKernel::intersect(const SegmentBatch& batch, const float* limit, HitBatch& hits,
                                  void* scratch) const {
  intersect_(field_, answer_, batch, limit, hits, scratch);
}

}  // namespace nif::kernels::cpu
#endif
