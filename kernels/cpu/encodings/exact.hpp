// The `exact` encoding in SIMD: many rays at a time traverse the grid, and those that stay open traverse the
// BVH.
#pragma once

#include "kernels/cpu/kernel_options.hpp"
#include "kernels/cpu/triangles/tree.hpp"
#include "kernels/packed/walk_grid.hpp"
#include "kernels/reference/encodings/exact.hpp"

namespace nif::kernels::cpu {

/// A field in the layout of the SIMD kernels: what they build from it, and the asset's own arrays.
struct PackedExactField {
  ExactField field;
  WalkGrid walk;
  BvhTree tree;
};

class SimdExactKernel final : public ObjectKernel {
 public:
  /// The field's memory must outlive the kernel.
  SimdExactKernel(const ExactField& field, const KernelOptions& options);

  void answer(const SegmentBatch& batch, AnswerBatch& answers, void* scratch) const override;
  void intersect(const SegmentBatch& batch, const float* limit, HitBatch& hits, void* scratch) const override;
  BuiltBytes built_bytes() const override { return {packed_.walk.resident_bytes(), 0}; }

 private:
  using Answer = void (*)(const PackedExactField&, const SegmentBatch&, AnswerBatch&, void*);
  using Intersect = void (*)(const PackedExactField&, const SegmentBatch&, const float*, HitBatch&, void*);
  PackedExactField packed_;
  Answer answer_;
  Intersect intersect_;
};

inline KernelPointer make_kernel(const ExactField& field, const KernelOptions& options) {
  return hold_kernel<SimdExactKernel>(options.memory, field, options);
}

}  // namespace nif::kernels::cpu
