// Decides on which side of a line a point lies, with a sign that is certain. This decides whether triangles
// have an area, and how a polygon is cut into triangles.
#pragma once

#include <cmath>

namespace nif {

/// Coordinates are floats, stored as double so that products of two are exact.
struct Point2 {
  double x = 0, y = 0;
  bool operator==(const Point2&) const = default;
};

/// orientation() for cases where rounding leaves the sign open.
double exact_orientation(const Point2& a, const Point2& b, const Point2& c);

/// Twice the signed area of a triangle: positive if c is to the left of the line from a to b. The sign is
/// exact, the value rounded. Coordinates must be finite floats.
inline double orientation(const Point2& a, const Point2& b, const Point2& c) {
  // Almost every triangle returns here: the rounding error of the plain determinant is below 3.4e-16 times
  // this sum.
  const double left = (b.x - a.x) * (c.y - a.y), right = (b.y - a.y) * (c.x - a.x);
  const double area = left - right;
  if (std::abs(area) > 4e-16 * (std::abs(left) + std::abs(right))) return area;
  return exact_orientation(a, b, c);
}

}  // namespace nif
