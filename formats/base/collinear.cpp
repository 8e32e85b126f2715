// Points of space are collinear where all three of their projections onto the coordinate planes are. In a
// plane that is the vanishing of a determinant of six products of two floats. Each product is exact in double
// (48 of 53 bits; the exponents fit by far), so only their sum needs care; it is kept as Shewchuk's expansion
// ("Adaptive Precision Floating-Point Arithmetic", 1997), a sum of doubles that do not overlap.
#include "formats/base/collinear.hpp"

#include <cmath>
#include <cstddef>

namespace nif {
namespace {

using Float3 = std::array<float, 3>;

bool sum_vanishes(const std::array<double, 6>& terms) {
  std::array<double, 6> parts{};
  for (size_t n = 0; n < terms.size(); ++n) {
    double carry = terms[n];
    for (size_t i = 0; i < n; ++i) {
      const double sum = carry + parts[i];
      const double virtual_part = sum - carry;
      parts[i] = (carry - (sum - virtual_part)) + (parts[i] - virtual_part);
      carry = sum;
    }
    parts[n] = carry;
  }
  for (const double part : parts) {
    if (part != 0) return false;
  }
  return true;
}

bool collinear_in_plane(const Float3& a, const Float3& b, const Float3& c, size_t x, size_t y) {
  const double ax = a[x], ay = a[y], bx = b[x], by = b[y], cx = c[x], cy = c[y];
  // Almost every triangle ends here: the rounding error of the plain determinant is below 3.4e-16 of this
  // sum.
  const double left = (bx - ax) * (cy - ay), right = (by - ay) * (cx - ax);
  if (std::abs(left - right) > 4e-16 * (std::abs(left) + std::abs(right))) return false;
  return sum_vanishes({ax * by, -(ay * bx), bx * cy, -(by * cx), cx * ay, -(cy * ax)});
}

}  // namespace

bool collinear(const Float3& a, const Float3& b, const Float3& c) {
  return collinear_in_plane(a, b, c, 0, 1) && collinear_in_plane(a, b, c, 1, 2) &&
         collinear_in_plane(a, b, c, 2, 0);
}

}  // namespace nif
