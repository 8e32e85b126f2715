// Matrices as nif.h has them: row-major 3x4, in single precision.
#pragma once

#include <nif/nif.hpp>

#include <array>
#include <cmath>

using Float3 = std::array<float, 3>;
using nifkit::Transform;

inline constexpr Transform kIdentity{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

/// The one that moves by b first, then by a.
inline Transform operator*(const Transform& a, const Transform& b) {
  Transform c;
  for (size_t row = 0; row < 3; ++row)
    for (size_t column = 0; column < 4; ++column) {
      float sum = column == 3 ? a[4 * row + 3] : 0;
      for (size_t k = 0; k < 3; ++k) sum += a[4 * row + k] * b[4 * k + column];
      c[4 * row + column] = sum;
    }
  return c;
}

inline Transform inverse(const Transform& t) {
  const auto minor = [&](size_t r0, size_t r1, size_t c0, size_t c1) {
    return t[4 * r0 + c0] * t[4 * r1 + c1] - t[4 * r0 + c1] * t[4 * r1 + c0];
  };
  const float scale = 1 / (t[0] * minor(1, 2, 1, 2) - t[1] * minor(1, 2, 0, 2) + t[2] * minor(1, 2, 0, 1));
  Transform inverse{minor(1, 2, 1, 2),  -minor(0, 2, 1, 2), minor(0, 1, 1, 2),  0,
                    -minor(1, 2, 0, 2), minor(0, 2, 0, 2),  -minor(0, 1, 0, 2), 0,
                    minor(1, 2, 0, 1),  -minor(0, 2, 0, 1), minor(0, 1, 0, 1),  0};
  for (float& value : inverse) value *= scale;
  for (size_t row = 0; row < 3; ++row)
    for (size_t k = 0; k < 3; ++k) inverse[4 * row + 3] -= inverse[4 * row + k] * t[4 * k + 3];
  return inverse;
}

/// Turns about y by an angle, then moves. At 0 what faces +z still does; at a quarter turn it faces +x.
inline Transform placed(float angle, const Float3& at) {
  const float c = std::cos(angle), s = std::sin(angle);
  return {c, 0, s, at[0], 0, 1, 0, at[1], -s, 0, c, at[2]};
}
