// The `spherical` encoding in SIMD: the same bits as kernels/reference, one ray per lane.
#pragma once

#include "kernels/cpu/kernel_options.hpp"
#include "kernels/reference/spherical/field.hpp"

namespace nif::kernels::cpu {

/// Reads grids in place, and weights too, unless they are in half precision: then it uses a copy in single
/// precision.
class SimdSphericalKernel final : public ObjectKernel {
 public:
  /// The field's memory must outlive the kernel. Two bytes before a grid in half precision must be readable,
  /// as they are in a file.
  SimdSphericalKernel(const SphericalField& field, const KernelOptions& options);

  void answer(const SegmentBatch& batch, AnswerBatch& answers, void* scratch) const override;
  void intersect(const SegmentBatch& batch, const float* limit, HitBatch& hits, void* scratch) const override;

 private:
  using Answer = void (*)(const SphericalField&, const SegmentBatch&, AnswerBatch&, void*);
  SphericalField field_;
  Answer answer_;
};

inline KernelPointer make_kernel(const SphericalField& field, const KernelOptions& options) {
  return hold_kernel<SimdSphericalKernel>(options.memory, field, options);
}

}  // namespace nif::kernels::cpu
