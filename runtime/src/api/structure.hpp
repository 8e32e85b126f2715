// Structures that cross the C boundary carry their size, so that old programs work with new libraries.
#pragma once

#include <algorithm>
#include <cstring>
#include <string>

#include "api/error.hpp"

namespace nif::runtime {

/// A size beyond this is no newer header but memory that nobody has initialised.
inline constexpr uint64_t kMaxStructure = 4096;

/// `size` again, which it then fits.
inline size_t check_structure_size(uint64_t size, uint64_t least, const char* name) {
  if (size < least || size > kMaxStructure)
    refuse_argument(std::string(name) + ": struct_size is " + std::to_string(size) +
                    ", which is not the structure's size");
  return size_t(size);
}

/// A copy of a structure that the caller passes in. What a newer header has beyond ours must be zero; what an
/// older one lacks, which has at least `least` bytes, is zero in the copy.
template <class T>
T read_structure(const T* from, const char* name, uint64_t least = sizeof(T)) {
  require_argument(from, name);
  const size_t size = check_structure_size(from->struct_size, least, name);
  T copy{};
  std::memcpy(static_cast<void*>(&copy), from, std::min(size, sizeof(T)));
  const char* bytes = reinterpret_cast<const char*>(from);
  if (size > sizeof(T) && std::any_of(bytes + sizeof(T), bytes + size, [](char c) { return c != 0; }))
    throw Failure(NIF_ERROR_NOT_AVAILABLE,
                  std::string(name) + ": uses a feature of a newer version of nifkit");
  return copy;
}

/// Fills a structure of the caller's as far as it goes; what a newer header has beyond ours becomes zero.
template <class T>
void write_structure(T* to, T value, const char* name) {
  require_argument(to, name);
  const size_t size = check_structure_size(to->struct_size, sizeof(uint64_t), name);
  value.struct_size = size;
  std::memcpy(static_cast<void*>(to), &value, std::min(size, sizeof(T)));
  if (size > sizeof(T)) std::memset(reinterpret_cast<char*>(to) + sizeof(T), 0, size - sizeof(T));
}

}  // namespace nif::runtime
