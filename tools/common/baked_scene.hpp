// A mesh file as an asset was baked from it.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "formats/mesh/scene.hpp"

namespace nif::tools {

/// The scene of a mesh file, merged as it was before the bake; none if `metadata`, the asset's, says nothing
/// of that. `asset` and `mesh` are what messages call them. Throws Error(mesh_mismatch) where the metadata
/// makes no sense, too_large where it asks for more than there is memory for.
std::optional<mesh::Scene> merged_as_baked(const mesh::Scene& scene, std::string_view metadata,
                                           const std::string& asset, const std::string& mesh);

}  // namespace nif::tools
