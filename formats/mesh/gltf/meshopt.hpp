// Decodes buffer views compressed with EXT_meshopt_compression, as gltfpack writes them.
#pragma once

#include <string>
#include <string_view>

#include "formats/mesh/input.hpp"

namespace nif::mesh::detail {

struct MeshoptData {
  std::string_view bytes;
  uint64_t count = 0, stride = 0;     ///< of the elements that they become
  std::string mode, filter = "NONE";  ///< as the extension names them
  std::string where;                  ///< begins the reason of a refusal
};

/// The decoded view, count * stride bytes. Throws malformed_mesh where it cannot be; takes at most 64 times
/// the memory of what is compressed.
std::string decode_meshopt(const Input& input, const MeshoptData& data);

}  // namespace nif::mesh::detail
