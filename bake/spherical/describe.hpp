// What is said of `spherical` fields, and of fields for primary rays, whatever the encoding of their objects.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "bake/spherical/options.hpp"
#include "formats/nif/spherical/primary.hpp"

namespace nif::bake {

/// The hyperparameters, all of them.
nlohmann::ordered_json to_json(const SphericalBakeOptions& options);

/// {"resolution", ..., "bytes": {"grids", "network"}}
nlohmann::ordered_json to_json(const format::PrimaryView& primary);
/// One line for people.
std::string summary(const format::PrimaryView& primary);

}  // namespace nif::bake
