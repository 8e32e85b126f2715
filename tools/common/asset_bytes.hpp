// The bytes of an asset, part by part, as `nif bake` and `nif info` print them.
#pragma once

#include <cstdint>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "formats/nif/reader.hpp"

namespace nif::tools {

/// {"file", "resident", ...}: and the parts of every encoding, "network" and "primary".
nlohmann::ordered_json bytes_json(const format::AssetView& view);

/// "... as a file, ... resident (occupancy ..., features ..., ...)": what bytes_json() gives as text, each
/// count of bytes by `text`.
std::string bytes_line(const nlohmann::ordered_json& bytes, const std::function<std::string(uint64_t)>& text);

}  // namespace nif::tools
