// Finds the nodes that move. Reads them from the JSON and not with tinygltf, whose reader of animations
// refuses a whole file for errors in them.
#include <charconv>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>

#include "formats/mesh/gltf/json.hpp"

namespace nif::mesh::detail {
namespace {

using nlohmann::json;

/// Returns 12 for "/nodes/12/translation".
std::optional<size_t> node_of_pointer(std::string_view pointer) {
  constexpr std::string_view kNodes = "/nodes/";
  if (!pointer.starts_with(kNodes)) return std::nullopt;
  pointer.remove_prefix(kNodes.size());
  size_t node = 0;
  const auto [end, error] = std::from_chars(pointer.data(), pointer.data() + pointer.size(), node);
  return error == std::errc() ? std::optional(node) : std::nullopt;
}

std::optional<size_t> node_of_target(const json& target) {
  if (const json* node = member(target, "node"))
    return node->is_number_unsigned() ? std::optional(node->get<size_t>()) : std::nullopt;
  const json* extensions = member(target, "extensions");
  const json* by_pointer = extensions ? member(*extensions, "KHR_animation_pointer") : nullptr;
  const json* pointer = by_pointer ? member(*by_pointer, "pointer") : nullptr;
  if (!pointer || !pointer->is_string()) return std::nullopt;
  return node_of_pointer(pointer->get_ref<const std::string&>());
}

}  // namespace

std::set<size_t> read_animated_nodes(const json& root) {
  std::set<size_t> nodes;
  const json* animations = member(root, "animations");
  if (!animations || !animations->is_array()) return nodes;
  for (const json& animation : *animations) {
    const json* channels = member(animation, "channels");
    if (!channels || !channels->is_array()) continue;
    for (const json& channel : *channels)
      if (const json* target = member(channel, "target"))
        if (const std::optional<size_t> node = node_of_target(*target)) nodes.insert(*node);
  }
  return nodes;
}

}  // namespace nif::mesh::detail
