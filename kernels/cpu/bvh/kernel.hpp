// `bvh` objects in SIMD: one ray at a time against the eight boxes of a node at once.
#pragma once

#include "kernels/cpu/segment/kernel.hpp"
#include "kernels/reference/bvh/field.hpp"

namespace nif::kernels::cpu {

class SimdBvhKernel final : public ObjectKernel {
 public:
  /// The field's memory must outlive the kernel, and the machine must have `isa`.
  SimdBvhKernel(const BvhField& field, Isa isa);

  void answer(const SegmentBatch& batch, AnswerBatch& answers, void* scratch) const override;
  size_t resident_bytes() const override { return 0; }

 private:
  using Answer = void (*)(const BvhField&, const SegmentBatch&, AnswerBatch&);
  BvhField field_;
  Answer answer_;
};

}  // namespace nif::kernels::cpu
