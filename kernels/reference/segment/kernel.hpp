// The reference as an ObjectKernel: what `isa=scalar` runs.
#pragma once

#include "kernels/reference/batch.hpp"
#include "kernels/reference/segment/query.hpp"

namespace nif::kernels {

class ReferenceSegmentKernel final : public ObjectKernel {
 public:
  /// The field must outlive the kernel.
  explicit ReferenceSegmentKernel(const SegmentField& field) : field_(field) {}

  void answer(const SegmentBatch& batch, AnswerBatch& answers, void*) const override {
    for (uint32_t i = 0; i < batch.count; ++i) {
      const Answer answer = query_segment(field_, segment_of(batch, i));
      answers.logit[i] = answer.logit;
      answers.certain[i] = answer.certain;
    }
  }
  size_t resident_bytes() const override { return 0; }

 private:
  SegmentField field_;
};

}  // namespace nif::kernels
