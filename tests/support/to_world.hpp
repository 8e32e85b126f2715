// Places objects for tests: transforms, and rays between object space, the world, callers and kernels.
#pragma once

#include <nif/nif.h>

#include <array>
#include <cstddef>

#include "kernels/reference/ray.hpp"

namespace nif::test {

/// Row-major 3x4, from object to world.
using Matrix = std::array<float, 12>;
inline constexpr Matrix kIdentity{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

/// The ray under a transform, rounded to floats. Exact if the transform's numbers are powers of two, or if it
/// permutes axes.
inline NifRay to_world(const NifRay& ray, const Matrix& transform) {
  NifRay world = ray;
  for (size_t row = 0; row < 3; ++row) {
    const float* m = &transform[4 * row];
    double origin = double(m[3]), direction = 0;
    for (size_t k = 0; k < 3; ++k) {
      origin += double(m[k]) * double(ray.origin[k]);
      direction += double(m[k]) * double(ray.direction[k]);
    }
    world.origin[row] = float(origin);
    world.direction[row] = float(direction);
  }
  return world;
}

/// A transform whose translation takes more bits than its floats have.
struct LongMatrix {
  Matrix matrix = kIdentity;
  std::array<float, 3> remainder{};  ///< added to the translation
};
/// Where an instance is by its origin and the scene's, as nif.h specifies: computed in double precision, rounded to
/// a float and a float for the remainder.
inline LongMatrix at_origin(const Matrix& transform, const std::array<double, 3>& origin,
                            const std::array<double, 3>& of_scene) {
  LongMatrix placed{.matrix = transform};
  if (origin == std::array<double, 3>{} && of_scene == std::array<double, 3>{}) return placed;
  for (size_t a = 0; a < 3; ++a) {
    const double at = double(transform[4 * a + 3]) + (origin[a] - of_scene[a]);
    placed.matrix[4 * a + 3] = float(at);
    placed.remainder[a] = float(at - double(float(at)));
  }
  return placed;
}

inline NifRay to_ray(const kernels::Segment& s) {
  return {{s.origin[0], s.origin[1], s.origin[2]},
          s.tmin,
          {s.direction[0], s.direction[1], s.direction[2]},
          s.tmax};
}

inline kernels::Segment to_segment(const NifRay& r) {
  return {{r.origin[0], r.origin[1], r.origin[2]},
          {r.direction[0], r.direction[1], r.direction[2]},
          r.tmin,
          r.tmax};
}

}  // namespace nif::test
