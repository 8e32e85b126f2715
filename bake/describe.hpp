// What `nif info` prints about an asset's objects, by encoding (bake/bake_encodings.hpp).
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "formats/nif/reader.hpp"

namespace nif::bake {

/// Name, encoding, bounds and so on, then what its encoding adds.
nlohmann::ordered_json describe(const format::ObjectView& object);

/// "bvh, 1200 nodes"
std::string summary(const format::ObjectView& object);

/// More lines for people, about the first object of each encoding that has any.
std::vector<std::string> details(const format::AssetView& asset);

}  // namespace nif::bake
