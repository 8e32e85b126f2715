// Maps the triangles of an object to those of the source mesh: an object stores them in another order, and
// not all of them.
#pragma once

#include "kernels/reference/hit.hpp"
#include "kernels/reference/host_device.hpp"

namespace nif::kernels {

/// Numbers of equal bit width, 1 to 32, packed from the lowest bit of the first word on.
struct SourceTriangles {
  const uint32_t* words = nullptr;  ///< null if the object has no such numbers
  uint32_t bits = 0;
  uint32_t count = 0;  ///< one per triangle of the object
};

/// Bits needed for the index of one of `triangles` triangles, at least one.
NIF_HOST_DEVICE constexpr uint32_t source_bits(uint32_t triangles) {
  uint32_t bits = 1;
  while (bits < 32 && (triangles - 1) >> bits != 0) ++bits;
  return bits;
}
/// Words that this many numbers take.
NIF_HOST_DEVICE constexpr uint64_t source_words(uint64_t numbers, uint32_t bits) {
  return (numbers * bits + 31) / 32;
}

/// The source triangle for a triangle as the object stores it, or for kNoTriangle.
NIF_HOST_DEVICE inline uint32_t source_triangle(const SourceTriangles& source, uint32_t triangle) {
  if (source.words == nullptr || triangle == kNoTriangle) return triangle;
  const uint64_t first = uint64_t(triangle) * source.bits;
  const uint32_t* word = source.words + first / 32;
  const uint32_t shift = uint32_t(first % 32);
  uint32_t number = word[0] >> shift;
  if (shift + source.bits > 32) number |= word[1] << (32 - shift);
  return number & 0xffffffffu >> (32 - source.bits);
}

}  // namespace nif::kernels
