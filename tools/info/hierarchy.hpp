// What an asset's metadata says about the glTF nodes of its instances.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "formats/nif/reader.hpp"

namespace nif::tools {

/// Prints a line for each of the first instances: its object, its node, and the names from the root to it.
/// Nothing where the metadata names no nodes, or makes no sense.
void print_hierarchy(const format::AssetView& view, const nlohmann::ordered_json& metadata);

}  // namespace nif::tools
