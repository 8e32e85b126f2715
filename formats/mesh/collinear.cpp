// Points of space are collinear where all three of their projections onto the coordinate planes are.
#include "formats/mesh/collinear.hpp"

#include "formats/mesh/orientation.hpp"

namespace nif::mesh {

int turn(const Float3& a, const Float3& b, const Float3& c, size_t x, size_t y) {
  const double side = detail::orientation({a[x], a[y]}, {b[x], b[y]}, {c[x], c[y]});
  return (side > 0) - (side < 0);
}

bool collinear(const Float3& a, const Float3& b, const Float3& c) {
  return turn(a, b, c, 0, 1) == 0 && turn(a, b, c, 1, 2) == 0 && turn(a, b, c, 2, 0) == 0;
}

}  // namespace nif::mesh
