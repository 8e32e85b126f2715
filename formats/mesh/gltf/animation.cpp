// Finds the nodes that move by animations or physics. Reads them from the JSON and not with tinygltf, whose reader of animations
// refuses a whole file for errors in them.
#include <charconv>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>

#include "formats/mesh/gltf/json.hpp"

namespace nif::mesh::detail {
namespace {

using nlohmann::json;

std::optional<size_t> node_of_target(const json& target) {
  if (const json* node = member(target, "node"))
    return node->is_number_unsigned() ? std::optional(node->get<size_t>()) : std::nullopt;
  const auto pointed = pointed_node(target);
  return pointed ? std::optional(pointed->first) : std::nullopt;
}

void add_animated(const json& root, std::set<size_t>& nodes) {
  const json* animations = member(root, "animations");
  if (!animations || !animations->is_array()) return;
  for (const json& animation : *animations) {
    const json* channels = member(animation, "channels");
    if (!channels || !channels->is_array()) continue;
    for (const json& channel : *channels)
      if (const json* target = member(channel, "target"))
        if (const std::optional<size_t> node = node_of_target(*target)) nodes.insert(*node);
  }
}

/// Bodies of KHR_physics_rigid_bodies move if they have a motion, those of OMI_physics_body unless it is
/// static.
bool is_moving_body(const json& node) {
  const json* extensions = member(node, "extensions");
  if (!extensions) return false;
  const json *khronos = member(*extensions, "KHR_physics_rigid_bodies"),
             *omi = member(*extensions, "OMI_physics_body");
  if (khronos && member(*khronos, "motion")) return true;
  const json* motion = omi ? member(*omi, "motion") : nullptr;
  const json* type = motion ? member(*motion, "type") : nullptr;
  return type && *type != "static";
}

}  // namespace

std::optional<std::pair<size_t, std::string_view>> pointed_node(const json& target) {
  const json* extensions = member(target, "extensions");
  const json* by_pointer = extensions ? member(*extensions, "KHR_animation_pointer") : nullptr;
  const json* pointer = by_pointer ? member(*by_pointer, "pointer") : nullptr;
  if (!pointer || !pointer->is_string()) return std::nullopt;
  constexpr std::string_view kNodes = "/nodes/";
  std::string_view text = pointer->get_ref<const std::string&>();
  if (!text.starts_with(kNodes)) return std::nullopt;
  text.remove_prefix(kNodes.size());
  size_t node = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), node);
  if (error != std::errc()) return std::nullopt;
  text.remove_prefix(size_t(end - text.data()));
  return std::pair(node, text);
}

std::set<size_t> read_moving_nodes(const json& root) {
  std::set<size_t> moving;
  add_animated(root, moving);
  const json* nodes = member(root, "nodes");
  if (!nodes || !nodes->is_array()) return moving;
  for (size_t i = 0; i < nodes->size(); ++i)
    if (is_moving_body((*nodes)[i])) moving.insert(i);
  return moving;
}

}  // namespace nif::mesh::detail
