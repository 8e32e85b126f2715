// The `segment` encoding in SIMD: the same bits as kernels/reference, many rays at a time.
#pragma once

#include <memory_resource>

#include "kernels/cpu/segment/packed_field.hpp"
#include "kernels/reference/object_kernel.hpp"

namespace nif::kernels::cpu {

/// Instruction sets that there are kernels for, of a family from narrow to wide.
enum class Isa { sse4, avx2, avx512, neon };

/// Whether this build has kernels for it and this machine can run them.
bool available(Isa isa);

class SimdSegmentKernel final : public ObjectKernel {
 public:
  /// As PackedField; the machine must have `isa`.
  SimdSegmentKernel(const SegmentField& field, size_t ample_bytes, Isa isa,
                    std::pmr::memory_resource* memory);

  void answer(const SegmentBatch& batch, AnswerBatch& answers, void* scratch) const override;
  size_t resident_bytes() const override { return field_.resident_bytes(); }
  bool reads_field() const override { return field_.reads_field; }

 private:
  using Answer = void (*)(const PackedField&, const SegmentBatch&, AnswerBatch&, void*);
  PackedField field_;
  Answer answer_;
};

}  // namespace nif::kernels::cpu
