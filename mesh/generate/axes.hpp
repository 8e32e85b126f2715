// Computes directions perpendicular to given ones.
#pragma once

#include <cmath>

#include "formats/base/vector.hpp"

namespace nif::generate {

/// `a` scaled to length 1; it must not be zero.
inline Double3 unit(const Double3& a) { return a * (1 / length(a)); }

/// Some direction perpendicular to `a`, which has length 1.
inline Double3 perpendicular(const Double3& a) {
  return unit(cross(a, std::fabs(a[1]) < 0.7 ? Double3{0, 1, 0} : Double3{1, 0, 0}));
}

}  // namespace nif::generate
