// Takes rays from an object's space to the world, for tests that place objects.
#pragma once

#include <nif/nif.h>

#include <array>
#include <cstddef>

namespace nif::test {

/// The ray under a row-major 3x4 transform, rounded to floats. Exact if the transform's numbers are powers of
/// two, or if it permutes axes.
inline NifRay to_world(const NifRay& ray, const std::array<float, 12>& transform) {
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

}  // namespace nif::test
