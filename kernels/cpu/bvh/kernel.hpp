// `bvh` objects in SIMD: one ray at a time against the eight boxes of a node at once.
#pragma once

#include "kernels/cpu/kernel_options.hpp"
#include "kernels/reference/bvh/field.hpp"

namespace nif::kernels::cpu {

class SimdBvhKernel final : public ObjectKernel {
 public:
  /// The field's memory must outlive the kernel.
  SimdBvhKernel(const BvhField& field, const KernelOptions& options);

  void answer(const SegmentBatch& batch, AnswerBatch& answers, void* scratch) const override;

 private:
  using Answer = void (*)(const BvhField&, const SegmentBatch&, AnswerBatch&);
  BvhField field_;
  Answer answer_;
};

inline KernelPointer make_kernel(const BvhField& field, const KernelOptions& options) {
  return hold_kernel<SimdBvhKernel>(options.memory, field, options);
}

}  // namespace nif::kernels::cpu
