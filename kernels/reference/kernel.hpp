// Runs the reference as an ObjectKernel: `isa=scalar`, for any encoding.
#pragma once

#include <concepts>

#include "kernels/reference/batch.hpp"
#include "kernels/reference/object_kernel.hpp"
#include "kernels/reference/planes/prove_one.hpp"
#include "kernels/reference/triangles/refit.hpp"
#include "kernels/reference/triangles/skin.hpp"

namespace nif::kernels {

/// Calls the intersect() of whatever field is known at the call: inside a kernel that name is the kernel's
/// own.
template <class Field>
Hit first_hit(const Field& field, const Segment& segment, float limit) {
  return intersect(field, segment, limit);
}

template <class Field>
class ReferenceKernel final : public ObjectKernel {
 public:
  /// The field's memory must outlive the kernel.
  explicit ReferenceKernel(const Field& field) : field_(field) {}

  void answer(const SegmentBatch& batch, AnswerBatch& answers, void*) const override {
    for (uint32_t i = 0; i < batch.count; ++i) {
      const Answer answer = query(field_, segment_of(batch, i));
      answers.logit[i] = answer.logit;
      answers.certain[i] = answer.certain;
    }
  }
  void prove(const SegmentBatch& batch, AnswerBatch& answers, OpenBatch& open, void* scratch) const override {
    if constexpr (std::derived_from<Field, PlanesField>) {
      for (uint32_t i = 0; i < batch.count; ++i) prove_one(field_, batch, i, answers, open);
    } else {
      ObjectKernel::prove(batch, answers, open, scratch);
    }
  }
  void move(const MovedTriangles& moved) override {
    if constexpr (std::same_as<Field, TrianglesField>) field_ = moved.field;
  }
  void skin(const SkinOrder& order, const JointMatrix* matrices, const float (*from)[4],
            float (*to)[4]) const override {
    if constexpr (std::same_as<Field, TrianglesField>) skin_vertices(order, matrices, from, to);
  }
  void intersect(const SegmentBatch& batch, const float* limit, HitBatch& hits, void*) const override {
    intersect_each(batch, limit, hits, [&](const Segment& segment, float nearest) {
      return first_hit(field_, segment, nearest);
    });
  }

 private:
  Field field_;
};

}  // namespace nif::kernels
