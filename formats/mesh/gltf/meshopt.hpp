// Decodes buffer views compressed with EXT_meshopt_compression, as gltfpack writes them.
#pragma once

#include <string>
#include <string_view>

#include "formats/mesh/input.hpp"

namespace nif::mesh::detail {

struct MeshoptData {
  std::string_view bytes;
  uint64_t count = 0, stride = 0;     ///< of the decoded elements
  std::string mode, filter = "NONE";  ///< with the extension's names
  std::string where;                  ///< the beginning of an error message
};

/// Returns the decoded view, count * stride bytes. Throws malformed_mesh if it cannot be decoded; takes at
/// most 64 times the memory of the compressed data.
std::string decode_meshopt(const Input& input, const MeshoptData& data);

}  // namespace nif::mesh::detail
