// The usual layout of a query's rays, which is read faster than one component after the other.
#pragma once

#include <cstddef>

#include "nif/nif.h"

namespace nif::runtime {

/// Whether the rays are an array of NifRay, which then starts at origin[0]: as nifMakeRays() describes it.
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
