// The bytes of an asset, part by part, as `nif bake`, `nif bench` and `nif info` print them.
#pragma once

#include <cstdint>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>

#include "formats/nif/reader.hpp"
#include "nif/nif.h"

namespace nif::tools {

/// {"file", "resident", ..., "parts"}: "file" and "resident" are those of all parts together; then what each
/// part of every encoding, "network" and "primary" take of the file; and all parts, see parts_json().
nlohmann::ordered_json bytes_json(const format::AssetView& view);

/// {"occupancy": {"file", "resident"}, ...}
nlohmann::ordered_json parts_json(std::span<const NifPartInfo> parts);

/// "... as a file (occupancy ..., features ..., ...), ... resident": what bytes_json() gives as text, each
/// count of bytes by `text`.
std::string bytes_line(const nlohmann::ordered_json& bytes, const std::function<std::string(uint64_t)>& text);

}  // namespace nif::tools
