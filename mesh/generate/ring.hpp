// A ring: a torus at any position, as a grid of quads that is closed in both directions.
#pragma once

#include <cstdint>

#include "formats/base/vector.hpp"
#include "formats/mesh/mesh_scene.hpp"
#include "mesh/generate/turn.hpp"

namespace nif::generate {

/// How finely a ring is tessellated.
struct RingGrid {
  uint32_t around = 3, across = 3;  ///< quads along the ring and around its wire, at least 3 each

  /// Approximately square quads, each of two triangles, at most `triangles` (18 or more) in all, on a ring
  /// whose radius is `slimness` times that of its wire.
  static RingGrid of(uint64_t triangles, double slimness);

  uint64_t vertex_count() const { return uint64_t{around} * across; }
  uint64_t triangle_count() const { return 2 * vertex_count(); }
  mesh::Triangle triangle(uint64_t index) const;
};

struct Ring {
  Double3 centre{0, 0, 0};
  Double3 x{1, 0, 0}, y{0, 0, -1};  ///< perpendicular unit vectors in the plane of the ring
  double radius = 1;                ///< of the circle in the centre of the wire
  double wire = 0.1;                ///< radius of the wire

  /// The vertex with this number.
  Double3 vertex(const RingGrid& grid, uint64_t index) const;
};

}  // namespace nif::generate
