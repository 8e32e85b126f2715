// Answers `bvh` objects with SIMD. Compiled once for each Highway target; the constructor picks the version
// for the instruction set. The traversal is in traverse-inl.hpp because `exact` uses it, too.
#include "kernels/cpu/encodings/bvh.hpp"

#include "kernels/reference/batch.hpp"
#include "kernels/reference/triangles/hit.hpp"

#include "kernels/cpu/targets.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/cpu/encodings/bvh.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h

#include <hwy/highway.h>

// For a single lane there is the reference.
#if HWY_TARGET != HWY_SCALAR
#include "kernels/cpu/triangles/traverse-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace nif::kernels::cpu::HWY_NAMESPACE {

struct BvhAnswerScratch {
  BoxEnds ends;
  BvhScratch bvh;
};
static_assert(sizeof(BvhAnswerScratch) <= kKernelScratchBytes);

void answer_bvh(const BvhTree& tree, const SegmentBatch& batch, AnswerBatch& answers, void* memory) {
  auto& s = *static_cast<BvhAnswerScratch*>(memory);
  traverse_whole(tree, batch, answers, s.ends, s.bvh);
}

struct BvhIntersectScratch {
  BoxEnds ends;
  BvhHitScratch hits;
};
static_assert(sizeof(BvhIntersectScratch) <= kKernelScratchBytes);

void intersect_bvh(const BvhTree& tree, const SegmentBatch& batch, const float* limit, HitBatch& hits,
                   void* memory) {
  auto& s = *static_cast<BvhIntersectScratch*>(memory);
  traverse_whole_to_hits(tree, batch, limit, hits, s.ends, s.hits);
}

}  // namespace nif::kernels::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif  // HWY_TARGET

#if HWY_ONCE
#include "kernels/cpu/dispatch-inl.hpp"

namespace nif::kernels::cpu {

SimdBvhKernel::SimdBvhKernel(const TrianglesField& field, const KernelOptions& options)
    : tree_(tree_of(field)),
      answer_(NIF_KERNEL_FOR(Answer, answer_bvh, options.isa)),
      intersect_(NIF_KERNEL_FOR(Intersect, intersect_bvh, options.isa)) {}

void SimdBvhKernel::answer(const SegmentBatch& batch, AnswerBatch& answers, void* scratch) const {
  answer_(tree_, batch, answers, scratch);
}

void SimdBvhKernel::intersect(const SegmentBatch& batch, const float* limit, HitBatch& hits,
                              void* scratch) const {
  intersect_(tree_, batch, limit, hits, scratch);
}

}  // namespace nif::kernels::cpu
#endif
