// The `segment` encoding in SIMD: the same bits as kernels/reference, many rays at a time.
#pragma once

#include "kernels/cpu/kernel_options.hpp"
#include "kernels/cpu/network/packed_field.hpp"

namespace nif::kernels::cpu {

using AnswerSegments = void (*)(const PackedField&, const SegmentBatch&, AnswerBatch&, void*);

class SimdSegmentKernel final : public ObjectKernel {
 public:
  /// As for PackedField.
  SimdSegmentKernel(const SegmentField& field, const KernelOptions& options);

  void answer(const SegmentBatch& batch, AnswerBatch& answers, void* scratch) const override;
  void prove(const SegmentBatch& batch, AnswerBatch& answers, OpenBatch& open, void* scratch) const override;
  void intersect(const SegmentBatch& batch, const float* limit, HitBatch& hits, void* scratch) const override;
  BuiltBytes built_bytes() const override {
    return {field_.walk.resident_bytes(), field_.corners_by_brick.resident_bytes()};
  }
  bool reads_field() const override { return field_.reads_field; }

 private:
  using Prove = void (*)(const PackedField&, const SegmentBatch&, AnswerBatch&, OpenBatch&, void*);
  using Intersect = void (*)(const PackedField&, AnswerSegments, const SegmentBatch&, const float*, HitBatch&,
                             void*);
  PackedField field_;
  AnswerSegments answer_;
  Prove prove_;
  Intersect intersect_;
};

inline KernelPointer make_kernel(const SegmentField& field, const KernelOptions& options) {
  return hold_kernel<SimdSegmentKernel>(options.memory, field, options);
}

}  // namespace nif::kernels::cpu
