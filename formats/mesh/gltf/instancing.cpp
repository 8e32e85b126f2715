// Reads translations, rotations and scales, and makes one placement of each. The count is checked before
// memory is allocated, because a small file may claim millions of instances.
#include "formats/mesh/gltf/instancing.hpp"

#include <fmt/format.h>
#include <tiny_gltf.h>

#include <algorithm>

#include "formats/base/memory.hpp"

namespace nif::mesh::detail {
namespace {

constexpr const char* kInstancing = "EXT_mesh_gpu_instancing";
constexpr uint64_t kBytesOfInstance = 1000;  ///< in memory, until the scene is read

/// The instances of one node.
class NodeInstances {
 public:
  NodeInstances(const Input& input, const GltfData& data, size_t node, const tinygltf::Value& extension)
      : input_(input), data_(data), node_(node) {
    const tinygltf::Value& attributes = member_of(extension, "attributes");
    if (!attributes.IsObject() || attributes.Keys().empty())
      fail(fmt::format("has {} without attributes", kInstancing));
    for (const std::string& name : attributes.Keys()) {
      const tinygltf::Value& accessor = attributes.Get(name);
      if (!accessor.IsInt()) fail(fmt::format("has {} with no accessor for {}", kInstancing, name));
      const uint64_t count = data.count(accessor.Get<int>());
      if (count_ != kUnknown && count_ != count)
        fail(fmt::format("has {} with accessors of {} and of {} instances", kInstancing, count_, count));
      count_ = count;
      // Other attributes, which begin with an underscore, are application-specific.
      if (name == "TRANSLATION") translations_ = accessor.Get<int>();
      if (name == "ROTATION") rotations_ = accessor.Get<int>();
      if (name == "SCALE") scales_ = accessor.Get<int>();
    }
  }

  uint64_t count() const { return count_; }

  void append(const GltfPlacement& of_node, std::vector<GltfPlacement>& placements) const {
    const auto read = [](int accessor, auto&& of) {
      return accessor < 0 ? decltype(of(accessor)){} : of(accessor);
    };
    const auto translations = read(translations_, [&](int a) { return data_.positions(a); });
    const auto rotations = read(rotations_, [&](int a) { return data_.rotations(a); });
    const auto scales = read(scales_, [&](int a) { return data_.positions(a); });
    const auto at = [](const auto& values, size_t i, auto otherwise) {
      if (!values.empty()) std::copy(values[i].begin(), values[i].end(), otherwise.begin());
      return otherwise;
    };
    using Three = std::array<double, 3>;
    for (size_t i = 0; i < count_; ++i) {
      GltfPlacement placement = of_node;
      placement.instanced = true;
      placement.place =
          multiply(of_node.place, from_parts(at(translations, i, Three{0, 0, 0}),
                                             at(rotations, i, std::array<double, 4>{0, 0, 0, 1}),
                                             at(scales, i, Three{1, 1, 1})));
      if (!to_transform(placement.place)) fail(fmt::format("places its instance {} at infinity", i));
      placements.push_back(placement);
    }
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    input_.fail(Status::malformed_mesh, fmt::format("node {} {}", node_, what));
  }

  const Input& input_;
  const GltfData& data_;
  size_t node_;
  static constexpr uint64_t kUnknown = UINT64_MAX;
  uint64_t count_ = kUnknown;
  int translations_ = -1, rotations_ = -1, scales_ = -1;
};

}  // namespace

void expand_instances(const Input& input, const GltfData& data, const tinygltf::Model& model,
                      std::vector<GltfPlacement>& placements, std::vector<Note>& notes) {
  const auto extension_of = [&](const GltfPlacement& placement) -> const tinygltf::Value* {
    if (placement.node == GltfHierarchy::kNone) return nullptr;
    const auto& extensions = model.nodes[placement.node].extensions;
    const auto found = extensions.find(kInstancing);
    return found == extensions.end() ? nullptr : &found->second;
  };
  if (std::ranges::none_of(placements, extension_of)) return;
  std::vector<GltfPlacement> expanded;
  uint64_t instances = 0, skinned = 0;
  for (const GltfPlacement& placement : placements) {
    const tinygltf::Value* extension = extension_of(placement);
    if (!extension || placement.skin >= 0) {
      skinned += extension != nullptr;
      expanded.push_back(placement);
      continue;
    }
    const NodeInstances own(input, data, placement.node, *extension);
    instances += std::min(own.count(), kMostGpuInstances + 1);
    if (instances > kMostGpuInstances)
      input.fail(Status::too_large, fmt::format("has more than {} instances by {}, up to node {}",
                                                kMostGpuInstances, kInstancing, placement.node));
    require_memory(own.count() * kBytesOfInstance,
                   fmt::format("{}: the instances of node {}", input.file.string(), placement.node));
    own.append(placement, expanded);
  }
  placements = std::move(expanded);
  if (skinned != 0)
    notes.push_back({NoteKind::gpu_instances,
                     fmt::format("{}: {} both a skin and {}; {} read once.", input.file.string(),
                                 skinned == 1 ? "a node has" : fmt::format("{} nodes have", skinned),
                                 kInstancing, skinned == 1 ? "it is" : "each is")});
}

}  // namespace nif::mesh::detail
