// Answers `cutout` objects with SIMD: the traversals of `bvh`, which ask holes where a triangle has some. Compiled once
// for each Highway target; the constructor picks the version for the instruction set.
#include "kernels/cpu/encodings/cpu_cutout.hpp"

#include "kernels/cpu/holes/holes.hpp"
#include "kernels/cpu/simd_kernel.hpp"
#include "kernels/cpu/triangles/tree.hpp"
#include "kernels/reference/batch.hpp"

#include "kernels/cpu/targets.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/cpu/encodings/cpu_cutout.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h

#include <hwy/highway.h>

// For a single lane there is the reference.
#if HWY_TARGET != HWY_SCALAR
#include "kernels/cpu/triangles/traverse-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace nif::kernels::cpu::HWY_NAMESPACE {

HWY_INLINE SomeHoles holes_of(const CutoutTree& tree) {
  return {&tree.holes, tree.lanes.data(), tree.leaves.data()};
}

struct CutoutAnswerScratch {
  BoxEnds ends;
  BvhScratch<SomeHoles> bvh;
};
static_assert(sizeof(CutoutAnswerScratch) <= kKernelScratchBytes);

void answer_cutout(const CutoutTree& tree, const SegmentBatch& batch, AnswerBatch& answers, void* memory) {
  auto& s = *static_cast<CutoutAnswerScratch*>(memory);
  const TreePart whole{&tree.bvh, batch.count};
  traverse_whole(&whole, batch, answers, s.ends, s.bvh, holes_of(tree));
}

struct CutoutIntersectScratch {
  BoxEnds ends;
  BvhHitScratch<SomeHoles> hits;
};
static_assert(sizeof(CutoutIntersectScratch) <= kKernelScratchBytes);

void intersect_cutout(const CutoutTree& tree, const SegmentBatch& batch, const float* limit, HitBatch& hits,
                      void* memory) {
  auto& s = *static_cast<CutoutIntersectScratch*>(memory);
  const TreePart whole{&tree.bvh, batch.count};
  traverse_whole_to_hits(&whole, batch, limit, hits, s.ends, s.hits, holes_of(tree));
}

constexpr SimdFunctions<CutoutTree> kCutoutFunctions = {.answer = answer_cutout,
                                                        .intersect = intersect_cutout};

}  // namespace nif::kernels::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif  // HWY_TARGET

#if HWY_ONCE
#include "kernels/cpu/dispatch-inl.hpp"

namespace nif::kernels::cpu {

KernelPointer make_kernel(const CutoutField& field, const KernelOptions& options) {
  return hold_kernel<SimdKernel<CutoutTree>>(
      options.memory, NIF_FUNCTIONS_FOR(SimdFunctions<CutoutTree>, kCutoutFunctions, options.isa), [&] {
        CutoutTree tree{tree_of(field.triangles, options, &field.holes), field.holes,
                        std::pmr::vector<uint8_t>(options.memory),
                        std::pmr::vector<LeafHoles>(options.memory)};
        const size_t count = tree.bvh.decoded.leaves.size();
        tree.lanes.resize(count);
        tree.leaves.resize(count);
        for (size_t leaf = 0; leaf < count; ++leaf) {
          for (uint32_t i = 0; i < kBvhLeafTriangles; ++i) {
            const AlphaPatch* const patch = patch_of(field.holes, tree.bvh.decoded.leaves[leaf].triangles[i]);
            if (patch == nullptr) continue;
            tree.lanes[leaf] |= uint8_t(1u << i);
            LeafHoles& shown = tree.leaves[leaf];
            for (uint32_t k = 0; k < 3; ++k)
              for (uint32_t a = 0; a < 2; ++a) shown.places[k][a][i] = patch->places[k][a];
            shown.unit[i] = 1.0f / float(1u << (kAlphaFraction - patch->shift));
            shown.maps[i] = patch->map;
          }
        }
        return tree;
      });
}

}  // namespace nif::kernels::cpu
#endif
