// Groups the sides of triangles by edge. Every question about how a surface is connected starts here.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "formats/mesh/mesh_scene.hpp"

namespace nif::mesh {

/// One side of a triangle.
struct Side {
  uint64_t edge;      ///< its two vertices, without direction
  uint32_t triangle;  ///< index of the triangle
  uint16_t corner;    ///< 0..2: the side runs from this corner to the next one
  int16_t sign;       ///< 1 if it runs from the smaller index to the larger one, otherwise -1
};

/// The three sides of each triangle, grouped by edge, in the order of the triangles. The numbers of triangles
/// in `more` continue those of `triangles`; together there must be fewer than 2^32. Each side takes 16 bytes.
/// Runs on all threads; the result does not depend on their number.
std::vector<Side> sorted_sides(std::span<const Triangle> triangles, std::span<const Triangle> more = {});

/// The same into `sides`, only for edges in the `part` of `parts`; each edge is in one part.
void sort_sides(std::span<const Triangle> triangles, std::span<const Triangle> more, size_t part,
                size_t parts, std::vector<Side>& sides);

/// The end of the consecutive sides that lie on the edge of sides[begin].
inline size_t end_of_edge(std::span<const Side> sides, size_t begin) {
  size_t end = begin + 1;
  while (end < sides.size() && sides[end].edge == sides[begin].edge) ++end;
  return end;
}

/// Calls visit(sides) with the sides of each edge, a span as in sorted_sides(), edge after edge in an order
/// that depends only on the triangles. Takes at most 40 MB, plus what is needed for an edge with more sides
/// than that holds: sides are collected for a part of the edges at a time. Calls come from the calling
/// thread.
template <class Visit>
void for_each_edge(std::span<const Triangle> triangles, std::span<const Triangle> more, Visit visit) {
  constexpr size_t kSidesAtOnce = size_t{1} << 21;
  const size_t parts = (triangles.size() + more.size()) * 3 / kSidesAtOnce + 1;
  std::vector<Side> sides;
  for (size_t part = 0; part < parts; ++part) {
    sort_sides(triangles, more, part, parts, sides);
    for (size_t begin = 0, end; begin < sides.size(); begin = end) {
      end = end_of_edge(sides, begin);
      visit(std::span<const Side>(sides).subspan(begin, end - begin));
    }
  }
}

}  // namespace nif::mesh
