#include "kernels/cpu/segment/kernel.hpp"

#include "kernels/reference/batch.hpp"
#include "kernels/reference/segment/query.hpp"

// AVX3_DL is AVX-512 with VNNI; plain AVX3 is for the machines before it.
#define HWY_WANT_AVX3_DL 1
#include "kernels/cpu/targets.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/cpu/segment/kernel.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h

#include <hwy/highway.h>
#if HWY_ONCE && HWY_ARCH_X86
#include <cpuid.h>
#endif

// One lane is what the reference is for.
#if HWY_TARGET != HWY_SCALAR
#include "kernels/cpu/segment/network-inl.hpp"
#include "kernels/cpu/segment/walk-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace nif::kernels::cpu::HWY_NAMESPACE {

struct Scratch {
  Queue queue;
  Slots slots;
  WalkLog log;
  OpenRays open;
  HardRays hard;
  Pending pending;
  NetworkInputs inputs;
};
static_assert(sizeof(Scratch) <= kKernelScratchBytes);

HWY_NOINLINE void answer_by_reference(const PackedField& field, const SegmentBatch& batch, uint32_t ray,
                                      AnswerBatch& answers) {
  const Answer answer = query_segment(field, segment_of(batch, ray));
  answers.logit[ray] = answer.logit;
  answers.certain[ray] = answer.certain;
}

template <bool kAvxVnni>
void answer_with(const PackedField& field, const SegmentBatch& batch, AnswerBatch& answers, void* memory) {
  // Too few rays to fill the lanes: the reference is done before the walk in SIMD has been set up.
  constexpr uint32_t kFewRays = 2;
  if (batch.count <= kFewRays) {
    for (uint32_t i = 0; i < batch.count; ++i) answer_by_reference(field, batch, i, answers);
    return;
  }
  Scratch& s = *static_cast<Scratch*>(memory);
  Walker walker(field, field.walk, batch, answers, s.queue, s.slots, s.log, s.open, s.hard);
  while (walker.walk())
    answer_open<kAvxVnni>(field, batch, s.log, s.open, s.pending, s.inputs, answers, s.hard);
  for (uint32_t k = 0; k < s.hard.count; ++k) answer_by_reference(field, batch, s.hard.ray[k], answers);
}

void answer_segments(const PackedField& field, const SegmentBatch& batch, AnswerBatch& answers,
                     void* memory) {
  answer_with<false>(field, batch, answers, memory);
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
namespace nif::kernels::cpu {
namespace {

using AnswerSegments = void (*)(const PackedField&, const SegmentBatch&, AnswerBatch&, void*);

#if HWY_TARGETS & HWY_AVX2
/// Not a name that every compiler's __builtin_cpu_supports knows.
bool has_avx_vnni() {
  unsigned a, b, c, d;
  return __get_cpuid_count(7, 1, &a, &b, &c, &d) && (a & 1u << 4) != 0;
}
#endif

/// Null where this build or this machine has none.
AnswerSegments kernel_for(Isa isa) {
  switch (isa) {
    case Isa::sse4:
#if HWY_TARGETS & HWY_SSE4
      if (__builtin_cpu_supports("sse4.2") && __builtin_cpu_supports("popcnt"))
        return N_SSE4::answer_segments;
#endif
      return nullptr;
    case Isa::avx2:
#if HWY_TARGETS & HWY_AVX2
      if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && __builtin_cpu_supports("bmi2"))
        return has_avx_vnni() ? N_AVX2::answer_segments_vnni : N_AVX2::answer_segments;
#endif
      return nullptr;
    case Isa::avx512:
#if HWY_TARGETS & HWY_AVX3_DL
      if (__builtin_cpu_supports("avx512vnni") && __builtin_cpu_supports("avx512vbmi2") &&
          __builtin_cpu_supports("avx512vpopcntdq") && __builtin_cpu_supports("avx512bitalg") &&
          __builtin_cpu_supports("gfni") && __builtin_cpu_supports("vpclmulqdq"))
        return N_AVX3_DL::answer_segments;
#endif
#if HWY_TARGETS & HWY_AVX3
      if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
          __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512bw") &&
          __builtin_cpu_supports("avx512cd"))
        return N_AVX3::answer_segments;
#endif
      return nullptr;
    case Isa::neon:
#if HWY_ARCH_ARM_A64 && HWY_TARGETS & HWY_NEON
      return N_NEON::answer_segments;
#else
      return nullptr;
#endif
  }
  return nullptr;
}

}  // namespace

bool available(Isa isa) { return kernel_for(isa) != nullptr; }

SimdSegmentKernel::SimdSegmentKernel(const SegmentField& field, size_t ample_bytes, Isa isa,
                                     std::pmr::memory_resource* memory)
    : field_(field, ample_bytes, memory), answer_(kernel_for(isa)) {}

void SimdSegmentKernel::answer(const SegmentBatch& batch, AnswerBatch& answers, void* scratch) const {
  answer_(field_, batch, answers, scratch);
}

}  // namespace nif::kernels::cpu
#endif
