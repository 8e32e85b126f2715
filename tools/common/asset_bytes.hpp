// Counts the bytes of an asset part by part, as `nif bake`, `nif bench` and `nif info` print them.
#pragma once

#include <cstdint>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>

#include "formats/nif/reader.hpp"
#include "nif/nif.h"

namespace nif::tools {

/// {"file", "resident", ..., "parts"}: "file" and "resident" are totals over all parts; then the file bytes
/// of each part of every encoding, "network" and "primary"; and all parts, see parts_json().
nlohmann::ordered_json bytes_json(const format::AssetView& view);

/// {"occupancy": {"file", "resident"}, ...}
nlohmann::ordered_json parts_json(std::span<const NifPartInfo> parts);

/// "... as a file (occupancy ..., features ..., ...), ... resident": the values of bytes_json() as text, with
/// each number of bytes formatted by `text`.
std::string bytes_line(const nlohmann::ordered_json& bytes, const std::function<std::string(uint64_t)>& text);

}  // namespace nif::tools
