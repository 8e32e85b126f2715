// Two ways to match instances to nodes: by the node numbers in the asset's metadata, if the source's
// hash fits, or by name (--force). Metadata is not trusted, so every number in it is checked.
#include "tools/attach/nodes.hpp"

#include <fmt/format.h>

#include <deque>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "bake/report.hpp"
#include "formats/base/json_text.hpp"
#include "formats/base/quantities.hpp"
#include "formats/base/status.hpp"

namespace nif::tools {
namespace {

using nlohmann::json;

/// Returns a member of a JSON value of any type, or null if there is no such member.
json member(const json& value, const char* name) {
  const auto found = value.is_object() ? value.find(name) : value.end();
  return found == value.end() ? json() : *found;
}

/// NIF_visibility cannot express an instance that stands for several nodes, or an asset that has more than
/// its nodes say.
void refuse_merged(const json& metadata, const std::string& asset) {
  if (!member(metadata, "merge").is_null())
    throw Error(
        Status::usage,
        fmt::format("{}: meshes were merged in its bake, so it has instances that stand for several nodes "
                    "each, and a glTF can name an instance at one node only; bake it with --no-merge to "
                    "attach it",
                    asset));
}

void refuse_unplaced(const format::AssetView& view, const std::string& asset) {
  if (view.places_nothing)
    throw Error(Status::usage, asset + ": places nothing, so no node of a glTF can name an instance of it");
}

void note_unmatched(size_t nodes, NodeMatch& match) {
  if (nodes == 0) return;
  match.notes.push_back(fmt::format("{} with a mesh {} no instance in the asset and {} left as {}",
                                    count_of(nodes, "node"), nodes == 1 ? "has" : "have",
                                    nodes == 1 ? "is" : "are", nodes == 1 ? "it is" : "they are"));
}

}  // namespace

NodeMatch match_nodes(const format::AssetView& view, const mesh::Scene& scene, const std::string& asset,
                      const std::string& gltf) {
  const json metadata = parse_untrusted<json>(view.metadata);
  refuse_merged(metadata, asset);
  refuse_unplaced(view, asset);
  const json source = member(member(metadata, "source"), "hash"),
             numbers = member(member(metadata, "hierarchy"), "instances");
  const std::string wanted = bake::source_hash_text(scene.source_hash);
  if (source != wanted) {
    throw Error(Status::mesh_mismatch,
                fmt::format("{} was not baked from {}: its source has the hash {}, the file has {}; --force "
                            "matches nodes by name instead",
                            asset, gltf, source.is_string() ? source.get<std::string>() : "unknown", wanted));
  }
  std::set<uint64_t> unmatched;
  for (const mesh::Instance& instance : scene.instances)
    if (instance.node != mesh::kNoNode) unmatched.insert(scene.nodes[instance.node].number);
  NodeMatch match;
  std::map<uint64_t, uint32_t> objects;  // by matched node
  bool known = numbers.is_array() && numbers.size() == view.instances.size();
  for (uint32_t i = 0; known && i < view.instances.size(); ++i) {
    known = numbers[i].is_number_unsigned();
    if (!known) break;
    const auto node = numbers[i].get<uint64_t>();
    const auto [first, fresh] = objects.try_emplace(node, view.instances[i].object);
    known = !fresh || unmatched.erase(node) == 1;
    if (known && fresh) match.nodes.push_back({uint32_t(node), i});
    // The node has EXT_mesh_gpu_instancing: a viewer of the glTF places the object once for each of its
    // instances.
    if (first->second != view.instances[i].object)
      throw Error(Status::usage,
                  fmt::format("{}: has several objects for node {} (one of its instances is flattened by its "
                              "transform), and a glTF can name one at a node",
                              asset, node));
  }
  if (!known || match.nodes.empty()) {
    throw Error(Status::mesh_mismatch,
                fmt::format("{} does not record which nodes of {} its instances belong to; bake it again, or "
                            "use --force to match them by name",
                            asset, gltf));
  }
  note_unmatched(unmatched.size(), match);
  return match;
}

NodeMatch match_names(const format::AssetView& view, const mesh::Scene& scene, const std::string& asset,
                      const std::string& gltf) {
  refuse_merged(parse_untrusted<json>(view.metadata), asset);
  refuse_unplaced(view, asset);
  std::map<std::string_view, std::deque<uint32_t>> nodes;  // in the order of the hierarchy
  size_t unmatched_nodes = 0;
  for (const mesh::Instance& instance : scene.instances) {
    if (instance.node == mesh::kNoNode) continue;
    nodes[instance.name].push_back(scene.nodes[instance.node].number);
    ++unmatched_nodes;
  }
  NodeMatch match;
  for (uint32_t i = 0; i < view.instances.size(); ++i) {
    const auto found = nodes.find(view.instances[i].name);
    if (found == nodes.end() || found->second.empty()) continue;
    match.nodes.push_back({found->second.front(), i});
    found->second.pop_front();
    --unmatched_nodes;
  }
  if (match.nodes.empty()) {
    throw Error(Status::mesh_mismatch,
                fmt::format("{}: none of its {} has the name of a node with a mesh in {}", asset,
                            count_of(view.instances.size(), "instance"), gltf));
  }
  if (const size_t lost = view.instances.size() - match.nodes.size())
    match.notes.push_back(fmt::format("{} of the asset {} left out: no node in the file has the same name",
                                      count_of(lost, "instance"), lost == 1 ? "is" : "are"));
  note_unmatched(unmatched_nodes, match);
  return match;
}

}  // namespace nif::tools
