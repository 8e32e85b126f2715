// The box test of the hierarchy, for one ray and the four children of a node.
#pragma once

#include "query/float4.hpp"
#include "query/work_area.hpp"
#include "scene/hierarchy.hpp"

namespace nif::runtime {

/// A ray prepared for the box test: each number four times.
struct TraversalRay {
  TraversalRay() = default;
  TraversalRay(const WorkArea& area, uint32_t ray) {
    for (int a = 0; a < 3; ++a) {
      origin[a] = all_of(area.rays.origin[a][ray]);
      inverse[a] = all_of(area.inverse[a][ray]);
    }
    tmin = all_of(area.rays.tmin[ray]);
    tmax = all_of(area.rays.tmax[ray]);
  }

  Float4 origin[3], inverse[3], tmin, tmax;
};

/// kernels::may_meet for a node's four children, one bit each.
inline uint32_t may_meet(const Node& node, const TraversalRay& ray) {
  Float4 near[3], far[3];
  for (int a = 0; a < 3; ++a) {
    const Float4 low = (load4(node.min[a]) - ray.origin[a]) * ray.inverse[a];
    const Float4 high = (load4(node.max[a]) - ray.origin[a]) * ray.inverse[a];
    near[a] = min_of(low, high);
    far[a] = max_of(high, low);
  }
  const Float4 less = all_of(1 - kernels::kBoxSlack), more = all_of(1 + kernels::kBoxSlack);
  const Float4 enter = max_of(near[2], max_of(near[1], max_of(near[0], all_of(-kernels::kUnlimited))));
  const Float4 leave = min_of(far[2], min_of(far[1], min_of(far[0], all_of(kernels::kUnlimited))));
  const Float4 before = all_of(kernels::kLeastSlack), behind = all_of(-kernels::kLeastSlack);
  const Float4 first = min_of(enter * less, enter * more) - before;
  const Float4 last = max_of(leave * less, leave * more) - behind;
  return node.lanes & at_most(max_of(min_of(first, all_of(kernels::kMostT)), ray.tmin),
                              min_of(max_of(last, all_of(-kernels::kMostT)), ray.tmax));
}

}  // namespace nif::runtime
