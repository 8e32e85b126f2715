// Builds queries of the runtime from the rays of the baker.
#pragma once

#include <span>

#include "kernels/reference/ray.hpp"
#include "nif/nif.hpp"

namespace nif::tools {

/// These segments, of which there are some.
inline NifRays rays_of(std::span<const kernels::Segment> segments) {
  const kernels::Segment& first = segments.front();
  auto rays = nifkit::sized<NifRays>();
  rays.count = segments.size();
  for (int a = 0; a < 3; ++a) {
    rays.origin[a] = &first.origin[a];
    rays.direction[a] = &first.direction[a];
  }
  rays.tmin = &first.tmin;
  rays.tmax = &first.tmax;
  rays.origin_stride = rays.direction_stride = rays.tmin_stride = rays.tmax_stride = sizeof(kernels::Segment);
  return rays;
}

}  // namespace nif::tools
