// Recognises the most common layout of rays, an array of NifRay, which can be read faster than by components.
#pragma once

#include <cstddef>

#include "nif/nif.h"

namespace nif::runtime {

/// Are the rays an array of NifRay, as nifMakeRays() describes it? It then starts at origin[0].
inline bool are_nif_rays(const NifRays& rays) {
  const char* start = reinterpret_cast<const char*>(rays.origin[0]);
  const auto is_at = [&](const float* member, size_t offset) {
    return reinterpret_cast<const char*>(member) == start + offset;
  };
  bool all = rays.origin_stride == sizeof(NifRay) && rays.direction_stride == sizeof(NifRay) &&
             rays.tmin_stride == sizeof(NifRay) && rays.tmax_stride == sizeof(NifRay);
  for (size_t a = 0; a < 3; ++a)
    all = all && is_at(rays.origin[a], offsetof(NifRay, origin) + a * sizeof(float)) &&
          is_at(rays.direction[a], offsetof(NifRay, direction) + a * sizeof(float));
  return all && is_at(rays.tmin, offsetof(NifRay, tmin)) && is_at(rays.tmax, offsetof(NifRay, tmax));
}

}  // namespace nif::runtime
