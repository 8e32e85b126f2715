// What `nif info` says of `spherical` objects: their bytes, part by part, beside those that the paper states.
#pragma once

#include <nlohmann/json.hpp>

#include "formats/nif/reader.hpp"

namespace nif::tools {

/// {"outer": {...}, "inner": {...}, "paper": {...}, "bytes": {"grids": {...}, "network": ...}}
nlohmann::ordered_json describe_spherical(const format::ObjectView& object);

/// For people: the same of the first such object; nothing where there is none.
void print_spherical(const format::AssetView& view);

}  // namespace nif::tools
