// Aligned memory. std::aligned_alloc would do, but for Windows, which lacks it.
#pragma once

#include <cstddef>
#include <new>

namespace nif::test {

/// Null where there is no memory. For free_aligned() of the same alignment, a power of two.
inline void* allocate_aligned(size_t alignment, size_t bytes) {
  return ::operator new (bytes, std::align_val_t{alignment}, std::nothrow);
}
inline void free_aligned(size_t alignment, void* memory) {
  ::operator delete (memory, std::align_val_t{alignment});
}

/// Bytes as assets and scratch want them: aligned to 64.
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
