// Finds bytes of a glTF that are not in its buffers: in the URI itself, or in a file beside it.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "formats/mesh/input.hpp"

namespace nif::mesh::detail {

/// The bytes in a "data:" URI; nothing if they are not base64.
std::optional<std::string> decode_data_uri(std::string_view uri);

/// The file that a URI refers to, relative to the folder of the glTF; nothing if it is not a local file.
std::optional<std::filesystem::path> local_file(const Input& input, const std::string& uri);

}  // namespace nif::mesh::detail
