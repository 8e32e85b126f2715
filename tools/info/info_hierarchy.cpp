// Metadata is shown but never trusted: parents may form a cycle. So depth, length and number of lines are
// limited.
#include "tools/info/info_hierarchy.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "formats/base/printable.hpp"
#include "formats/base/quantities.hpp"

namespace nif::tools {
namespace {

using Json = nlohmann::ordered_json;

const Json* member(const Json& value, const char* name) {
  const auto found = value.is_object() ? value.find(name) : value.end();
  return found == value.end() ? nullptr : &*found;
}

std::string shortened(const std::string& text, size_t most) {
  if (text.size() <= most) return text;
  // do not cut within a UTF-8 character
  while (most > 0 && (static_cast<unsigned char>(text[most]) & 0xC0) == 0x80) --most;
  return text.substr(0, most) + "...";
}

/// "root/arm/hand", with numbers for nodes without names. Metadata is shown, never trusted: parents may form
/// a cycle.
std::string path_of(uint64_t number, const std::map<uint64_t, const Json*>& nodes) {
  constexpr int kDeepest = 64;
  constexpr size_t kLongest = 1000;
  std::string path;
  for (int depth = 0; depth < kDeepest && path.size() <= kLongest; ++depth) {
    const auto found = nodes.find(number);
    if (found == nodes.end()) break;
    const Json *name = member(*found->second, "name"), *parent = member(*found->second, "parent");
    const std::string own = name && name->is_string()
                                ? shortened(name->get_ref<const std::string&>(), kLongest)
                                : std::to_string(number);
    path = path.empty() ? own : own + "/" + path;
    if (!parent || !parent->is_number_unsigned()) return path;
    number = parent->get<uint64_t>();
  }
  return ".../" + path;
}

/// "lamp, bench, tree, ...": the first distinct names.
std::string first_of(const Json& names) {
  constexpr size_t kShown = 4;
  std::vector<std::string> shown;
  for (const Json& name : names) {
    const std::string text = name.is_string() ? name.get<std::string>() : name.dump();
    if (std::ranges::find(shown, text) != shown.end()) continue;
    if (shown.size() == kShown) return fmt::format("{}, ...", fmt::join(shown, ", "));
    shown.push_back(text);
  }
  return fmt::format("{}", fmt::join(shown, ", "));
}

}  // namespace

void print_hierarchy(const format::AssetView& view, const Json& metadata) {
  const Json* hierarchy = member(metadata, "hierarchy");
  const Json* listed = hierarchy ? member(*hierarchy, "nodes") : nullptr;
  const Json* instances = hierarchy ? member(*hierarchy, "instances") : nullptr;
  if (!listed || !listed->is_array() || !instances || !instances->is_array() ||
      instances->size() != view.instances.size())
    return;
  std::map<uint64_t, const Json*> nodes;
  for (const Json& node : *listed) {
    const Json* number = member(node, "node");
    if (number && number->is_number_unsigned()) nodes.emplace(number->get<uint64_t>(), &node);
  }
  constexpr size_t kShown = 20;
  for (size_t i = 0; i < std::min(kShown, view.instances.size()); ++i) {
    const Json& number = (*instances)[i];
    if (!number.is_number_unsigned()) continue;
    fmt::print("instance  '{}': object '{}', node {}, {}\n", printable(view.instances[i].name),
               printable(view.objects[view.instances[i].object].name), number.get<uint64_t>(),
               printable(path_of(number.get<uint64_t>(), nodes)));
  }
  if (view.instances.size() > kShown)
    fmt::print("          and {} more; --json lists all\n", view.instances.size() - kShown);
}

void print_merged(const format::AssetView& view, const Json& metadata) {
  const Json* merge = member(metadata, "merge");
  const Json* objects = merge ? member(*merge, "objects") : nullptr;
  if (!objects || !objects->is_array()) return;
  constexpr size_t kShown = 20;
  for (size_t i = 0; i < std::min(kShown, objects->size()); ++i) {
    const Json *instance = member((*objects)[i], "instance"), *names = member((*objects)[i], "names");
    if (!instance || !instance->is_number_unsigned() || !names || !names->is_array()) continue;
    const uint64_t index = instance->get<uint64_t>();
    if (index < view.instances.size())
      fmt::print("merged    '{}': {}, which do not move against each other ({})\n",
                 printable(view.instances[index].name), count_of(names->size(), "instance"),
                 printable(first_of(*names)));
  }
  if (objects->size() > kShown)
    fmt::print("          and {} more; --json lists all\n", objects->size() - kShown);
}

}  // namespace nif::tools
