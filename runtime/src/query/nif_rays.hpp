// The usual layout of a query's rays, which is read faster than one component after the other.
#pragma once

#include <cstddef>

#include "nif/nif.h"

namespace nif::runtime {

/// Whether the rays are an array of NifRay, which then starts at origin[0]: as nifQueryRays() describes it.
inline bool are_nif_rays(const NifQuery& query) {
  const char* start = reinterpret_cast<const char*>(query.origin[0]);
  const auto is_at = [&](const float* member, size_t offset) {
    return reinterpret_cast<const char*>(member) == start + offset;
  };
  bool all = query.origin_stride == sizeof(NifRay) && query.direction_stride == sizeof(NifRay) &&
             query.tmin_stride == sizeof(NifRay) && query.tmax_stride == sizeof(NifRay);
  for (size_t a = 0; a < 3; ++a)
    all = all && is_at(query.origin[a], offsetof(NifRay, origin) + a * sizeof(float)) &&
          is_at(query.direction[a], offsetof(NifRay, direction) + a * sizeof(float));
  return all && is_at(query.tmin, offsetof(NifRay, tmin)) && is_at(query.tmax, offsetof(NifRay, tmax));
}

}  // namespace nif::runtime
