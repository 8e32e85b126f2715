// Reads and fills structures that cross the C boundary. They carry their size, so that old programs work with
// new libraries.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <string>

#include "api/error.hpp"
#include "nif/nif.h"

namespace nif::runtime {

/// A size beyond this comes from uninitialised memory, not from a newer header.
inline constexpr uint64_t kMaxStructure = 4096;

/// With 32-bit pointers, as in WebAssembly, program and library are always compiled together.
template <class Structure>
constexpr uint64_t on_64_bits(uint64_t bytes) {
  return sizeof(void*) == 8 ? bytes : sizeof(Structure);
}

/// Size of a structure in the first frozen version of nif.h, the least that any program passes. These numbers
/// never change. A structure that is added later gets the size that it first had.
template <class Structure>
inline constexpr uint64_t kFirstSize = 0;
template <>
inline constexpr uint64_t kFirstSize<NifDeviceCallbacks> = on_64_bits<NifDeviceCallbacks>(48);
template <>
inline constexpr uint64_t kFirstSize<NifReader> = on_64_bits<NifReader>(40);
template <>
inline constexpr uint64_t kFirstSize<NifRays> = on_64_bits<NifRays>(160);
template <>
inline constexpr uint64_t kFirstSize<NifAnswers> = on_64_bits<NifAnswers>(48);
template <>
inline constexpr uint64_t kFirstSize<NifOpenRays> = on_64_bits<NifOpenRays>(56);
template <>
inline constexpr uint64_t kFirstSize<NifHits> = on_64_bits<NifHits>(112);
template <>
inline constexpr uint64_t kFirstSize<NifDeviceInfo> = on_64_bits<NifDeviceInfo>(40);
template <>
inline constexpr uint64_t kFirstSize<NifBackendInfo> = on_64_bits<NifBackendInfo>(32);
template <>
inline constexpr uint64_t kFirstSize<NifGpuInfo> = on_64_bits<NifGpuInfo>(104);
template <>
inline constexpr uint64_t kFirstSize<NifAssetInfo> = on_64_bits<NifAssetInfo>(80);
template <>
inline constexpr uint64_t kFirstSize<NifPartInfo> = on_64_bits<NifPartInfo>(32);
template <>
inline constexpr uint64_t kFirstSize<NifObjectInfo> = on_64_bits<NifObjectInfo>(96);
template <>
inline constexpr uint64_t kFirstSize<NifAssetInstanceInfo> = on_64_bits<NifAssetInstanceInfo>(88);
template <>
inline constexpr uint64_t kFirstSize<NifInstanceInfo> = on_64_bits<NifInstanceInfo>(112);
template <>
inline constexpr uint64_t kFirstSize<NifPose> = on_64_bits<NifPose>(32);
template <>
inline constexpr uint64_t kFirstSize<NifSceneInfo> = on_64_bits<NifSceneInfo>(80);

/// Checks `size`, and returns it as a size_t.
inline size_t check_structure_size(uint64_t size, uint64_t least, const char* name) {
  if (size < least || size > kMaxStructure)
    refuse_argument(std::string(name) + ": struct_size is " + std::to_string(size) +
                    ", which is not the structure's size");
  return size_t(size);
}

/// Copies a structure that the caller passes in. Members of a newer header that this one lacks must be zero;
/// members that an older header lacks are zero in the copy.
template <class T>
T read_structure(const T* from, const char* name) {
  static_assert(kFirstSize<T> != 0 && kFirstSize<T> <= sizeof(T), "structures only grow");
  require_argument(from, name);
  const size_t size = check_structure_size(from->struct_size, kFirstSize<T>, name);
  T copy{};
  std::memcpy(static_cast<void*>(&copy), from, std::min(size, sizeof(T)));
  const char* bytes = reinterpret_cast<const char*>(from);
  if (size > sizeof(T) && std::any_of(bytes + sizeof(T), bytes + size, [](char c) { return c != 0; }))
    throw Failure(NIF_ERROR_NOT_AVAILABLE,
                  std::string(name) + ": uses a feature of a newer version of nifkit");
  return copy;
}

/// Fills a caller's structure up to its size; members of a newer header that this one lacks become zero.
template <class T>
void write_structure(T* to, T value, const char* name) {
  static_assert(kFirstSize<T> != 0 && kFirstSize<T> <= sizeof(T), "structures only grow");
  require_argument(to, name);
  const size_t size = check_structure_size(to->struct_size, kFirstSize<T>, name);
  value.struct_size = size;
  std::memcpy(static_cast<void*>(to), &value, std::min(size, sizeof(T)));
  if (size > sizeof(T)) std::memset(reinterpret_cast<char*>(to) + sizeof(T), 0, size - sizeof(T));
}

}  // namespace nif::runtime
