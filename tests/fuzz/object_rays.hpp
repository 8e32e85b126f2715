// Rays about an object, the same for the same object.
#pragma once

#include <nif/nif.h>

#include <cmath>
#include <vector>

#include "formats/nif/reader.hpp"

namespace nif::test {

/// Rays through and around a box: some are lines, some along axes, some without a direction.
inline std::vector<NifRay> rays_in_box(const float (&low)[3], const float (&high)[3], uint32_t count) {
  std::vector<NifRay> rays(count);
  for (uint32_t i = 0; i < count; ++i) {
    for (uint32_t a = 0; a < 3; ++a) {
      rays[i].origin[a] =
          low[a] + (high[a] - low[a]) * static_cast<float>(int32_t((i * 7 + a * 5) % 9) - 2) / 5;
      rays[i].direction[a] = static_cast<float>(int32_t((i * 3 + a * (i % 4)) % 7) - 3);
    }
    rays[i].tmin = i % 3 == 0 ? -INFINITY : 0;
    rays[i].tmax = i % 2 == 0 ? INFINITY : (high[0] - low[0]) / 2;
  }
  return rays;
}

inline kernels::Segment segment_of(const NifRay& ray) {
  return {{ray.origin[0], ray.origin[1], ray.origin[2]},
          {ray.direction[0], ray.direction[1], ray.direction[2]},
          ray.tmin,
          ray.tmax};
}

/// Rays around the object's grid if it has one, because that need not be at the object's box.
inline std::vector<NifRay> rays_about(const format::ObjectView& object, uint32_t count) {
  float low[3], high[3];
  const kernels::PlanesField* grid = format::grid_of(object);
  for (uint32_t a = 0; a < 3; ++a) {
    low[a] = grid ? grid->origin[a] : object.aabb_min[a];
    high[a] = grid ? grid->origin[a] + static_cast<float>(grid->voxels[a]) / grid->voxels_per_unit
                   : object.aabb_max[a];
  }
  return rays_in_box(low, high, count);
}

}  // namespace nif::test
