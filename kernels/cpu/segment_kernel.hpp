// The `segment` encoding in SIMD: the same bits as kernels/reference, many rays at a time.
#pragma once

#include <memory_resource>

#include "kernels/cpu/feature_grid.hpp"
#include "kernels/cpu/walk_grid.hpp"
#include "kernels/object_kernel.hpp"

namespace nif::kernels::cpu {

/// Instruction sets that there are kernels for, from narrow to wide.
enum class Isa { sse4, avx2, avx512 };

/// Whether this build has kernels for it and this machine can run them.
bool available(Isa isa);

class SimdSegmentKernel final : public ObjectKernel {
 public:
  /// The field must outlive the kernel, have at most kMaxGridVoxels voxels, and the machine must have `isa`.
  SimdSegmentKernel(const SegmentField& field, Isa isa, std::pmr::memory_resource* memory);

  void answer(const SegmentBatch& batch, AnswerBatch& answers, void* scratch) const override;
  size_t resident_bytes() const override { return grid_.resident_bytes() + features_.resident_bytes(); }

 private:
  using Answer = void (*)(const SegmentField&, const WalkGrid&, const FeatureGrid&, const SegmentBatch&,
                          AnswerBatch&, void*);
  SegmentField field_;
  WalkGrid grid_;
  FeatureGrid features_;
  Answer answer_;
};

}  // namespace nif::kernels::cpu
