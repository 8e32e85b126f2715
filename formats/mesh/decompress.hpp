// Unpacks gzip and Zstandard files. Their first bytes tell what they are, whatever the file is called.
#pragma once

#include "formats/mesh/file_bytes.hpp"
#include "formats/mesh/read.hpp"

namespace nif::mesh::detail {

/// Returns `packed` itself where it is not compressed. Throws file_truncated, malformed_mesh or too_large.
ByteBuffer decompress(ByteBuffer packed, const std::filesystem::path& file, const ReadLimits& limits);

}  // namespace nif::mesh::detail
