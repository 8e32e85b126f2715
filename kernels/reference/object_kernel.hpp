// What the runtime asks of an object, whatever its encoding and whatever instruction set answers: many rays
// at a time, in object space.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <memory_resource>
#include <utility>

namespace nif::kernels {

/// Rays of one call at most. Large enough that the ends of batches, where SIMD lanes idle, do not count;
/// small enough that a batch and what kernels write about it stay in the second-level cache.
inline constexpr uint32_t kBatchRays = 1024;

/// Segments in object space, component by component. Entries from `count` on have no meaning.
struct SegmentBatch {
  uint32_t count;
  alignas(64) float origin[3][kBatchRays];
  float direction[3][kBatchRays];
  float tmin[kBatchRays], tmax[kBatchRays];
};

/// Entry i answers segment i: visible where logit[i] >= 0; +-kCertainLogit where no network was asked.
struct AnswerBatch {
  alignas(64) int32_t logit[kBatchRays];
  uint8_t certain[kBatchRays];  ///< 0 or 1
};

/// Where segments are left open, as t; entry i has a meaning where answer i is not certain.
struct OpenBatch {
  alignas(64) float begin[kBatchRays];
  float end[kBatchRays];
};

/// Entry i is the first hit of segment i: members as in kernels::Hit.
struct HitBatch {
  alignas(64) float t[kBatchRays];
  float low[kBatchRays], high[kBatchRays];
  float normal[3][kBatchRays];
  uint32_t triangle[kBatchRays];
  float u[kBatchRays], v[kBatchRays];
};

/// Memory for a kernel to work in, one for each thread; 64-byte aligned, nothing is kept in it between calls.
inline constexpr size_t kKernelScratchBytes = 512 * 1024;

/// Memory that a kernel holds besides the field that it was made from.
struct BuiltBytes {
  size_t walk_words = 0;     ///< kernels/packed/walk_words.hpp
  size_t corner_bricks = 0;  ///< kernels/packed/corner_bricks.hpp
};

class ObjectKernel {
 public:
  virtual ~ObjectKernel() = default;
  /// Answers batch.count segments, as kernels/reference says, to the bit. Thread-safe; allocates nothing;
  /// `scratch` is kKernelScratchBytes.
  virtual void answer(const SegmentBatch& batch, AnswerBatch& answers, void* scratch) const = 0;
  /// The same by proofs alone, where the encoding has some: `open` gets the part of each segment that has to
  /// be looked at where the answer is not certain. By default, all of it.
  virtual void prove(const SegmentBatch& batch, AnswerBatch& answers, OpenBatch& open, void* scratch) const {
    answer(batch, answers, scratch);
    std::copy_n(batch.tmin, batch.count, open.begin);
    std::copy_n(batch.tmax, batch.count, open.end);
  }
  /// Finds the first hit of batch.count segments, as kernels/reference says, to the bit. `limit`:
  /// [batch.count], as intersect() has it.
  virtual void intersect(const SegmentBatch& batch, const float* limit, HitBatch& hits,
                         void* scratch) const = 0;
  virtual BuiltBytes built_bytes() const { return {}; }
  /// Whether it reads the memory of that field, which then must stay.
  virtual bool reads_field() const { return true; }
};

/// Gives a kernel's memory back to where it came from.
struct KernelDeleter {
  std::pmr::memory_resource* memory = nullptr;
  size_t bytes = 0, alignment = 0;
  void operator()(ObjectKernel* kernel) const {
    kernel->~ObjectKernel();
    memory->deallocate(kernel, bytes, alignment);
  }
};
using KernelPointer = std::unique_ptr<ObjectKernel, KernelDeleter>;

/// Makes a kernel in the given memory.
template <class Kernel, class... Arguments>
KernelPointer hold_kernel(std::pmr::memory_resource* memory, Arguments&&... arguments) {
  void* at = memory->allocate(sizeof(Kernel), alignof(Kernel));
  try {
    return {new (at) Kernel(std::forward<Arguments>(arguments)...),
            KernelDeleter{memory, sizeof(Kernel), alignof(Kernel)}};
  } catch (...) {
    memory->deallocate(at, sizeof(Kernel), alignof(Kernel));
    throw;
  }
}

}  // namespace nif::kernels
