// Double-precision 3-vectors, for geometry that is not critical for speed.
#pragma once

#include <array>
#include <cmath>
#include <limits>

namespace nif {

/// The end of an unbounded ray.
inline constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// A distinct type, so that its operators are found from every namespace.
struct Double3 : std::array<double, 3> {};

inline Double3 to_double(const std::array<float, 3>& a) { return {a[0], a[1], a[2]}; }
inline std::array<float, 3> to_float(const Double3& a) { return {float(a[0]), float(a[1]), float(a[2])}; }
inline Double3 operator+(const Double3& a, const Double3& b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
inline Double3 operator-(const Double3& a, const Double3& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
inline Double3 operator*(const Double3& a, double s) { return {a[0] * s, a[1] * s, a[2] * s}; }
inline double dot(const Double3& a, const Double3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
inline Double3 cross(const Double3& a, const Double3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline double length(const Double3& a) { return std::sqrt(dot(a, a)); }

}  // namespace nif
