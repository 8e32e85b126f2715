// The `bvh` reference as an ObjectKernel: what `isa=scalar` runs.
#pragma once

#include "kernels/reference/batch.hpp"
#include "kernels/reference/bvh/query.hpp"

namespace nif::kernels {

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
