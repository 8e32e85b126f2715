// Directions at right angles to given ones.
#pragma once

#include <cmath>

#include "formats/base/vector.hpp"

namespace nif::generate {

/// `a`, which is not zero, with length 1.
inline Double3 unit(const Double3& a) { return a * (1 / length(a)); }

/// Some direction at a right angle to `a`, which has length 1.
inline Double3 perpendicular(const Double3& a) {
  return unit(cross(a, std::fabs(a[1]) < 0.7 ? Double3{0, 1, 0} : Double3{1, 0, 0}));
}

}  // namespace nif::generate
