// The corners of an object that have features.
#pragma once

#include "bake/planes/occupancy.hpp"
#include "formats/nif/asset.hpp"

namespace nif::bake {

/// As the other store_occupancy(), into an object that has planes and a network; with the corners of surface
/// voxels, and zero features for each.
void store_occupancy(const Occupancy& occupancy, uint32_t features_per_corner, format::Object& object);

}  // namespace nif::bake
