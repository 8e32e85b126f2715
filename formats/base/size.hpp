// Converts sizes to memory sizes. Files use 64 bits on every machine, but memory only as many as its
// addresses have.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <new>

namespace nif {

/// A size, count or offset in memory. Throws std::bad_alloc if it exceeds the address space.
inline size_t memory_size(uint64_t size) {
  if (size > std::numeric_limits<size_t>::max()) throw std::bad_alloc();
  return size_t(size);
}

}  // namespace nif
