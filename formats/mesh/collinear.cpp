// Points of space are collinear where all three of their projections onto the coordinate planes are.
#include "formats/mesh/collinear.hpp"

#include "formats/mesh/orientation.hpp"

namespace nif::mesh {

bool collinear(const Float3& a, const Float3& b, const Float3& c) {
  const auto in_plane = [&](size_t x, size_t y) {
    return detail::orientation({a[x], a[y]}, {b[x], b[y]}, {c[x], c[y]}) == 0;
  };
  return in_plane(0, 1) && in_plane(1, 2) && in_plane(2, 0);
}

}  // namespace nif::mesh
