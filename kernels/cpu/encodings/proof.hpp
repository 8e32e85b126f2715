// The `proof` encoding in SIMD: many rays at a time traverse the grid.
#pragma once

#include "kernels/cpu/kernel_options.hpp"
#include "kernels/packed/walk_grid.hpp"
#include "kernels/reference/planes/field.hpp"

namespace nif::kernels::cpu {

/// A grid in the layout of the SIMD kernels.
struct PackedPlanesField {
  PlanesField field;
  WalkGrid walk;
};

class SimdProofKernel final : public ObjectKernel {
 public:
  /// The field's memory must outlive the kernel.
  SimdProofKernel(const PlanesField& field, const KernelOptions& options);

  void answer(const SegmentBatch& batch, AnswerBatch& answers, void* scratch) const override;
  void prove(const SegmentBatch& batch, AnswerBatch& answers, OpenBatch& open, void* scratch) const override;
  void intersect(const SegmentBatch& batch, const float* limit, HitBatch& hits, void* scratch) const override;
  BuiltBytes built_bytes() const override { return {packed_.walk.resident_bytes(), 0}; }

 private:
  using Prove = void (*)(const PackedPlanesField&, const SegmentBatch&, AnswerBatch&, OpenBatch&, void*);
  using Intersect = void (*)(const PackedPlanesField&, const SegmentBatch&, const float*, HitBatch&, void*);
  PackedPlanesField packed_;
  Prove prove_;
  Intersect intersect_;
};

inline KernelPointer make_kernel(const PlanesField& field, const KernelOptions& options) {
  return hold_kernel<SimdProofKernel>(options.memory, field, options);
}

}  // namespace nif::kernels::cpu
