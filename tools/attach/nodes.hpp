// Finds the glTF node of each instance of an asset.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "formats/mesh/gltf/attach.hpp"
#include "formats/mesh/scene.hpp"
#include "formats/nif/reader.hpp"

namespace nif::tools {

struct NodeMatch {
  std::vector<mesh::AttachedNode> nodes;  ///< by instance
  std::vector<std::string> notes;         ///< one sentence for what has no counterpart
};

// Both throw Error(usage) where the asset was merged: its instances stand for several nodes each.

/// For an asset that was baked from this very scene, as its metadata says. Throws Error(mesh_mismatch) where
/// it was not, or does not say which nodes its instances are. `asset` and `gltf` are what messages call them.
NodeMatch match_nodes(const format::AssetView& view, const mesh::Scene& scene, const std::string& asset,
                      const std::string& gltf);

/// For any asset, by names: the first instance of a name is the first node that is so called, and so on.
/// Throws Error(mesh_mismatch) where no name is known.
NodeMatch match_names(const format::AssetView& view, const mesh::Scene& scene, const std::string& asset,
                      const std::string& gltf);

}  // namespace nif::tools
