// A mesh file as an asset was baked from it.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "formats/mesh/read.hpp"

namespace nif::tools {

/// What has to be read of a mesh file for its meshes to be those of an asset with this metadata: what was
/// chosen by name; and meshes that differ in their colours alone are objects of their own if the asset keeps
/// colours. `asset` is what messages call it. Throws Error(mesh_mismatch) where the metadata makes no sense.
mesh::ReadLimits limits_as_baked(std::string_view metadata, const std::string& asset);
/// The same for an asset's file. Throws as its reader, too.
mesh::ReadLimits limits_of_asset(const std::string& asset);

/// The scene of a mesh file, merged as it was before the bake; none if `metadata`, the asset's, says nothing
/// of that. `asset` and `mesh` are what messages call them. Throws Error(mesh_mismatch) where the metadata
/// makes no sense, too_large where it asks for more than there is memory for.
std::optional<mesh::Scene> merged_as_baked(const mesh::Scene& scene, std::string_view metadata,
                                           const std::string& asset, const std::string& mesh);

}  // namespace nif::tools
