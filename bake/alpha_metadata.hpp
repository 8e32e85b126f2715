// Records in an asset's metadata how alpha was read, and what became of materials that let light through.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string_view>

#include "formats/mesh/mesh_scene.hpp"

namespace nif::bake {

/// "cutoff", "opaque" or "ignore".
std::string_view name_of(mesh::AlphaOptions::Blend blend);
/// Throws Error(usage) with the three names, after `what`, for any other name.
mesh::AlphaOptions::Blend blend_named(std::string_view name, std::string_view what);

/// The "alpha" entry of the metadata: the options, and each material that may let light through. Null if there is
/// none.
nlohmann::ordered_json alpha_metadata(const mesh::Scene& scene);

/// The options by which an asset's mesh was read, from its metadata, which may contain anything; not read if it does
/// not say. Throws Error(mesh_mismatch) that says what is wrong, without a file name.
mesh::AlphaOptions alpha_options_of(std::string_view metadata);

}  // namespace nif::bake
