// Finds the glTF node of each instance of an asset, so that `nif attach` can refer to instances from nodes.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "formats/mesh/gltf/attach.hpp"
#include "formats/mesh/mesh_scene.hpp"
#include "formats/nif/reader.hpp"

namespace nif::tools {

struct NodeMatch {
  std::vector<mesh::AttachedNode> nodes;  ///< by instance
  std::vector<std::string> notes;         ///< one sentence for each group that has no counterpart
};

// Both throw Error(usage) if the asset was merged, because its instances then stand for several nodes each.

/// For an asset that was baked from exactly this scene, according to its metadata. Throws
/// Error(mesh_mismatch) if it was not, or if the metadata does not name the nodes of its instances. `asset`
/// and `gltf` are names for messages.
NodeMatch match_nodes(const format::AssetView& view, const mesh::Scene& scene, const std::string& asset,
                      const std::string& gltf);

/// For any asset, by name: the first instance with a name matches the first node with that name, and so on.
/// Throws Error(mesh_mismatch) if no name matches.
NodeMatch match_names(const format::AssetView& view, const mesh::Scene& scene, const std::string& asset,
                      const std::string& gltf);

}  // namespace nif::tools
