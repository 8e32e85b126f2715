// What was merged before a bake, as its asset's metadata records it.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string_view>

#include "formats/mesh/scene.hpp"

namespace nif::bake {

/// Of MergeOptions::nodes and ::except each: every name is compared with every node.
inline constexpr size_t kMostMergeNames = 10'000;

/// The settings as the metadata has them.
nlohmann::ordered_json to_json(const mesh::MergeOptions& options);

/// "merge" of the metadata: the settings, and for each merged instance of the asset the names and nodes of
/// its parts, and with `triangles` how many each brought. `placed` has, of each instance of the asset, that
/// of the scene. Null where nothing was merged.
nlohmann::ordered_json merge_metadata(const mesh::Scene& scene, std::span<const uint32_t> placed,
                                      bool triangles);

/// The settings by which an asset's scene was merged, of its metadata, which may hold anything; none where it
/// was not. Throws Error(mesh_mismatch) that says what is wrong, and names no file.
std::optional<mesh::MergeOptions> merge_options_of(std::string_view metadata);

}  // namespace nif::bake
