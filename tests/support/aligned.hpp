// Allocates aligned memory: Windows lacks std::aligned_alloc.
#pragma once

#include <cstddef>
#include <new>

namespace nif::test {

/// Returns null if there is no memory. Free it by free_aligned() with the same alignment, a power of two.
inline void* allocate_aligned(size_t alignment, size_t bytes) {
  return ::operator new (bytes, std::align_val_t{alignment}, std::nothrow);
}
inline void free_aligned(size_t alignment, void* memory) {
  ::operator delete (memory, std::align_val_t{alignment});
}

/// Bytes aligned to 64, as assets and scratch need.
class AlignedBytes {
 public:
  explicit AlignedBytes(size_t bytes) : memory_(::operator new (bytes, std::align_val_t{64})) {}
  ~AlignedBytes() { free_aligned(64, memory_); }
  AlignedBytes(const AlignedBytes&) = delete;
  AlignedBytes& operator=(const AlignedBytes&) = delete;
  void* get() const { return memory_; }

 private:
  void* memory_;
};

}  // namespace nif::test
