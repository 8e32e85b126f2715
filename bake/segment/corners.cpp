// Numbers the corners brick by brick: the first of a brick is the count of all corners before it. A
// kernel then finds any corner by a population count in the bits of its brick.
#include "bake/segment/corners.hpp"

#include <bit>

namespace nif::bake {

void store_occupancy(const Occupancy& occupancy, uint32_t features_per_corner, std::string_view name,
                     format::SegmentData& data) {
  store_occupancy(occupancy, name, data, &data.brick_corners);
  data.corner_base.clear();
  data.corners = 0;
  for (const uint64_t corners : data.brick_corners) {
    data.corner_base.push_back(data.corners);
    data.corners += uint32_t(std::popcount(corners));
  }
  data.features_per_corner = features_per_corner;
  data.features.assign(size_t(data.corners) * features_per_corner, 0);
}

}  // namespace nif::bake
