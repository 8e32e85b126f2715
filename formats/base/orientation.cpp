// The sign of a determinant of six products of two floats. Each product is exact in double (48 of 53 bits;
// the exponents fit by far), so only their sum needs care; it is kept as Shewchuk's expansion ("Adaptive
// Precision Floating-Point Arithmetic", 1997), a sum of doubles that do not overlap, the largest last.
#include "formats/base/orientation.hpp"

#include <array>
#include <cstddef>

namespace nif {

double exact_orientation(const Point2& a, const Point2& b, const Point2& c) {
  const std::array<double, 6> terms{a.x * b.y,    -(a.y * b.x), b.x * c.y,
                                    -(b.y * c.x), c.x * a.y,    -(c.y * a.x)};
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
  for (size_t n = parts.size(); n-- > 0;)
    if (parts[n] != 0) return parts[n];
  return 0;
}

}  // namespace nif
