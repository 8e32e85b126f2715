// Applies and composes affine transforms of points and normals.
#pragma once

#include <array>
#include <cmath>

#include "formats/base/rounding.hpp"
#include "formats/base/vector.hpp"
#include "formats/mesh/mesh_scene.hpp"

namespace nif::mesh {

/// Like Transform, in double precision.
using Affine = std::array<double, 12>;

inline Float3 transformed(const Transform& t, const Float3& p) {
  Float3 out;
  for (size_t row = 0; row < 3; ++row)
    out[row] = t[4 * row] * p[0] + t[4 * row + 1] * p[1] + t[4 * row + 2] * p[2] + t[4 * row + 3];
  return out;
}

/// The transformed position, before rounding.
inline Double3 placed(const Transform& t, const Double3& remainder, const Float3& p) {
  Double3 out;
  for (size_t row = 0; row < 3; ++row)
    out[row] = double(t[4 * row]) * p[0] + double(t[4 * row + 1]) * p[1] + double(t[4 * row + 2]) * p[2] +
               (double(t[4 * row + 3]) + remainder[row]);
  return out;
}
inline Double3 placed(const Instance& instance, const Float3& p) {
  return placed(instance.transform, instance.remainder, p);
}
/// Whether the instance does not move its mesh.
inline bool unplaced(const Instance& instance) {
  return instance.transform == kIdentity && instance.remainder == Double3{};
}

/// Applies `inner`, then `outer`.
inline Transform compose(const Transform& outer, const Transform& inner) {
  Transform out;
  for (size_t row = 0; row < 3; ++row)
    for (size_t k = 0; k < 4; ++k) {
      double sum = k == 3 ? outer[4 * row + 3] : 0;
      for (size_t j = 0; j < 3; ++j) sum += double(outer[4 * row + j]) * inner[4 * j + k];
      out[4 * row + k] = float(sum);
    }
  return out;
}

/// The same for an instance; the remainder of its translation is kept, if it had one.
inline Instance placed(const Transform& outer, Instance instance) {
  const Double3 inner =
      to_double(std::array{instance.transform[3], instance.transform[7], instance.transform[11]}) +
      instance.remainder;
  instance.transform = compose(outer, instance.transform);
  if (instance.remainder == Double3{}) return instance;
  for (size_t row = 0; row < 3; ++row) {
    double sum = outer[4 * row + 3];
    for (size_t k = 0; k < 3; ++k) sum += double(outer[4 * row + k]) * inner[k];
    instance.transform[4 * row + 3] = float(sum);
    instance.remainder[row] = lost_to_float(sum);
  }
  return instance;
}

inline std::array<Double3, 3> rows_of(const Transform& t) {
  return {Double3{t[0], t[1], t[2]}, Double3{t[4], t[5], t[6]}, Double3{t[8], t[9], t[10]}};
}
/// Product of a matrix, given by its rows, and a vector.
inline Double3 product(const std::array<Double3, 3>& rows, const Double3& v) {
  return {dot(rows[0], v), dot(rows[1], v), dot(rows[2], v)};
}
inline double determinant(const Transform& t) {
  const auto rows = rows_of(t);
  return dot(rows[0], cross(rows[1], rows[2]));
}
/// Whether it has no inverse in single precision: then the runtime refuses to place anything with it.
inline bool flattens(const Transform& t) {
  const auto rows = rows_of(t);
  const double whole = determinant(t);
  for (size_t a = 0; a < 3; ++a)
    for (const double cofactor : cross(rows[(a + 1) % 3], rows[(a + 2) % 3]))
      if (!std::isfinite(float(cofactor / whole))) return true;
  return false;
}
/// The transposed inverse, times the determinant: transforms normals.
inline Transform cofactors(const Transform& t) {
  const auto rows = rows_of(t);
  Transform out{};
  for (size_t a = 0; a < 3; ++a) {
    const Double3 row = cross(rows[(a + 1) % 3], rows[(a + 2) % 3]);
    for (size_t k = 0; k < 3; ++k) out[4 * a + k] = float(row[k]);
  }
  return out;
}
/// Rows of the inverse of the linear part; the determinant must not be 0.
inline std::array<Double3, 3> inverse_rows(const Transform& t) {
  const auto rows = rows_of(t);
  std::array<Double3, 3> inverse;
  for (size_t column = 0; column < 3; ++column) {
    const Double3 cofactor = cross(rows[(column + 1) % 3], rows[(column + 2) % 3]);
    for (size_t row = 0; row < 3; ++row) inverse[row][column] = cofactor[row] / determinant(t);
  }
  return inverse;
}

/// Maps back to object space.
class ToObject {
 public:
  /// The determinant must not be 0.
  explicit ToObject(const Transform& placed)
      : inverse_(inverse_rows(placed)), origin_{placed[3], placed[7], placed[11]} {}

  Double3 direction(const Double3& v) const { return product(inverse_, v); }
  Double3 point(const Double3& p) const { return direction(p - origin_); }

 private:
  std::array<Double3, 3> inverse_;
  Double3 origin_;
};

}  // namespace nif::mesh
