// Numbers the corners brick by brick: a brick's first number is the count of all corners before it. A kernel
// then finds any corner by a population count in the bits of its brick.
#include "bake/network/corner_features.hpp"

#include <bit>

namespace nif::bake {

void store_occupancy(const Occupancy& occupancy, uint32_t features_per_corner, format::Object& object) {
  format::NetworkData& data = *object.network;
  store_occupancy(occupancy, object.name, *object.planes, &data.brick_corners);
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
