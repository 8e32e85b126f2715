// Describes holes for `nif info`.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "formats/nif/holes/holes_part.hpp"

namespace nif::bake {

/// As JSON, its bytes in a file in detail, and in a few words.
void describe(const format::HolesView& view, nlohmann::ordered_json& json, nlohmann::ordered_json& bytes);
std::string summary(const format::HolesView& view);

}  // namespace nif::bake
