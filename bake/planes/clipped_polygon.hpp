// Clips a triangle to a cube.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>

#include "formats/base/vector.hpp"

namespace nif::bake {

/// The part of a triangle that lies in a cube around the origin: at most 9 corners.
class Polygon {
 public:
  explicit Polygon(const Double3 (&triangle)[3]) {
    for (const Double3& corner : triangle) corners_[count_++] = corner;
  }

  /// Sutherland and Hodgman 1974.
  void clip(double half) {
    for (size_t axis = 0; axis < 3; ++axis) {
      clip(axis, 1, half);
      clip(axis, -1, half);
    }
  }

  std::span<const Double3> corners() const { return {corners_.data(), count_}; }
  /// The normal; its length is twice the area.
  Double3 normal() const {
    Double3 sum{};
    for (size_t i = 2; i < count_; ++i)
      sum = sum + cross(corners_[i - 1] - corners_[0], corners_[i] - corners_[0]);
    return sum;
  }

 private:
  void clip(size_t axis, double sign, double half) {
    const auto beyond = [&](const Double3& p) { return sign * p[axis] - half; };
    if (std::none_of(corners_.begin(), corners_.begin() + ptrdiff_t(count_),
                     [&](const Double3& p) { return beyond(p) > 0; }))
      return;
    std::array<Double3, 12> kept;
    size_t kept_count = 0;
    for (size_t i = 0; i < count_; ++i) {
      const Double3 &from = corners_[i], &to = corners_[i + 1 == count_ ? 0 : i + 1];
      const double f = beyond(from), t = beyond(to);
      if (f <= 0) kept[kept_count++] = from;
      if ((f > 0) != (t > 0)) {
        Double3 cut = from + (to - from) * (f / (f - t));
        cut[axis] = sign * half;
        kept[kept_count++] = cut;
      }
    }
    corners_ = kept;
    count_ = kept_count;
  }

  std::array<Double3, 12> corners_;
  size_t count_ = 0;
};

}  // namespace nif::bake
