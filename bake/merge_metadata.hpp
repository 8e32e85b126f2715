// Records in an asset's metadata what was merged before its bake.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string_view>

#include "formats/mesh/mesh_scene.hpp"

namespace nif::bake {

/// Limit of each of MergeOptions::nodes and ::except: every name is compared with every node.
inline constexpr size_t kMostMergeNames = 10'000;

/// The settings in the form of the metadata.
nlohmann::ordered_json to_json(const mesh::MergeOptions& options);

/// The "merge" entry of the metadata: the settings; and for each merged instance of the asset the names and
/// nodes of its parts, and how many triangles each contributed. `placed` maps each instance of the asset to
/// that of the scene. Null if nothing was merged.
nlohmann::ordered_json merge_metadata(const mesh::Scene& scene, std::span<const uint32_t> placed);

/// The settings by which an asset's scene was merged, from its metadata, which may contain anything; none if
/// it was not merged. Throws Error(mesh_mismatch) that says what is wrong, without a file name.
std::optional<mesh::MergeOptions> merge_options_of(std::string_view metadata);

}  // namespace nif::bake
