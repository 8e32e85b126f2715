// Answers `exact` objects with SIMD. A batch traverses the grid; rays that stay open traverse the BVH, within
// their open interval. Beware: a few rays alone skip the grid, rays from far away are moved for the planes
// only, and hard rays go to the reference.
#include "kernels/cpu/encodings/cpu_exact.hpp"

#include "kernels/cpu/simd_kernel.hpp"
#include "kernels/reference/batch.hpp"
#include "kernels/reference/encodings/reference_exact.hpp"

#include "kernels/cpu/targets.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/cpu/encodings/cpu_exact.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h

#include <hwy/highway.h>

// For a single lane there is the reference.
#if HWY_TARGET != HWY_SCALAR
#include "kernels/cpu/planes/grid_traversal-inl.hpp"
#include "kernels/cpu/triangles/traverse-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace nif::kernels::cpu::HWY_NAMESPACE {

/// A batch as the planes see it, if some rays come from far away.
struct SeenBatch {
  SegmentBatch batch;
  bool moved[kBatchRays];
};
HWY_NOINLINE void see(const ExactField& field, const SegmentBatch& batch, SeenBatch& seen) {
  seen.batch.count = batch.count;
  for (uint32_t i = 0; i < batch.count; ++i) {
    const SeenSegment one = seen_by_planes(field, segment_of(batch, i));
    set_segment(seen.batch, i, one.segment);
    seen.moved[i] = one.start != 0;
  }
}

/// Leaves a ray to the triangles. If the ray is culled, boxes count only within the interval that the
/// traversal of the grid left open.
HWY_INLINE void leave_to_triangles(const ExactField& field, const Segment& segment, float begin, float end,
                                   SegmentBatch& left, BoxEnds& ends, uint32_t k) {
  set_segment(left, k, segment);
  const float start = start_of(field.triangles, segment);
  const SeenSegment seen = start == 0 ? SeenSegment{segment, 0} : seen_by_planes(field, segment);
  const bool culled = seen.start == start && is_culled(field.planes, seen.segment);
  ends.enter[k] = culled ? begin : from_start_down(segment.tmin, start);
  ends.leave[k] = culled ? end : from_start_up(segment.tmax, start);
}

struct ExactScratch {
  RayTable rays;
  OpenRangeLog log;
  HardRays hard;
  // Rays that are left to the triangles, and the interval in which boxes count for each.
  SegmentBatch left;
  BoxEnds ends;
  AnswerBatch answers;
  SeenBatch seen;
  BvhScratch<> bvh;
};
static_assert(sizeof(ExactScratch) <= kKernelScratchBytes);

/// Answers the rays that the traversal of the grid left open.
HWY_INLINE void answer_left(const PackedExactField& packed, const SegmentBatch& batch, ExactScratch& s,
                            AnswerBatch& answers) {
  s.left.count = s.log.count;
  for (uint32_t k = 0; k < s.log.count; ++k) {
    const Segment segment = segment_of(batch, s.log.ray(k));
    leave_to_triangles(packed.field, segment, s.log.begin[k], s.log.end[k], s.left, s.ends, k);
  }
  const TreePart left{&packed.tree, s.left.count};
  traverse(&left, s.left, s.ends.enter, s.ends.leave, s.answers, s.bvh);
  for (uint32_t k = 0; k < s.log.count; ++k) {
    const uint32_t i = s.log.ray(k);
    answers.logit[i] = s.answers.logit[k];
    answers.certain[i] = s.answers.certain[k];
  }
}

struct ExactHitScratch {
  RayTable rays;
  FirstHitRangeLog log;
  HardRays hard;
  // Rays that do not certainly miss, and the interval in which boxes count for each.
  SegmentBatch left;
  BoxEnds ends;
  HitBatch hits;
  BvhHitScratch<> bvh;
  SeenBatch seen;
};
static_assert(sizeof(ExactHitScratch) <= kKernelScratchBytes);

/// For this few rays the grid does not pay off: their triangles give the same answers.
constexpr uint32_t kFewRays = 16;

#ifdef NIF_DECODES
/// Whether most rays start outside the triangles' box.
HWY_NOINLINE bool most_start_outside(const BvhTree& tree, const SegmentBatch& batch) {
  const Floats d;
  hn::Vec<Floats> low[3], high[3];
  for (uint32_t a = 0; a < 3; ++a) {
    float least = tree.low[0][a], most = tree.high[0][a];
    for (uint32_t s = 1; (tree.inner | tree.leaves) >> s != 0; ++s) {
      least = min_of(tree.low[s][a], least);
      most = max_of(tree.high[s][a], most);
    }
    low[a] = hn::Set(d, least);
    high[a] = hn::Set(d, most);
  }
  uint32_t inside = 0;
  for (uint32_t i = 0; i < batch.count; i += kLanes) {
    auto within = hn::FirstN(d, batch.count - i);
    for (uint32_t a = 0; a < 3; ++a) {
      const auto origin = hn::Load(d, batch.origin[a] + i);
      within = hn::And(within, hn::And(hn::Ge(origin, low[a]), hn::Le(origin, high[a])));
    }
    inside += uint32_t(__builtin_popcount(bits_of(within)));
  }
  return 2 * inside < batch.count;
}
#endif

HWY_NOINLINE void intersect_exact_by_reference(const ExactField& field, const SegmentBatch& batch,
                                               uint32_t ray, float limit, HitBatch& hits) {
  set_hit(hits, ray, intersect(field, segment_of(batch, ray), limit));
}

void intersect_exact(const PackedExactField& packed, const SegmentBatch& batch, const float* limit,
                     HitBatch& hits, void* memory) {
  auto& s = *static_cast<ExactHitScratch*>(memory);
  bool tree_alone = batch.count <= kFewRays;
#ifdef NIF_DECODES
  tree_alone = tree_alone || (packed.tree_alone && most_start_outside(packed.tree, batch));
#endif
  if (tree_alone) {
    const TreePart whole{&packed.tree, batch.count};
    traverse_whole_to_hits(&whole, batch, limit, hits, s.ends, s.bvh);
    return;
  }
  fill_hits(hits, batch.count, no_hit(true));
  const bool far = any_far(packed.tree.field, batch, 0, batch.count);
  if (HWY_UNLIKELY(far)) {
    see(packed.field, batch, s.seen);
    for (uint32_t i = 0; i < batch.count; ++i)
      if (s.seen.moved[i])
        set_hit(hits, i, no_hit(certain_bvh(packed.field.triangles, segment_of(batch, i))));
  }
  GridTraversal traversal(packed.field.planes, packed.grid, far ? s.seen.batch : batch, s.bvh.answers, s.rays,
                          s.log, s.hard);
  while (traversal.fill_log()) {
    s.left.count = s.log.count;
    for (uint32_t k = 0; k < s.log.count; ++k) {
      const uint32_t i = s.log.ray(k);
      const Segment segment = segment_of(batch, i);
      leave_to_triangles(packed.field, segment, s.log.begin[k], s.log.end[k], s.left, s.ends, k);
      const float start = start_of(packed.tree.field, segment);
      s.ends.leave[k] = min_of(from_start_up(next_above(limit[i]), start), s.ends.leave[k]);
    }
    const TreePart left{&packed.tree, s.left.count};
    traverse_to_hits(&left, s.left, s.ends.enter, s.ends.leave, s.hits, s.bvh);
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
    const TreePart whole{&packed.tree, batch.count};
    traverse_whole(&whole, batch, answers, s.ends, s.bvh);
    return;
  }
  const bool far = any_far(packed.tree.field, batch, 0, batch.count);
  if (HWY_UNLIKELY(far)) see(packed.field, batch, s.seen);
  GridTraversal traversal(packed.field.planes, packed.grid, far ? s.seen.batch : batch, answers, s.rays,
                          s.log, s.hard);
  while (traversal.fill_log()) answer_left(packed, batch, s, answers);
  for (uint32_t i = 0; far && i < batch.count; ++i)
    if (s.seen.moved[i]) answers.certain[i] = certain_bvh(packed.field.triangles, segment_of(batch, i));
  for (uint32_t k = 0; k < s.hard.count; ++k)
    answer_exact_by_reference(packed.field, batch, s.hard.ray[k], answers);
}

constexpr SimdFunctions<PackedExactField> kExactFunctions = {.answer = answer_exact,
                                                             .intersect = intersect_exact};

}  // namespace nif::kernels::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif  // HWY_TARGET

#if HWY_ONCE
#include "kernels/cpu/dispatch-inl.hpp"

namespace nif::kernels::cpu {

#ifdef NIF_DECODES
/// In a tree of more boxes, as slivers make it, even a ray from outside should not look at what the grid can prove
/// (docs/results/cpu-kernels.md, "First hits from outside").
constexpr double kFewBoxes = 20;
#endif

KernelPointer make_kernel(const ExactField& field, const KernelOptions& options) {
  return hold_kernel<SimdKernel<PackedExactField>>(
      options.memory, NIF_FUNCTIONS_FOR(SimdFunctions<PackedExactField>, kExactFunctions, options.isa), [&] {
        PackedExactField packed{field,
                                TraversalGrid(field.planes, options.memory, options.most_without_bricks),
                                tree_of(field.triangles, options)};
#ifdef NIF_DECODES
        const double boxes = boxes_met(packed.tree.decoded);
        packed.tree_alone = boxes > 0 && boxes <= kFewBoxes;
#endif
        return packed;
      });
}

}  // namespace nif::kernels::cpu
#endif
