// The sides of triangles, brought together where they lie on the same edge: what every question about how a
// surface hangs together starts from.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "formats/mesh/scene.hpp"

namespace nif::mesh {

/// One side of a triangle.
struct Side {
  uint64_t edge;      ///< its two vertices, without direction
  uint32_t triangle;  ///< index of the triangle
  uint16_t corner;    ///< 0..2: the side runs from this corner to the next one
  int16_t sign;       ///< 1 where it runs from the smaller index to the larger one, else -1
};

/// The three sides of each triangle, those of an edge side by side, in the order of the triangles. Triangles
/// of `more` are counted on from those of `triangles`; together they must be fewer than 2^32. Each side takes
/// 16 bytes. Runs on all threads; the result does not depend on their number.
std::vector<Side> sorted_sides(std::span<const Triangle> triangles, std::span<const Triangle> more = {});

/// The end of the run of sides that lie on the edge of sides[begin].
inline size_t end_of_edge(std::span<const Side> sides, size_t begin) {
  size_t end = begin + 1;
  while (end < sides.size() && sides[end].edge == sides[begin].edge) ++end;
  return end;
}

}  // namespace nif::mesh
