// Describes `spherical` fields, and fields for primary rays of objects with any encoding.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "bake/spherical/spherical_field_options.hpp"
#include "formats/nif/spherical/primary_section.hpp"

namespace nif::bake {

/// All hyperparameters.
nlohmann::ordered_json to_json(const SphericalBakeOptions& options);

/// For `nif info`: as JSON, its bytes in a file in detail, in a few words, and as lines for people.
void describe(const format::SphericalView& view, nlohmann::ordered_json& json, nlohmann::ordered_json& bytes);
std::string summary(const format::SphericalView& view);
std::vector<std::string> details(const format::SphericalView& view);

/// {"resolution", ..., "bytes": {"grids", "network"}}
nlohmann::ordered_json to_json(const format::PrimaryView& primary);
/// One line for people.
std::string summary(const format::PrimaryView& primary);

}  // namespace nif::bake
