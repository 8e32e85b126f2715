// Stores the corners of an object that have features.
#pragma once

#include "bake/planes/occupancy.hpp"
#include "formats/nif/asset.hpp"

namespace nif::bake {

/// Like the other store_occupancy(), for an object that has planes and a network; adds the corners of surface
/// voxels, with zero features.
void store_occupancy(const Occupancy& occupancy, uint32_t features_per_corner, format::Object& object);

}  // namespace nif::bake
