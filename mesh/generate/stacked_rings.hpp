// The connectivity of a sphere as a stack of rings of vertices: one vertex at each pole, four more per ring
// up to the body, whose rings are equal. If the body is about as high as wide, triangles have about equal
// sizes, unlike those of a sphere of longitudes and latitudes.
#pragma once

#include <cstdint>

#include "formats/mesh/mesh_scene.hpp"

namespace nif::generate {

class StackedRings {
 public:
  /// At most `triangles` (100 or more). The body has about `rings_a_turn` rings for each vertex of a ring.
  StackedRings(uint64_t triangles, double rings_a_turn);

  uint64_t vertex_count() const { return 2 * start(cap_) + (body_ + 1) * 4 * cap_; }
  uint64_t triangle_count() const { return 8 * cap_ * (cap_ + body_); }

  struct Place {
    double turns;      ///< about the axis, 0 to 1, counter-clockwise seen from above
    double elevation;  ///< -1 at the lower pole, 0 on the body, 1 at the upper pole
    double height;     ///< 0 below the body, 1 above it
  };
  /// Position of the vertex with this number; numbers rise from the lower pole to the upper.
  Place place(uint64_t vertex) const;
  mesh::Triangle triangle(uint64_t index) const;

 private:
  /// Number of vertices of a cap before its ring `k` from the pole, which has 4 k of them (one for k = 0).
  static uint64_t start(uint64_t k) { return k == 0 ? 0 : 1 + 2 * k * (k - 1); }
  uint32_t lower(uint64_t k, uint64_t at) const;  ///< vertex of the lower cap's ring k; `at` wraps around
  uint32_t upper(uint64_t k, uint64_t at) const;  ///< of the upper cap, which is the lower one upside down

  uint64_t cap_;   ///< strips from a pole to the body
  uint64_t body_;  ///< strips of the body
};

}  // namespace nif::generate
