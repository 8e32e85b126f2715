// The outer layers of glTF: the GLB container, the JSON text and the buffers, checked before tinygltf sees
// them.
#pragma once

#include <deque>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "formats/mesh/gltf_fixtures.hpp"
#include "formats/mesh/input.hpp"

namespace nif::mesh::detail {

struct GltfSource {
  std::string json;  ///< reduced to what the geometry depends on

  /// One for each buffer of the file; none where a buffer has no data of its own, as the fallbacks of
  /// compression extensions do.
  std::vector<std::optional<std::string_view>> buffers;

  std::deque<std::string> owned;      ///< what the views point into, where it is not the file itself
  std::vector<GltfFixture> fixtures;  ///< cameras and lights, by node
  std::vector<std::string> warnings;
};

/// Throws an Error for everything that keeps a file from being read, missing buffers and extensions included.
/// Appends the files of external buffers to `external`.
GltfSource open_gltf(const Input& input, std::vector<ExternalFile>& external);

}  // namespace nif::mesh::detail
