// The `spherical` reference as an ObjectKernel: what `isa=scalar` runs.
#pragma once

#include "kernels/reference/batch.hpp"
#include "kernels/reference/spherical/query.hpp"

namespace nif::kernels {

class ReferenceSphericalKernel final : public ObjectKernel {
 public:
  /// The field's memory must outlive the kernel.
  explicit ReferenceSphericalKernel(const SphericalField& field) : field_(field) {}

  void answer(const SegmentBatch& batch, AnswerBatch& answers, void*) const override {
    for (uint32_t i = 0; i < batch.count; ++i) {
      const Answer answer = query_spherical(field_, segment_of(batch, i));
      answers.logit[i] = answer.logit;
      answers.certain[i] = answer.certain;
    }
  }
  size_t resident_bytes() const override { return 0; }

 private:
  SphericalField field_;
};

}  // namespace nif::kernels
