// Builds queries of the runtime from the rays of the baker.
#pragma once

#include <span>

#include "kernels/reference/ray.hpp"
#include "nif/nif.h"

namespace nif::tools {

/// A query of these segments, without outputs. `segments` must not be empty.
inline NifQuery query_of(std::span<const kernels::Segment> segments) {
  const kernels::Segment& first = segments.front();
  NifQuery query{};
  query.struct_size = sizeof(query);
  query.count = segments.size();
  for (int a = 0; a < 3; ++a) {
    query.origin[a] = &first.origin[a];
    query.direction[a] = &first.direction[a];
  }
  query.tmin = &first.tmin;
  query.tmax = &first.tmax;
  query.origin_stride = query.direction_stride = query.tmin_stride = query.tmax_stride =
      sizeof(kernels::Segment);
  return query;
}

}  // namespace nif::tools
