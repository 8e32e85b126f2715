// Prints the output of --json.
#pragma once

#include <cstdio>
#include <nlohmann/json_fwd.hpp>

namespace nif::tools {

/// Indented; invalid UTF-8 becomes a replacement character.
void write_json(const nlohmann::ordered_json& json, std::FILE* out = stdout);

}  // namespace nif::tools
