// Writes the "merge" entry of the metadata, and reads it back when a program must merge the same mesh file in
// the same way again. The text may contain anything, so every entry is checked.
#include "bake/merge_metadata.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <vector>

#include "formats/base/json_text.hpp"
#include "formats/base/status.hpp"

namespace nif::bake {
namespace {

using Json = nlohmann::json;
using nlohmann::ordered_json;

ordered_json parts_of(const mesh::Scene& scene, const mesh::MergedInstance& merged) {
  ordered_json names = ordered_json::array(), nodes = names, triangles = names;
  for (const mesh::MergedPart& part : merged.parts) {
    names.push_back(part.name);
    triangles.push_back(part.triangles);
    nodes.push_back(part.node == mesh::kNoNode ? ordered_json()
                                               : ordered_json(scene.nodes[part.node].number));
  }
  ordered_json parts{{"names", std::move(names)}};
  if (!scene.nodes.empty()) parts["nodes"] = std::move(nodes);
  parts["triangles"] = std::move(triangles);
  return parts;
}

[[noreturn]] void refuse(const std::string& what) {
  throw Error(Status::mesh_mismatch, fmt::format("its metadata does not say how it was merged: {}", what));
}

const Json* member_of(const Json& object, const char* name) {
  const auto found = object.is_object() ? object.find(name) : object.end();
  return found == object.end() ? nullptr : &*found;
}

std::vector<std::string> words_of(const Json& merge, const char* name) {
  const Json* words = member_of(merge, name);
  if (!words) return {};
  if (!words->is_array()) refuse(fmt::format("'{}' is no array", name));
  if (words->size() > kMostMergeNames)
    refuse(fmt::format("'{}' has more than {} entries", name, kMostMergeNames));
  std::vector<std::string> texts;
  for (const Json& word : *words) {
    if (!word.is_string()) refuse(fmt::format("'{}' has an entry that is no text", name));
    texts.push_back(word.get<std::string>());
  }
  return texts;
}

uint64_t count_in(const Json& merge, const char* name) {
  const Json* count = member_of(merge, name);
  if (!count || !count->is_number_unsigned()) refuse(fmt::format("'{}' is no count", name));
  return count->get<uint64_t>();
}

bool flag_in(const Json& merge, const char* name) {
  const Json* flag = member_of(merge, name);
  if (flag && !flag->is_boolean()) refuse(fmt::format("'{}' is neither true nor false", name));
  return flag && flag->get<bool>();
}

}  // namespace

ordered_json to_json(const mesh::MergeOptions& options) {
  ordered_json described = ordered_json::object();
  if (!options.nodes.empty()) described["nodes"] = options.nodes;
  if (!options.except.empty()) described["except"] = options.except;
  if (options.skins) described["skins"] = true;
  if (options.carried) described["carried"] = true;
  described["added_triangles"] = options.added_triangles.value_or(0);
  described["part_triangles"] = options.part_triangles;
  described["object_triangles"] = options.object_triangles;
  return described;
}

ordered_json merge_metadata(const mesh::Scene& scene, std::span<const uint32_t> placed) {
  if (!scene.merging || scene.merging->merged.empty()) return nullptr;
  ordered_json described = to_json(scene.merging->options), objects = ordered_json::array();
  // Merged instances come last in the scene, and placed instances keep their order.
  auto merged = scene.merging->merged.begin();
  for (size_t i = 0; i < placed.size(); ++i) {
    while (merged != scene.merging->merged.end() && merged->instance < placed[i]) ++merged;  // left out
    if (merged == scene.merging->merged.end()) break;
    if (merged->instance != placed[i]) continue;
    ordered_json& object = objects.emplace_back(ordered_json{{"instance", i}});
    object.update(parts_of(scene, *merged));
  }
  described["objects"] = std::move(objects);
  return described;
}

std::optional<mesh::MergeOptions> merge_options_of(std::string_view metadata) {
  const Json root = parse_untrusted<Json>(metadata);
  const Json* merge = member_of(root, "merge");
  if (!merge) return std::nullopt;
  if (!merge->is_object()) refuse("'merge' is no object");
  mesh::MergeOptions options;
  options.nodes = words_of(*merge, "nodes");
  options.except = words_of(*merge, "except");
  options.skins = flag_in(*merge, "skins");
  options.carried = flag_in(*merge, "carried");
  options.added_triangles = count_in(*merge, "added_triangles");
  options.part_triangles = count_in(*merge, "part_triangles");
  options.object_triangles = count_in(*merge, "object_triangles");
  return options;
}

}  // namespace nif::bake
