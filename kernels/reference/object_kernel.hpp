// The interface between the runtime and an object, for every encoding and instruction set: it answers many
// rays at a time, in object space.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <memory_resource>
#include <utility>

namespace nif::kernels {

/// Rays of one call, at most. Large enough that idle SIMD lanes at the ends of batches do not matter; small
/// enough that a batch and a kernel's notes about it stay in the second-level cache.
inline constexpr uint32_t kBatchRays = 1024;
/// Entries of each column of a batch: room for a last vector that is written whole. If columns began 4,096
/// bytes apart, a load from one would wait for stores to the others (docs/results/cpu-kernels.md, "Columns").
inline constexpr uint32_t kBatchRoom = kBatchRays + 16;

/// Segments in object space, component by component. Entries from `count` on are undefined.
struct SegmentBatch {
  uint32_t count;
  alignas(64) float origin[3][kBatchRoom];
  float direction[3][kBatchRoom];
  float tmin[kBatchRoom], tmax[kBatchRoom];
};

/// Entry i answers segment i: visible if logit[i] >= 0; +-kCertainLogit if no network was evaluated.
struct AnswerBatch {
  alignas(64) int32_t logit[kBatchRoom];
  uint8_t certain[kBatchRoom];  ///< 0 or 1
};

/// The interval of each segment that is left open, as t. Entry i is defined if answer i is not certain.
struct OpenBatch {
  alignas(64) float begin[kBatchRoom];
  float end[kBatchRoom];
};

/// Leaves the whole of each segment open.
inline void open_whole(const SegmentBatch& batch, OpenBatch& open) {
  std::copy_n(batch.tmin, batch.count, open.begin);
  std::copy_n(batch.tmax, batch.count, open.end);
}

/// Entry i is the first hit of segment i. The members are those of kernels::Hit.
struct HitBatch {
  alignas(64) float t[kBatchRoom];
  float low[kBatchRoom], high[kBatchRoom];
  float normal[3][kBatchRoom];
  uint32_t triangle[kBatchRoom];
  float u[kBatchRoom], v[kBatchRoom];
};

/// Working memory of a kernel, one block per thread; 64-byte aligned. Nothing is kept in it between calls.
inline constexpr size_t kKernelScratchBytes = 512 * 1024;

/// Memory that a kernel holds besides the field that it was made from.
struct BuiltBytes {
  size_t traversal_words = 0;    ///< kernels/packed/traversal_words.hpp
  size_t corner_bricks = 0;      ///< kernels/packed/corner_bricks.hpp
  size_t decoded_triangles = 0;  ///< kernels/cpu/triangles/decoded_tree.hpp
};

struct MovedTriangles;
struct SkinOrder;
struct JointMatrix;

class ObjectKernel;
/// Rays of a batch that ask one object: those before number `end` that no earlier part has. At least one.
struct BatchPart {
  const ObjectKernel* kernel;
  uint32_t end;
};

class ObjectKernel {
 public:
  virtual ~ObjectKernel() = default;
  /// Answers batch.count segments with exactly the bits of kernels/reference. Thread-safe; allocates nothing;
  /// `scratch` has kKernelScratchBytes.
  virtual void answer(const SegmentBatch& batch, AnswerBatch& answers, void* scratch) const = 0;
  /// The same by proofs alone, if the encoding has any: where the answer is not certain, `open` gets the part
  /// of the segment that must still be tested. By default that is the whole segment.
  virtual void prove(const SegmentBatch& batch, AnswerBatch& answers, OpenBatch& open, void* scratch) const {
    answer(batch, answers, scratch);
    open_whole(batch, open);
  }
  /// Finds the first hit of batch.count segments with exactly the bits of kernels/reference. `limit`
  /// [batch.count] is described at intersect().
  virtual void intersect(const SegmentBatch& batch, const float* limit, HitBatch& hits,
                         void* scratch) const = 0;
#ifdef __wasm__  // On a web page the code is too much to download.
  static uint32_t kind() { return 0; }
  static void answer_parts(const BatchPart*, const SegmentBatch&, AnswerBatch&, void*) {}
  static void intersect_parts(const BatchPart*, const SegmentBatch&, const float*, HitBatch&, void*) {}
#else
  /// Kernels of the same kind answer the rays of several objects in one call: many objects with few rays each then keep as
  /// many rays in flight as one object with many. 0: each must be called for itself.
  virtual uint32_t kind() const { return 0; }
  /// answer() and intersect() for a batch whose parts ask kernels of this one's kind. The last part ends with the batch.
  virtual void answer_parts(const BatchPart*, const SegmentBatch&, AnswerBatch&, void*) const {}
  virtual void intersect_parts(const BatchPart*, const SegmentBatch&, const float*, HitBatch&, void*) const {}
#endif
  /// Asks about other corners from now on: the triangles of a `bvh` object have moved. Not while another thread uses the
  /// kernel. Allocates nothing. Only for kernels that were made of a field of triangles, to be moved.
  virtual void move(const MovedTriangles&) {}
  /// skin_vertices() of kernels/reference/triangles/skin.hpp, with exactly its bits. For kernels that move().
  virtual void skin(const SkinOrder&, const JointMatrix*, const float (*)[4], float (*)[4]) const {}
  /// Whether move() and queries read nodes and vertices of the field.
  virtual bool reads_nodes() const { return true; }
  virtual BuiltBytes built_bytes() const { return {}; }
  /// Whether the kernel reads the field's memory, which must then stay valid.
  virtual bool reads_field() const { return true; }
};

/// Returns a kernel's memory to its allocator.
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
