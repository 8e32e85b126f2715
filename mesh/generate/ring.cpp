// Computes a vertex or triangle from its number, so that nothing is stored. Indices wrap around in both
// directions, which closes the ring.
#include "mesh/generate/ring.hpp"

#include <algorithm>
#include <cmath>

namespace nif::generate {

RingGrid RingGrid::of(uint64_t triangles, double slimness) {
  const uint64_t quads = triangles / 2;
  const uint64_t across =
      std::clamp<uint64_t>(uint64_t(std::sqrt(double(quads) / slimness) + 0.5), 3, quads / 3);
  return {uint32_t(quads / across), uint32_t(across)};
}

mesh::Triangle RingGrid::triangle(uint64_t index) const {
  const auto quad = uint32_t(index / 2), i = quad / across, k = quad % across;
  const uint32_t row = i * across, next = i + 1 == around ? 0 : row + across,
                 up = k + 1 == across ? 0 : k + 1;
  if (index % 2 == 0) return {row + k, next + k, next + up};
  return {row + k, next + up, row + up};
}

Double3 Ring::vertex(const RingGrid& grid, uint64_t index) const {
  const Turn u = turn(double(index / grid.across) / grid.around),
             v = turn(double(index % grid.across) / grid.across);
  return centre + (x * u.cos + y * u.sin) * (radius + wire * v.cos) + cross(x, y) * (wire * v.sin);
}

}  // namespace nif::generate
