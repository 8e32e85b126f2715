// Reads a mesh file the way it was read for the bake of an asset, so that the two can be compared.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "formats/mesh/read.hpp"

namespace nif::tools {

/// The limits with which a mesh file gives the meshes of an asset with this metadata: what was chosen by
/// name; how alpha was read; and if the asset keeps colours, meshes that differ only in colour are separate objects. `asset` is
/// its name for messages. Throws Error(mesh_mismatch) if the metadata makes no sense.
mesh::ReadLimits limits_as_baked(std::string_view metadata, const std::string& asset);
/// The same for an asset file. Also throws what reading it throws.
mesh::ReadLimits limits_of_asset(const std::string& asset);

/// Throws Error(mesh_mismatch) if materials of the scene let light through elsewhere than the metadata of an asset
/// records: its pictures have changed. The scene must have been read with limits_as_baked().
void check_alpha(const mesh::Scene& scene, std::string_view metadata, const std::string& asset,
                 const std::string& mesh);

/// The scene of a mesh file, merged as it was before the bake; nothing if `metadata`, the asset's, records no
/// merge. `asset` and `mesh` are their names for messages. Throws Error(mesh_mismatch) if the metadata makes
/// no sense, and Error(too_large) if it asks for more memory than there is.
std::optional<mesh::Scene> merged_as_baked(const mesh::Scene& scene, std::string_view metadata,
                                           const std::string& asset, const std::string& mesh);

}  // namespace nif::tools
