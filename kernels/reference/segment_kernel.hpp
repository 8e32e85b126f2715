// The reference as an ObjectKernel: what `isa=scalar` runs.
#pragma once

#include "kernels/object_kernel.hpp"
#include "kernels/reference/segment.hpp"

namespace nif::kernels {

class ReferenceSegmentKernel final : public ObjectKernel {
 public:
  /// The field must outlive the kernel.
  explicit ReferenceSegmentKernel(const SegmentField& field) : field_(field) {}

  void answer(const SegmentBatch& batch, AnswerBatch& answers, void*) const override {
    for (uint32_t i = 0; i < batch.count; ++i) {
      Segment segment;
      for (int a = 0; a < 3; ++a) {
        segment.origin[a] = batch.origin[a][i];
        segment.direction[a] = batch.direction[a][i];
      }
      segment.tmin = batch.tmin[i];
      segment.tmax = batch.tmax[i];
      const Answer answer = query_segment(field_, segment);
      answers.logit[i] = answer.logit;
      answers.certain[i] = answer.certain;
    }
  }
  size_t resident_bytes() const override { return 0; }

 private:
  SegmentField field_;
};

}  // namespace nif::kernels
