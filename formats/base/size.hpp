// Sizes in memory. Files count in 64 bits on every machine, and memory in as many as its addresses have.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <new>

namespace nif {

/// A size, count or offset in memory. Throws std::bad_alloc where addresses do not reach so far.
inline size_t memory_size(uint64_t size) {
  if (size > std::numeric_limits<size_t>::max()) throw std::bad_alloc();
  return size_t(size);
}

}  // namespace nif
