// Which payloads of an object a file codes, for tests that write files both ways.
#pragma once

#include "formats/nif/asset.hpp"

namespace nif::test {

/// Bit 0: occupancy and corners, 1: cells, 2: features.
inline constexpr uint32_t kCodedAll = 7;
inline void set_coded(uint32_t coded, format::Object& object) {
  if (object.planes) object.planes->coded = coded & format::kCodedPlanes;
  if (object.network)
    object.network->coded =
        (coded & 1 ? format::kCornersAround : 0u) | (coded & 4 ? format::kCodedFeatures : 0u);
}

}  // namespace nif::test
