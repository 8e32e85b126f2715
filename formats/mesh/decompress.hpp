// Unpacks gzip and Zstandard files, detected by their first bytes, whatever their names are.
#pragma once

#include "formats/mesh/file_bytes.hpp"
#include "formats/mesh/read.hpp"

namespace nif::mesh::detail {

/// Returns `packed` itself if it is not compressed. Throws file_truncated, malformed_mesh or too_large.
ByteBuffer decompress(ByteBuffer packed, const std::filesystem::path& file, const ReadLimits& limits);

}  // namespace nif::mesh::detail
