#include "kernels/cpu/exact/kernel.hpp"

#include "kernels/reference/batch.hpp"
#include "kernels/reference/exact/hit.hpp"
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
  HullLog log;
  HardRays hard;
  // Rays that are left to the triangles, and where boxes count for them.
  SegmentBatch left;
  float enter[kBatchRays], leave[kBatchRays];
  AnswerBatch answers;
  BvhScratch bvh;
};
static_assert(sizeof(ExactScratch) <= kKernelScratchBytes);

/// Answers the rays that a walk has left open.
HWY_INLINE void answer_left(const PackedExactField& packed, const SegmentBatch& batch, ExactScratch& s,
                            AnswerBatch& answers) {
  s.left.count = s.log.count;
  for (uint32_t k = 0; k < s.log.count; ++k) {
    const Segment segment = segment_of(batch, s.log.ray(k));
    set_segment(s.left, k, segment);
    const bool culled = is_culled(packed.field.proof, segment);
    s.enter[k] = culled ? s.log.begin[k] : segment.tmin;
    s.leave[k] = culled ? s.log.end[k] : segment.tmax;
  }
  traverse(packed.tree, s.left, s.enter, s.leave, s.answers, s.bvh);
  for (uint32_t k = 0; k < s.log.count; ++k) {
    const uint32_t i = s.log.ray(k);
    answers.logit[i] = s.answers.logit[k];
    answers.certain[i] = s.answers.certain[k];
  }
}

struct ExactHitScratch {
  RayTable rays;
  FirstLog log;
  HardRays hard;
  // Rays that do not surely miss, and where boxes count for them.
  SegmentBatch left;
  float enter[kBatchRays], leave[kBatchRays];
  HitBatch hits;
  BvhHitScratch bvh;
};
static_assert(sizeof(ExactHitScratch) <= kKernelScratchBytes);

/// So few rays are not worth a walk: their triangles give the same answers.
constexpr uint32_t kFewRays = 16;

HWY_NOINLINE void intersect_exact_by_reference(const ExactField& field, const SegmentBatch& batch,
                                               uint32_t ray, float limit, HitBatch& hits) {
  set_hit(hits, ray, intersect(field, segment_of(batch, ray), limit));
}

void intersect_exact(const PackedExactField& packed, const SegmentBatch& batch, const float* limit,
                     HitBatch& hits, void* memory) {
  auto& s = *static_cast<ExactHitScratch*>(memory);
  if (batch.count <= kFewRays) {
    for (uint32_t i = 0; i < batch.count; ++i) s.leave[i] = min_of(next_above(limit[i]), batch.tmax[i]);
    traverse_to_hits(packed.tree, batch, batch.tmin, s.leave, hits, s.bvh);
    return;
  }
  fill_hits(hits, batch.count, no_hit(true));
  Walker walker(packed.field.proof, packed.walk, batch, s.bvh.answers, s.rays, s.log, s.hard);
  while (walker.walk()) {
    s.left.count = s.log.count;
    for (uint32_t k = 0; k < s.log.count; ++k) {
      const uint32_t i = s.log.ray(k);
      const Segment segment = segment_of(batch, i);
      set_segment(s.left, k, segment);
      const bool culled = is_culled(packed.field.proof, segment);
      s.enter[k] = culled ? s.log.begin[k] : segment.tmin;
      s.leave[k] = min_of(next_above(limit[i]), culled ? s.log.end[k] : segment.tmax);
    }
    traverse_to_hits(packed.tree, s.left, s.enter, s.leave, s.hits, s.bvh);
    for (uint32_t k = 0; k < s.log.count; ++k) set_hit(hits, s.log.ray(k), hit_of(s.hits, k));
  }
  for (uint32_t k = 0; k < s.hard.count; ++k)
    intersect_exact_by_reference(packed.field, batch, s.hard.ray[k], limit[s.hard.ray[k]], hits);
}

HWY_NOINLINE void answer_exact_by_reference(const ExactField& field, const SegmentBatch& batch, uint32_t ray,
                                            AnswerBatch& answers) {
  const Answer answer = query(field, segment_of(batch, ray));
  answers.logit[ray] = answer.logit;
  answers.certain[ray] = answer.certain;
}

void answer_exact(const PackedExactField& packed, const SegmentBatch& batch, AnswerBatch& answers,
                  void* memory) {
  auto& s = *static_cast<ExactScratch*>(memory);
  if (batch.count <= kFewRays) {
    traverse(packed.tree, batch, batch.tmin, batch.tmax, answers, s.bvh);
    return;
  }
  Walker walker(packed.field.proof, packed.walk, batch, answers, s.rays, s.log, s.hard);
  while (walker.walk()) answer_left(packed, batch, s, answers);
  for (uint32_t k = 0; k < s.hard.count; ++k)
    answer_exact_by_reference(packed.field, batch, s.hard.ray[k], answers);
}

}  // namespace nif::kernels::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif  // HWY_TARGET

#if HWY_ONCE
#include "kernels/cpu/dispatch-inl.hpp"

namespace nif::kernels::cpu {

SimdExactKernel::SimdExactKernel(const ExactField& field, const KernelOptions& options)
    : packed_{field, WalkGrid(field.proof, options.memory, options.most_without_bricks), tree_of(field.bvh)},
      answer_(NIF_KERNEL_FOR(Answer, answer_exact, options.isa)),
      intersect_(NIF_KERNEL_FOR(Intersect, intersect_exact, options.isa)) {}

void SimdExactKernel::answer(const SegmentBatch& batch, AnswerBatch& answers, void* scratch) const {
  answer_(packed_, batch, answers, scratch);
}

void SimdExactKernel::intersect(const SegmentBatch& batch, const float* limit, HitBatch& hits,
                                void* scratch) const {
  intersect_(packed_, batch, limit, hits, scratch);
}

}  // namespace nif::kernels::cpu
#endif
