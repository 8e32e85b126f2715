// Makes rays through and around an object's box, the same on every system: by its own generator, so that only
// the runtime needs to be compiled for another machine.
#pragma once

#include <nif/nif.h>

#include <cmath>
#include <random>
#include <vector>

namespace nif::test {

inline std::vector<NifRay> make_box_rays(const NifObjectInfo& info, size_t count, uint32_t seed) {
  std::mt19937 random(seed);
  const auto unit = [&] { return static_cast<float>(random() >> 8) * 0x1p-24f; };
  const auto point = [&](int a) {
    const float low = info.bounds_min[a], size = info.bounds_max[a] - low;
    return low + size * (1.5f * unit() - 0.25f);
  };
  std::vector<NifRay> rays(count);
  for (NifRay& ray : rays) {
    for (int a = 0; a < 3; ++a) {
      ray.origin[a] = point(a);
      ray.direction[a] = point(a) - ray.origin[a];
      if (random() % 16 == 0) ray.direction[a] = 0;
    }
    ray.tmin = random() % 2 ? 0 : unit() / 2;
    ray.tmax = random() % 2 ? INFINITY : 0.5f + unit();
  }
  return rays;
}

}  // namespace nif::test
