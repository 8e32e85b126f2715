// The `bvh` reference as an ObjectKernel: what `isa=scalar` runs.
#pragma once

#include "kernels/object_kernel.hpp"
#include "kernels/reference/bvh.hpp"

namespace nif::kernels {

inline Segment segment_of(const SegmentBatch& batch, uint32_t i) {
  Segment segment;
  for (int a = 0; a < 3; ++a) {
    segment.origin[a] = batch.origin[a][i];
    segment.direction[a] = batch.direction[a][i];
  }
  segment.tmin = batch.tmin[i];
  segment.tmax = batch.tmax[i];
  return segment;
}

class ReferenceBvhKernel final : public ObjectKernel {
 public:
  /// The field's memory must outlive the kernel.
  explicit ReferenceBvhKernel(const BvhField& field) : field_(field) {}

  void answer(const SegmentBatch& batch, AnswerBatch& answers, void*) const override {
    for (uint32_t i = 0; i < batch.count; ++i) {
      const Answer answer = query_bvh(field_, segment_of(batch, i));
      answers.logit[i] = answer.logit;
      answers.certain[i] = answer.certain;
    }
  }
  size_t resident_bytes() const override { return 0; }

 private:
  BvhField field_;
};

}  // namespace nif::kernels
