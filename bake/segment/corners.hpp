// The corners of an object that have features.
#pragma once

#include <string_view>

#include "bake/proof/occupancy.hpp"
#include "formats/nif/segment/encoding.hpp"

namespace nif::bake {

/// As the other store_occupancy(), with the corners of surface voxels, and zero features for each.
void store_occupancy(const Occupancy& occupancy, uint32_t features_per_corner, std::string_view name,
                     format::SegmentData& data);

}  // namespace nif::bake
