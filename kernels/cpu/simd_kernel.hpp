// The kernel of any encoding that has SIMD code: a field in the layout that this code reads, and the code's
// version for one instruction set.
#pragma once

#include "kernels/cpu/kernel_options.hpp"

namespace nif::kernels::cpu {

/// The functions of an ObjectKernel for one instruction set.
template <class Packed>
struct SimdFunctions {
  void (*answer)(const Packed&, const SegmentBatch&, AnswerBatch&, void* scratch);
  void (*intersect)(const Packed&, const SegmentBatch&, const float* limit, HitBatch&, void* scratch);
  /// If null, ObjectKernel's own.
  void (*prove)(const Packed&, const SegmentBatch&, AnswerBatch&, OpenBatch&, void* scratch) = nullptr;
  /// If null, the field does not move.
  void (*move)(Packed&, const MovedTriangles&) = nullptr;
  void (*skin)(const SkinOrder&, const JointMatrix* matrices, const float (*from)[4],
               float (*to)[4]) = nullptr;
};

/// Those for batches in parts, of kernels that have a kind.
struct PartFunctions {
  void (*answer)(const BatchPart*, const SegmentBatch&, AnswerBatch&, void* scratch);
  void (*intersect)(const BatchPart*, const SegmentBatch&, const float* limit, HitBatch&, void* scratch);
};

/// Packed: may have `built_bytes()` and `reads_field`, which mean what ObjectKernel's do.
template <class Packed>
class SimdKernel : public ObjectKernel {
 public:
  /// `pack()` returns the field.
  template <class Pack>
  SimdKernel(const SimdFunctions<Packed>& functions, const Pack& pack)
      : functions_(functions), packed_(pack()) {}
  const SimdFunctions<Packed>& functions() const { return functions_; }
  const Packed& packed() const { return packed_; }

  void answer(const SegmentBatch& batch, AnswerBatch& answers, void* scratch) const override {
    functions_.answer(packed_, batch, answers, scratch);
  }
  void prove(const SegmentBatch& batch, AnswerBatch& answers, OpenBatch& open, void* scratch) const override {
    if (functions_.prove == nullptr)
      ObjectKernel::prove(batch, answers, open, scratch);
    else
      functions_.prove(packed_, batch, answers, open, scratch);
  }
  void intersect(const SegmentBatch& batch, const float* limit, HitBatch& hits,
                 void* scratch) const override {
    functions_.intersect(packed_, batch, limit, hits, scratch);
  }
  void move(const MovedTriangles& moved) override {
    if (functions_.move != nullptr) functions_.move(packed_, moved);
  }
  void skin(const SkinOrder& order, const JointMatrix* matrices, const float (*from)[4],
            float (*to)[4]) const override {
    if (functions_.skin != nullptr) functions_.skin(order, matrices, from, to);
  }
  bool reads_nodes() const override {
    if constexpr (requires { packed_.reads_nodes(); }) return packed_.reads_nodes();
    return true;
  }
  BuiltBytes built_bytes() const override {
    if constexpr (requires { packed_.built_bytes(); }) return packed_.built_bytes();
    return {};
  }
  bool reads_field() const override {
    if constexpr (requires { packed_.reads_field; }) return packed_.reads_field;
    return true;
  }

 private:
  SimdFunctions<Packed> functions_;
  Packed packed_;
};

}  // namespace nif::kernels::cpu
