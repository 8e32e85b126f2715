// Answers `proof` objects with SIMD: compiles the traversal of prove-inl.hpp and hits-inl.hpp for each
// target. Beware: answer() does not need open intervals, and puts them at the end of the scratch memory,
// because stacks may be small.
#include "kernels/cpu/encodings/proof.hpp"

#include "kernels/reference/batch.hpp"
#include "kernels/reference/encodings/proof.hpp"
#include "kernels/reference/planes/hit.hpp"

#include "kernels/cpu/targets.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/cpu/encodings/proof.cpp"
#include <hwy/foreach_target.h>  // must come before highway.h

#include <hwy/highway.h>

// For a single lane there is the reference.
#if HWY_TARGET != HWY_SCALAR
#include "kernels/cpu/planes/hits-inl.hpp"
#include "kernels/cpu/planes/prove-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace nif::kernels::cpu::HWY_NAMESPACE {

void prove_proof(const PackedPlanesField& packed, const SegmentBatch& batch, AnswerBatch& answers,
                 OpenBatch& open, void* memory) {
  prove_rays(packed.field, packed.walk, batch, answers, open, memory);
}

static_assert(sizeof(HitScratch) <= kKernelScratchBytes);

void intersect_proof(const PackedPlanesField& packed, const SegmentBatch& batch, const float* limit,
                     HitBatch& hits, void* memory) {
  hits_by_planes(packed.field, packed.walk, batch, limit, hits, *static_cast<HitScratch*>(memory),
                 NoNetwork(),
                 [&](uint32_t i) { return intersect(packed.field, segment_of(batch, i), limit[i]); });
}

}  // namespace nif::kernels::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif  // HWY_TARGET

#if HWY_ONCE
#include "kernels/cpu/dispatch-inl.hpp"

namespace nif::kernels::cpu {

SimdProofKernel::SimdProofKernel(const PlanesField& field, const KernelOptions& options)
    : packed_{field, WalkGrid(field, options.memory, options.most_without_bricks)},
      prove_(NIF_KERNEL_FOR(Prove, prove_proof, options.isa)),
      intersect_(NIF_KERNEL_FOR(Intersect, intersect_proof, options.isa)) {}

void SimdProofKernel::answer(const SegmentBatch& batch, AnswerBatch& answers, void* scratch) const {
  // The caller did not ask for open intervals. Threads may have small stacks, so they go behind what prove_
  // uses.
  std::byte* const end = static_cast<std::byte*>(scratch) + kKernelScratchBytes;
  prove_(packed_, batch, answers, *reinterpret_cast<OpenBatch*>(end - sizeof(OpenBatch)), scratch);
}

void SimdProofKernel::prove(const SegmentBatch& batch, AnswerBatch& answers, OpenBatch& open,
                            void* scratch) const {
  prove_(packed_, batch, answers, open, scratch);
}

void SimdProofKernel::intersect(const SegmentBatch& batch, const float* limit, HitBatch& hits,
                                void* scratch) const {
  intersect_(packed_, batch, limit, hits, scratch);
}

}  // namespace nif::kernels::cpu
#endif
