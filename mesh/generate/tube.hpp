// A closed tube: rings of vertices one after the other, and one more vertex at each end.
#pragma once

#include <cstdint>

#include "formats/mesh/mesh_scene.hpp"

namespace nif::generate {

/// Order of vertices: the one at the first end, then ring after ring, then the one at the last end. Rings run
/// counter-clockwise seen from the last end.
struct Tube {
  uint64_t sides, rings;  ///< at least 3, at least 2

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
