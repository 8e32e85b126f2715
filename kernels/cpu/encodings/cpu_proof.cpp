// Answers `proof` objects with SIMD: compiles the traversal of prove-inl.hpp and hits-inl.hpp for each
// target.
#include "kernels/cpu/encodings/cpu_proof.hpp"

#include "kernels/cpu/simd_kernel.hpp"
#include "kernels/reference/batch.hpp"
#include "kernels/reference/encodings/reference_proof.hpp"
#include "kernels/reference/planes/planes_hit.hpp"

#include "kernels/cpu/targets.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "kernels/cpu/encodings/cpu_proof.cpp"
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
  prove_rays(packed.field, packed.grid, batch, answers, open, memory);
}

static_assert(sizeof(HitScratch) <= kKernelScratchBytes);

void intersect_proof(const PackedPlanesField& packed, const SegmentBatch& batch, const float* limit,
                     HitBatch& hits, void* memory) {
  hits_by_planes(packed.field, packed.grid, batch, limit, hits, *static_cast<HitScratch*>(memory),
                 NoNetwork(),
                 [&](uint32_t i) { return intersect(packed.field, segment_of(batch, i), limit[i]); });
}

/// The caller did not ask for open intervals. Threads may have small stacks, so they go behind what
/// prove_proof() uses.
void answer_proof(const PackedPlanesField& packed, const SegmentBatch& batch, AnswerBatch& answers,
                  void* memory) {
  std::byte* const end = static_cast<std::byte*>(memory) + kKernelScratchBytes;
  prove_proof(packed, batch, answers, *reinterpret_cast<OpenBatch*>(end - sizeof(OpenBatch)), memory);
}

constexpr SimdFunctions<PackedPlanesField> kProofFunctions = {
    .answer = answer_proof, .intersect = intersect_proof, .prove = prove_proof};

}  // namespace nif::kernels::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif  // HWY_TARGET

#if HWY_ONCE
#include "kernels/cpu/dispatch-inl.hpp"

namespace nif::kernels::cpu {

KernelPointer make_kernel(const PlanesField& field, const KernelOptions& options) {
  return hold_kernel<SimdKernel<PackedPlanesField>>(
      options.memory, NIF_FUNCTIONS_FOR(SimdFunctions<PackedPlanesField>, kProofFunctions, options.isa), [&] {
        return PackedPlanesField{field, TraversalGrid(field, options.memory, options.most_without_bricks)};
      });
}

}  // namespace nif::kernels::cpu
#endif
