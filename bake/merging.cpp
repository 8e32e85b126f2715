#include "bake/merging.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <vector>

#include "formats/base/quantities.hpp"
#include "formats/base/status.hpp"

namespace nif::bake {
namespace {

using Json = nlohmann::json;
using nlohmann::ordered_json;

ordered_json settings(const mesh::MergeOptions& options) {
  ordered_json described = ordered_json::object();
  if (!options.nodes.empty()) described["nodes"] = options.nodes;
  if (!options.except.empty()) described["except"] = options.except;
  described["added_triangles"] = options.added_triangles.value_or(0);
  described["part_triangles"] = options.part_triangles;
  described["object_triangles"] = options.object_triangles;
  return described;
}

ordered_json parts_of(const mesh::Scene& scene, const mesh::MergedInstance& merged) {
  ordered_json names = ordered_json::array(), nodes = names;
  for (const mesh::MergedPart& part : merged.parts) {
    names.push_back(part.name);
    nodes.push_back(part.node == mesh::kNoNode ? ordered_json()
                                               : ordered_json(scene.nodes[part.node].number));
  }
  ordered_json parts{{"names", std::move(names)}};
  if (!scene.nodes.empty()) parts["nodes"] = std::move(nodes);
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

/// How a reason stands after a count.
std::string reason_of(mesh::Stays why, uint64_t count, const mesh::MergeOptions& options) {
  const bool one = count == 1;
  switch (why) {
    case mesh::Stays::not_named:
      return one ? "is not named" : "are not named";
    case mesh::Stays::moves:
      return one ? "moves" : "move";
    case mesh::Stays::flattened:
      return one ? "is flattened by its transform" : "are flattened by their transforms";
    case mesh::Stays::too_far:
      return one ? "is too far from the origin for its size" : "are too far from the origin for their size";
    case mesh::Stays::too_large:
      return fmt::format("{} {} triangles or more", one ? "has" : "have", options.part_triangles);
    case mesh::Stays::over_budget:
      if (options.added_triangles == 0)
        return one ? "shares its mesh, and --merge-triangles allows no copies"
                   : "share their meshes, and --merge-triangles allows no copies";
      return fmt::format("would exceed --merge-triangles {}", options.added_triangles.value_or(0));
    case mesh::Stays::alone:
      return one ? "has no neighbour to merge with" : "have no neighbour to merge with";
  }
  return "";
}

constexpr std::array<const char*, mesh::kStays> kStayNames{"not_named", "moves",       "flattened", "too_far",
                                                           "too_large", "over_budget", "alone"};

uint64_t merged_parts(const mesh::Merging& merging) {
  uint64_t parts = 0;
  for (const mesh::MergedInstance& merged : merging.merged) parts += merged.parts.size();
  return parts;
}

}  // namespace

ordered_json merge_metadata(const mesh::Scene& scene, std::span<const uint32_t> placed) {
  if (!scene.merging || scene.merging->merged.empty()) return nullptr;
  ordered_json described = settings(scene.merging->options), objects = ordered_json::array();
  // Merged instances come last in the scene, and what is placed keeps its order.
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
  const Json root = Json::parse(metadata, nullptr, false);
  const Json* merge = member_of(root, "merge");
  if (!merge) return std::nullopt;
  if (!merge->is_object()) refuse("'merge' is no object");
  mesh::MergeOptions options;
  options.nodes = words_of(*merge, "nodes");
  options.except = words_of(*merge, "except");
  options.added_triangles = count_in(*merge, "added_triangles");
  options.part_triangles = count_in(*merge, "part_triangles");
  options.object_triangles = count_in(*merge, "object_triangles");
  return options;
}

ordered_json to_json(const mesh::Merging& merging) {
  ordered_json described{{"instances", merging.instances},
                         {"merged", merged_parts(merging)},
                         {"objects", merging.merged.size()},
                         {"added_triangles", merging.added_triangles}};
  described["settings"] = settings(merging.options);
  for (size_t why = 0; why < mesh::kStays; ++why) described["stay"][kStayNames[why]] = merging.stay[why];
  return described;
}

std::string summary(const mesh::Merging& merging) {
  const uint64_t parts = merged_parts(merging), stay = merging.instances - parts;
  std::string text =
      parts == 0 ? "nothing was merged"
                 : fmt::format("merged {} of {} into {}", parts, count_of(merging.instances, "instance"),
                               count_of(merging.merged.size(), "object"));
  if (stay == 0) return text;
  std::vector<std::string> reasons;
  for (size_t why = 0; why < mesh::kStays; ++why)
    if (const uint64_t count = merging.stay[why])
      reasons.push_back(fmt::format("{} {}", count, reason_of(mesh::Stays(why), count, merging.options)));
  return fmt::format("{}; {} {}: {}", text, stay, stay == 1 ? "stays" : "stay", fmt::join(reasons, ", "));
}

}  // namespace nif::bake
