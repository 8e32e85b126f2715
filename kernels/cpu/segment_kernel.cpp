#include "kernels/cpu/segment_kernel.hpp"

#include "kernels/reference/segment.hpp"

// AVX3_DL is AVX-512 with VNNI; plain AVX3 is for the machines before it.
#define HWY_WANT_AVX3_DL 1
#define HWY_DISABLED_TARGETS HWY_SSSE3
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/cpu/segment_kernel.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h

#include <hwy/highway.h>

// One lane is what the reference is for.
#if HWY_TARGET != HWY_SCALAR
#include "kernels/cpu/segment_network-inl.hpp"
#include "kernels/cpu/segment_walk-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace nif::kernels::cpu::HWY_NAMESPACE {

struct Scratch {
  Queue queue;
  Slots slots;
  WalkLog log;
  Pending pending;
  NetworkInputs inputs;
};
static_assert(sizeof(Scratch) <= kKernelScratchBytes);

/// Takes what the walk leaves open.
class Rest {
 public:
  Rest(const SegmentField& field, const FeatureGrid& features, const SegmentBatch& batch, Scratch& scratch,
       AnswerBatch& answers)
      : field_(field),
        features_(features),
        batch_(batch),
        pending_(scratch.pending),
        inputs_(scratch.inputs),
        answers_(answers) {
    pending_.count = 0;
  }

  /// A ray that the walk in SIMD does not take: far away, not finite, or through more runs than it has room
  /// for.
  HWY_NOINLINE void hard(uint32_t ray) {
    Segment segment;
    for (uint32_t a = 0; a < 3; ++a) {
      segment.origin[a] = batch_.origin[a][ray];
      segment.direction[a] = batch_.direction[a][ray];
    }
    segment.tmin = batch_.tmin[ray];
    segment.tmax = batch_.tmax[ray];
    const Answer answer = query_segment(field_, segment);
    answers_.logit[ray] = answer.logit;
    answers_.certain[ray] = answer.certain;
  }

  /// `t`: the begins and ends of its runs in turn; `turns` of them were met, and the last run may end with
  /// the ray.
  HWY_INLINE void ambiguous(const Queue& queue, uint32_t queued, int32_t seen, bool starts_in_surface,
                            uint32_t turns, const float* t) {
    const uint32_t lane = pending_.count;
    const auto ray = uint32_t(queue.ray[queued]);
    for (uint32_t a = 0; a < 3; ++a) {
      const bool flat = queue.origin[a][queued] == kFlatOrigin;
      pending_.origin[a][lane] = (batch_.origin[a][ray] - field_.origin[a]) * field_.voxels_per_unit;
      pending_.direction[a][lane] = flat ? 0.0f : batch_.direction[a][ray] * field_.voxels_per_unit;
    }
    const uint32_t runs = (turns + 1) / 2;
    float surface_t = 0;
    for (uint32_t r = 0; r < runs; ++r) {
      pending_.begin[r][lane] = t[2 * r];
      pending_.end[r][lane] = t[2 * r + 1];
      surface_t += t[2 * r + 1] - t[2 * r];
    }
    pending_.surface_t[lane] = surface_t;
    pending_.run_count[lane] = int32_t(runs);
    const int32_t flags = queue.flags[queued];
    const bool starts = starts_in_surface && !(flags & kEntersGrid);
    const bool ends = turns % 2 == 1 && !(flags & kLeavesGrid);
    pending_.flags[lane] = (seen & kOutsideBit ? 127 : 0) | (seen & kInsideBit ? 127 << 8 : 0) |
                           (starts ? 127 << 16 : 0) | (ends ? 127 << 24 : 0);
    pending_.ray[lane] = ray;
    if (++pending_.count == kLanes) flush();
  }

  void flush() {
    if (pending_.count != 0) answer_pending(field_, features_, pending_, inputs_, answers_);
  }

 private:
  const SegmentField& field_;
  const FeatureGrid& features_;
  const SegmentBatch& batch_;
  Pending& pending_;
  NetworkInputs& inputs_;
  AnswerBatch& answers_;
};

void answer_segments(const SegmentField& field, const WalkGrid& grid, const FeatureGrid& features,
                     const SegmentBatch& batch, AnswerBatch& answers, void* memory) {
  Scratch& scratch = *static_cast<Scratch*>(memory);
  Rest rest(field, features, batch, scratch, answers);
  // Too few rays to fill the lanes: the reference is done before the walk in SIMD has been set up.
  constexpr uint32_t kFewRays = 2;
  if (batch.count <= kFewRays) {
    for (uint32_t i = 0; i < batch.count; ++i) rest.hard(i);
    return;
  }
  Walker<Rest> walker(field, grid, scratch.queue, scratch.slots, scratch.log, rest);
  walker.walk(batch, answers);
  rest.flush();
}

}  // namespace nif::kernels::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif  // HWY_TARGET

#if HWY_ONCE
namespace nif::kernels::cpu {
namespace {

using AnswerSegments = void (*)(const SegmentField&, const WalkGrid&, const FeatureGrid&, const SegmentBatch&,
                                AnswerBatch&, void*);

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
        return N_AVX2::answer_segments;
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
  }
  return nullptr;
}

}  // namespace

bool available(Isa isa) { return kernel_for(isa) != nullptr; }

SimdSegmentKernel::SimdSegmentKernel(const SegmentField& field, Isa isa, std::pmr::memory_resource* memory)
    : field_(field), grid_(field, memory), features_(field, memory), answer_(kernel_for(isa)) {}

void SimdSegmentKernel::answer(const SegmentBatch& batch, AnswerBatch& answers, void* scratch) const {
  answer_(field_, grid_, features_, batch, answers, scratch);
}

}  // namespace nif::kernels::cpu
#endif
