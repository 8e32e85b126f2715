// Random numbers, vectors and sizes, as the generators of hostile meshes, rays and transforms draw them.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "formats/base/random.hpp"
#include "formats/base/vector.hpp"
#include "formats/mesh/box.hpp"

namespace nif::test {

/// A whole number, both ends among them.
inline int between(nif::Random& random, int low, int high) {
  return low + int(random.below(uint32_t(high - low + 1)));
}
inline bool chance(nif::Random& random, uint32_t one_in) { return random.below(one_in) == 0; }
inline double sign(nif::Random& random) { return random.below(2) ? 1 : -1; }
inline double power(nif::Random& random, int low, int high) {
  return std::ldexp(1, between(random, low, high));
}
/// As often near one power of two as near another.
inline double spread(nif::Random& random, double low, double high) {
  return std::exp2(random.uniform(std::log2(low), std::log2(high)));
}
/// Any direction, a length between both.
inline Double3 arrow(nif::Random& random, double low, double high) {
  const double size = spread(random, low, high);
  return random.direction() * size;
}
inline std::array<Double3, 3> random_rotation(nif::Random& random) {
  for (;;) {
    const Double3 x = random.direction(), other = random.direction(), n = cross(x, other);
    if (length(n) < 0.01) continue;
    const Double3 z = n * (1 / length(n));
    return {x, cross(z, x), z};
  }
}
inline float ulps_beside(float x, int steps) {
  for (; steps > 0; --steps) x = std::nextafter(x, kInfinity);
  for (; steps < 0; ++steps) x = std::nextafter(x, -kInfinity);
  return x;
}
/// Of small whole numbers, not all 0.
inline Double3 whole_vector(nif::Random& random, int most) {
  for (;;) {
    const Double3 v{double(between(random, -most, most)), double(between(random, -most, most)),
                    double(between(random, -most, most))};
    if (dot(v, v) > 0) return v;
  }
}

/// The largest coordinate of a box, and its longest side; not 0.
inline double extent_of(const mesh::Box& box) {
  double extent = std::numeric_limits<float>::denorm_min();
  for (size_t a = 0; a < 3; ++a)
    extent = std::max({extent, std::abs(double(box.min[a])), std::abs(double(box.max[a]))});
  return extent;
}
inline double size_of(const mesh::Box& box) {
  double size = std::numeric_limits<float>::denorm_min();
  for (size_t a = 0; a < 3; ++a) size = std::max(size, double(box.max[a]) - box.min[a]);
  return size;
}
/// A power of two, from the size of the box to 1/32 of it.
inline double step_of(const mesh::Box& box, nif::Random& random) {
  return std::ldexp(1, std::ilogb(size_of(box)) - between(random, 0, 5));
}

}  // namespace nif::test
