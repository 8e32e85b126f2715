// `bvh` objects in SIMD: tests the eight boxes of a node, and the triangles of a leaf, at once.
#pragma once

#include "kernels/cpu/kernel_options.hpp"
#include "kernels/cpu/triangles/tree.hpp"

namespace nif::kernels::cpu {

class SimdBvhKernel final : public ObjectKernel {
 public:
  /// The field's memory must outlive the kernel.
  SimdBvhKernel(const TrianglesField& field, const KernelOptions& options);

  void answer(const SegmentBatch& batch, AnswerBatch& answers, void* scratch) const override;
  void intersect(const SegmentBatch& batch, const float* limit, HitBatch& hits, void* scratch) const override;

 private:
  using Answer = void (*)(const BvhTree&, const SegmentBatch&, AnswerBatch&, void*);
  using Intersect = void (*)(const BvhTree&, const SegmentBatch&, const float*, HitBatch&, void*);
  BvhTree tree_;
  Answer answer_;
  Intersect intersect_;
};

inline KernelPointer make_kernel(const TrianglesField& field, const KernelOptions& options) {
  return hold_kernel<SimdBvhKernel>(options.memory, field, options);
}

}  // namespace nif::kernels::cpu
