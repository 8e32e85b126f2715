// A closed tube: rings of vertices one after the other, and one more vertex at each end.
#pragma once

#include <cstdint>

#include "formats/mesh/scene.hpp"

namespace nif::generate {

/// Vertices: that of the first end, then ring after ring, then that of the last end. A ring runs
/// counter-clockwise where one looks back from the last end to the first.
struct Tube {
  uint64_t sides, rings;  ///< 3 or more, 2 or more

  uint64_t vertex_count() const { return sides * rings + 2; }
  uint64_t triangle_count() const { return 2 * sides * rings; }
  /// `base` is the number of the first vertex.
  mesh::Triangle triangle(uint64_t index, uint64_t base) const {
    const auto ring = [&](uint64_t i, uint64_t j) { return uint32_t(base + 1 + i * sides + j % sides); };
    if (index < sides) return {ring(0, index + 1), ring(0, index), uint32_t(base)};
    index -= sides;
    const uint64_t quad = index / 2, i = quad / sides, j = quad % sides;
    if (i + 1 == rings) {
      const uint64_t last = index - 2 * sides * (rings - 1);
      return {ring(i, last), ring(i, last + 1), uint32_t(base + vertex_count() - 1)};
    }
    if (index % 2 == 0) return {ring(i, j), ring(i, j + 1), ring(i + 1, j + 1)};
    return {ring(i, j), ring(i + 1, j + 1), ring(i + 1, j)};
  }
};

}  // namespace nif::generate
