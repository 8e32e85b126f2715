// A closed slab: a grid of quads on top, walls down from its border, and a bottom.
#pragma once

#include <cstdint>

#include "formats/mesh/mesh_scene.hpp"

namespace nif::generate {

/// Order of vertices: the top in rows, the bottom's border, the bottom's centre. Order of triangles: the top,
/// the walls, the bottom as a fan around its centre. Seen from above, i points to the right and k towards the
/// viewer.
struct Slab {
  uint64_t nx, nz;  ///< quads of the top along i and k

  struct Point {
    uint64_t i, k;
  };

  uint64_t top_vertices() const { return (nx + 1) * (nz + 1); }
  uint64_t border() const { return 2 * (nx + nz); }
  uint64_t vertex_count() const { return top_vertices() + border() + 1; }
  uint64_t triangle_count() const { return 2 * nx * nz + 3 * border(); }

  uint32_t top(uint64_t i, uint64_t k) const { return uint32_t(k * (nx + 1) + i); }
  Point top_point(uint64_t vertex) const { return {vertex % (nx + 1), vertex / (nx + 1)}; }
  /// A point along the border, counter-clockwise seen from above.
  Point border_point(uint64_t at) const {
    if (at < nz) return {0, at};
    if (at < nz + nx) return {at - nz, nz};
    if (at < 2 * nz + nx) return {nx, 2 * nz + nx - at};
    return {border() - at, 0};
  }

  mesh::Triangle triangle(uint64_t index) const {
    if (index < 2 * nx * nz) {
      const uint64_t quad = index / 2, i = quad % nx, k = quad / nx;
      const uint32_t a = top(i, k), b = top(i, k + 1), c = top(i + 1, k + 1), d = top(i + 1, k);
      return index % 2 == 0 ? mesh::Triangle{a, b, c} : mesh::Triangle{a, c, d};
    }
    index -= 2 * nx * nz;
    const uint64_t of_wall = 2 * border();
    const uint64_t at = index < of_wall ? index / 2 : index - of_wall,
                   after = at + 1 == border() ? 0 : at + 1;
    const auto low = uint32_t(top_vertices() + at), low_after = uint32_t(top_vertices() + after);
    if (index >= of_wall) return {low_after, low, uint32_t(vertex_count() - 1)};
    const auto [i, k] = border_point(at);
    const auto [i_after, k_after] = border_point(after);
    return index % 2 == 0 ? mesh::Triangle{low, low_after, top(i_after, k_after)}
                          : mesh::Triangle{low, top(i_after, k_after), top(i, k)};
  }
};

}  // namespace nif::generate
