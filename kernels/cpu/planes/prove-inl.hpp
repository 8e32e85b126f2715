// Answers by proofs alone in SIMD, for any field that has planes.
//
// Compiled once for each target, so the include guard toggles.
#if defined(NIF_PLANES_PROVE_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef NIF_PLANES_PROVE_INL
#undef NIF_PLANES_PROVE_INL
#else
#define NIF_PLANES_PROVE_INL
#endif

#include "kernels/cpu/planes/grid_traversal-inl.hpp"
#include "kernels/reference/planes/prove_one.hpp"

HWY_BEFORE_NAMESPACE();
namespace nif::kernels::cpu::HWY_NAMESPACE {

struct ProofScratch {
  RayTable rays;
  OpenRangeLog log;
  HardRays hard;
};
static_assert(sizeof(ProofScratch) + sizeof(OpenBatch) <= kKernelScratchBytes);

template <class Field>
HWY_NOINLINE void prove_by_reference(const Field& field, const SegmentBatch& batch, uint32_t ray,
                                     AnswerBatch& answers, OpenBatch& open) {
  prove_one(field, batch, ray, answers, open);
}

/// Like ObjectKernel::prove(). Field: as for follow_segment().
template <class Field>
void prove_rays(const Field& field, const TraversalGrid& grid, const SegmentBatch& batch,
                AnswerBatch& answers, OpenBatch& open, void* memory) {
  if (batch.count <= kFewForTraversal) {
    for (uint32_t i = 0; i < batch.count; ++i) prove_by_reference(field, batch, i, answers, open);
    return;
  }
  auto& s = *static_cast<ProofScratch*>(memory);
  GridTraversal traversal(field, grid, batch, answers, s.rays, s.log, s.hard);
  while (traversal.fill_log())
    for (uint32_t k = 0; k < s.log.count; ++k) {
      const uint32_t i = s.log.ray(k);
      const Segment segment = segment_of(batch, i);
      TraversalResult found;
      float reach;
      to_grid_space(field, segment, found, reach);
      const OpenInterval part = widen(field, segment, found, {s.log.begin[k] + 0.0f, s.log.end[k] + 0.0f});
      open.begin[i] = part.begin;
      open.end[i] = part.end;
      answers.logit[i] = kOpenLogit;
      answers.certain[i] = 0;
    }
  for (uint32_t k = 0; k < s.hard.count; ++k) prove_by_reference(field, batch, s.hard.ray[k], answers, open);
}

}  // namespace nif::kernels::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
