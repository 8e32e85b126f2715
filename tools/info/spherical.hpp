// What `nif info` prints about `spherical` objects and fields for primary rays: the bytes of each part, next
// to those that the paper states.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "formats/nif/reader.hpp"

namespace nif::tools {

/// {"outer": {...}, "inner": {...}, "paper": {...}, "bytes": {"grids": {...}, "network": ...}}
nlohmann::ordered_json describe_spherical(const format::SphericalView& object);

/// What answers primary rays of an object: its shape and bytes, as the parts of the former.
nlohmann::ordered_json describe_primary(const format::PrimaryView& primary);

/// For people: the same of the first such object, and of the first such field; nothing where there is none.
void print_spherical(const format::AssetView& view);

}  // namespace nif::tools
