// What --json prints.
#pragma once

#include <cstdio>
#include <nlohmann/json_fwd.hpp>

namespace nif::tools {

/// Indented, with a replacement character for what is no UTF-8.
void write_json(const nlohmann::ordered_json& json, std::FILE* out = stdout);

}  // namespace nif::tools
