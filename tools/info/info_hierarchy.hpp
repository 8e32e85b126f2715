// Prints what an asset's metadata says about its instances: their glTF nodes, and what they were merged from.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "formats/nif/reader.hpp"

namespace nif::tools {

/// Prints a line for each of the first instances: its object, its node, and the names from the root to it.
/// Prints nothing if the metadata names no nodes or makes no sense.
void print_hierarchy(const format::AssetView& view, const nlohmann::ordered_json& metadata);

/// Prints a line for each of the first merged instances: how many instances it was merged from, and the names
/// of the first ones. Prints nothing if the metadata names none or makes no sense.
void print_merged(const format::AssetView& view, const nlohmann::ordered_json& metadata);

}  // namespace nif::tools
