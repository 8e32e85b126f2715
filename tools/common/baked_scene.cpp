// Repeats the choice by name, the reading of alpha and the merge that the asset's metadata records, so that the ground truth comes
// from the same meshes. Metadata is not trusted: if it makes no sense, that is an error.
#include "tools/common/baked_scene.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <vector>

#include "bake/alpha_metadata.hpp"
#include "bake/merge_metadata.hpp"
#include "formats/base/json_text.hpp"
#include "formats/nif/file_memory.hpp"
#include "formats/nif/reader.hpp"
#include "mesh/merge/merge.hpp"
#include "tools/common/naming.hpp"

namespace nif::tools {

namespace {

std::vector<std::string> patterns_of(const nlohmann::json& choice, const char* name,
                                     const std::string& asset) {
  std::vector<std::string> patterns;
  if (!choice.is_object() || !choice.contains(name)) return patterns;
  const nlohmann::json& listed = choice.at(name);
  const bool fine = listed.is_array() && listed.size() <= mesh::kMostPatterns &&
                    std::ranges::all_of(listed, [](const nlohmann::json& word) { return word.is_string(); });
  if (!fine)
    throw Error(
        Status::mesh_mismatch,
        fmt::format("{}: its metadata does not say what was chosen: '{}' is not a list of names, or has more "
                    "than {}",
                    asset, name, mesh::kMostPatterns));
  for (const nlohmann::json& word : listed) patterns.push_back(word.get<std::string>());
  return patterns;
}

}  // namespace

mesh::ReadLimits limits_as_baked(std::string_view metadata, const std::string& asset) {
  mesh::ReadLimits limits;
  const nlohmann::json root = parse_untrusted<nlohmann::json>(metadata);
  if (!root.is_object()) return limits;
  const nlohmann::json::json_pointer at("/options/colors");
  if (root.contains(at)) limits.colors = root.at(at) == true;
  const nlohmann::json::json_pointer deforms("/options/deforms");
  if (root.contains(deforms)) limits.skins = root.at(deforms) == true;
  if (root.contains("choice")) {
    limits.choice.only = patterns_of(root.at("choice"), "only", asset);
    limits.choice.except = patterns_of(root.at("choice"), "except", asset);
  }
  limits.alpha = naming(asset, [&] { return bake::alpha_options_of(metadata); });
  return limits;
}

mesh::ReadLimits limits_of_asset(const std::string& asset) {
  const format::FileMemory memory = format::FileMemory::load(asset, format::FileMemory::Mode::read);
  return limits_as_baked(format::read_asset(memory.bytes(), asset).metadata, asset);
}

void check_alpha(const mesh::Scene& scene, std::string_view metadata, const std::string& asset,
                 const std::string& mesh) {
  const auto root = parse_untrusted<nlohmann::ordered_json>(metadata);
  const nlohmann::ordered_json recorded =
      root.is_object() && root.contains("alpha") ? root.at("alpha") : nlohmann::ordered_json();
  if (recorded != bake::alpha_metadata(scene))
    throw Error(
        Status::mesh_mismatch,
        fmt::format(
            "{} was not baked from {}: its materials let light through elsewhere; the mesh's materials "
            "or pictures have changed",
            asset, mesh));
}

std::optional<mesh::Scene> merged_as_baked(const mesh::Scene& scene, std::string_view metadata,
                                           const std::string& asset, const std::string& mesh) {
  const std::optional<mesh::MergeOptions> options =
      naming(asset, [&] { return bake::merge_options_of(metadata); });
  if (!options) return std::nullopt;
  return naming(mesh, [&] { return mesh::merge(scene, *options); });
}

}  // namespace nif::tools
