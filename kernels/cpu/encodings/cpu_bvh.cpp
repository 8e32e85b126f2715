// Answers `bvh` objects with SIMD. Compiled once for each Highway target; the constructor picks the version
// for the instruction set. The traversal is in traverse-inl.hpp because `exact` uses it, too.
#include "kernels/cpu/encodings/cpu_bvh.hpp"

#include "kernels/cpu/simd_kernel.hpp"
#include "kernels/cpu/triangles/tree.hpp"
#include "kernels/reference/batch.hpp"
#include "kernels/reference/triangles/triangles_hit.hpp"

#include "kernels/cpu/targets.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/cpu/encodings/cpu_bvh.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h

#include <hwy/highway.h>

// For a single lane there is the reference.
#if HWY_TARGET != HWY_SCALAR
#include "kernels/cpu/triangles/refit-inl.hpp"
#include "kernels/cpu/triangles/skin-inl.hpp"
#include "kernels/cpu/triangles/traverse-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace nif::kernels::cpu::HWY_NAMESPACE {

struct BvhAnswerScratch {
  TreePart parts[kBatchRays];
  BoxEnds ends;
  BvhScratch<> bvh;
};
static_assert(sizeof(BvhAnswerScratch) <= kKernelScratchBytes);

void answer_bvh(const BvhTree& tree, const SegmentBatch& batch, AnswerBatch& answers, void* memory) {
  auto& s = *static_cast<BvhAnswerScratch*>(memory);
  const TreePart whole{&tree, batch.count};
  traverse_whole(&whole, batch, answers, s.ends, s.bvh);
}

struct BvhIntersectScratch {
  TreePart parts[kBatchRays];
  BoxEnds ends;
  BvhHitScratch<> hits;
};
static_assert(sizeof(BvhIntersectScratch) <= kKernelScratchBytes);

void intersect_bvh(const BvhTree& tree, const SegmentBatch& batch, const float* limit, HitBatch& hits,
                   void* memory) {
  auto& s = *static_cast<BvhIntersectScratch*>(memory);
  const TreePart whole{&tree, batch.count};
  traverse_whole_to_hits(&whole, batch, limit, hits, s.ends, s.hits);
}

constexpr SimdFunctions<BvhTree> kBvhFunctions = {
    .answer = answer_bvh,
    .intersect = intersect_bvh,
#ifndef NIF_WITHOUT_BENDING  // for WebAssembly, where every byte is downloaded
    .move = move_bvh,
    .skin = skin_in_lanes,
#endif
};

#ifdef NIF_DECODES
/// The trees of the kernels that a batch's parts ask.
void find_trees(const BatchPart* from, uint32_t count, TreePart* to) {
  for (uint32_t end = 0; end != count; ++from) {
    end = from->end;
    *to++ = {&static_cast<const SimdKernel<BvhTree>&>(*from->kernel).packed(), end};
  }
}
void answer_parts(const BatchPart* parts, const SegmentBatch& batch, AnswerBatch& answers, void* memory) {
  auto& s = *static_cast<BvhAnswerScratch*>(memory);
  find_trees(parts, batch.count, s.parts);
  traverse_whole(s.parts, batch, answers, s.ends, s.bvh);
}
void intersect_parts(const BatchPart* parts, const SegmentBatch& batch, const float* limit, HitBatch& hits,
                     void* memory) {
  auto& s = *static_cast<BvhIntersectScratch*>(memory);
  find_trees(parts, batch.count, s.parts);
  traverse_whole_to_hits(s.parts, batch, limit, hits, s.ends, s.hits);
}

constexpr PartFunctions kPartFunctions = {.answer = answer_parts, .intersect = intersect_parts};
#endif

}  // namespace nif::kernels::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif  // HWY_TARGET

#if HWY_ONCE
#include "kernels/cpu/dispatch-inl.hpp"

namespace nif::kernels::cpu {
namespace {

#ifdef NIF_DECODES
class BvhKernel final : public SimdKernel<BvhTree> {
 public:
  template <class Pack>
  BvhKernel(const SimdFunctions<BvhTree>& functions, const PartFunctions& parts, const Pack& pack)
      : SimdKernel<BvhTree>(functions, pack), parts_(parts) {}
  const PartFunctions& part_functions() const { return parts_; }

  uint32_t kind() const override { return packed().decoded.nodes.empty() ? 1 : 2; }
  void answer_parts(const BatchPart* parts, const SegmentBatch& batch, AnswerBatch& answers,
                    void* scratch) const override {
    parts_.answer(parts, batch, answers, scratch);
  }
  void intersect_parts(const BatchPart* parts, const SegmentBatch& batch, const float* limit, HitBatch& hits,
                       void* scratch) const override {
    parts_.intersect(parts, batch, limit, hits, scratch);
  }

 private:
  PartFunctions parts_;
};
#endif

}  // namespace

KernelPointer make_kernel(const TrianglesField& field, const KernelOptions& options) {
  const auto& functions = NIF_FUNCTIONS_FOR(SimdFunctions<BvhTree>, kBvhFunctions, options.isa);
  const auto tree = [&] { return tree_of(field, options); };
#ifdef NIF_DECODES
  return hold_kernel<BvhKernel>(options.memory, functions,
                                NIF_FUNCTIONS_FOR(PartFunctions, kPartFunctions, options.isa), tree);
#else  // on a web page the code is too much to download
  return hold_kernel<SimdKernel<BvhTree> >(options.memory, functions, tree);
#endif
}

#ifndef NIF_WITHOUT_BENDING
KernelPointer copy_kernel(const ObjectKernel& kernel, std::pmr::memory_resource* memory) {
  const auto& own = static_cast<const BvhKernel&>(kernel);
  return hold_kernel<BvhKernel>(memory, own.functions(), own.part_functions(), [&] {
    BvhTree tree = empty_tree(own.packed().field, memory);
    tree = own.packed();
    return tree;
  });
}
#endif

}  // namespace nif::kernels::cpu
#endif
