// Recognises meshes that were not made to be seen: collision shapes, and coarser levels of detail beside the
// finest. They block rays like all others, which few users expect. They are recognised by the names that
// engines and exporters require.
#include "formats/mesh/unseen_meshes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <optional>
#include <unordered_set>

namespace nif::mesh::detail {
namespace {

std::string lowered(std::string_view name) {
  std::string text(name);
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return char(std::tolower(c)); });
  return text;
}

/// In lower case, and without the ".001" that Blender adds to copies.
std::string base_name(std::string_view name) {
  const size_t dot = name.rfind('.');
  const std::string_view digits = dot == name.npos ? "" : name.substr(dot + 1);
  const auto is_digit = [](unsigned char c) { return std::isdigit(c) != 0; };
  if (digits.size() >= 3 && std::ranges::all_of(digits, is_digit)) name = name.substr(0, dot);
  return lowered(name);
}

bool is_collision(std::string_view name) {
  constexpr std::array<std::string_view, 4> kUnreal{"ucx_", "ubx_", "usp_", "ucp_"};
  constexpr std::array<std::string_view, 8> kEndings{"-col",      "-colonly",   "-convcol",  "-convcolonly",
                                                     "_collider", "_collision", "-collider", "-collision"};
  constexpr std::array<std::string_view, 4> kWords{"collision", "collider", "collisions", "colliders"};
  return std::ranges::any_of(kUnreal, [&](std::string_view start) { return name.starts_with(start); }) ||
         std::ranges::any_of(kEndings, [&](std::string_view end) { return name.ends_with(end); }) ||
         std::ranges::find(kWords, name) != kWords.end();
}

struct Level {
  std::string_view of;  ///< the name without its level
  bool finest = false;
};

/// Parses a name such as "crate_lod2".
std::optional<Level> level_of(std::string_view name) {
  const size_t end = name.find_last_not_of("0123456789");
  if (end == name.npos || end + 1 == name.size() || !name.substr(0, end + 1).ends_with("lod"))
    return std::nullopt;
  return Level{name.substr(0, end - 2), name.find_first_not_of('0', end + 1) == name.npos};
}

/// The names of a scene that can tell, each once.
class HelperNames {
 public:
  explicit HelperNames(const Scene& scene) {
    for (const Mesh& mesh : scene.meshes) add(mesh.name);
    for (const Instance& instance : scene.instances) add(instance.name);
    for (const Node& node : scene.nodes) add(node.name);
  }

  bool has(std::string_view name) const {
    const std::string base = base_name(name);
    if (is_collision(base)) return true;
    const std::optional<Level> level = level_of(base);
    return level && !level->finest && finest_.contains(std::string(level->of));
  }

 private:
  void add(std::string_view name) {
    const std::string base = base_name(name);
    if (const std::optional<Level> level = level_of(base); level && level->finest) finest_.emplace(level->of);
  }

  std::unordered_set<std::string> finest_;  ///< names that have a level 0
};

}  // namespace

void note_helpers(const Input& input, Scene& scene) {
  const HelperNames names(scene);
  std::vector<bool> meshes, nodes;
  for (const Mesh& mesh : scene.meshes) meshes.push_back(names.has(mesh.name));
  for (const Node& node : scene.nodes)  // parents come before their children
    nodes.push_back(names.has(node.name) || (node.parent != kNoNode && nodes[node.parent]));
  constexpr size_t kNamed = 3;
  std::vector<std::string> shown;
  uint64_t count = 0;
  for (const Instance& instance : scene.instances) {
    const bool by_node = instance.node != kNoNode && nodes[instance.node];
    const bool own_name = instance.node == kNoNode || instance.name != scene.nodes[instance.node].name;
    if (!by_node && !meshes[instance.mesh] && !(own_name && names.has(instance.name))) continue;
    ++count;
    const std::string text = fmt::format("'{}'", instance.name.substr(0, 100));
    if (shown.size() < kNamed && std::ranges::find(shown, text) == shown.end()) shown.push_back(text);
  }
  if (count == 0) return;
  scene.notes.push_back(
      {NoteKind::helpers,
       fmt::format("{}: {} as collision shapes or coarser levels of detail are ({}{}); {} all the same, "
                   "unless --except leaves {} out.",
                   input.file.string(),
                   count == 1 ? "an object is named" : fmt::format("{} objects are named", count),
                   fmt::join(shown, ", "), count > shown.size() ? ", ..." : "",
                   count == 1 ? "it blocks" : "they block", count == 1 ? "it" : "them")});
}

}  // namespace nif::mesh::detail
