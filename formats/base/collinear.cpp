// Three points in space are collinear if all of their projections onto the coordinate planes are.
#include "formats/base/collinear.hpp"

#include "formats/base/orientation.hpp"

namespace nif {

int turn(const std::array<float, 3>& a, const std::array<float, 3>& b, const std::array<float, 3>& c,
         size_t x, size_t y) {
  const double side = orientation({a[x], a[y]}, {b[x], b[y]}, {c[x], c[y]});
  return (side > 0) - (side < 0);
}

bool collinear(const std::array<float, 3>& a, const std::array<float, 3>& b, const std::array<float, 3>& c) {
  return turn(a, b, c, 0, 1) == 0 && turn(a, b, c, 1, 2) == 0 && turn(a, b, c, 2, 0) == 0;
}

}  // namespace nif
