// glTF and GLB: tinygltf gives the structure; geometry, hierarchy and compression are read with checks of
// ours.
#include <fmt/format.h>
#include <tiny_gltf.h>

#include <limits>
#include <map>

#include "formats/mesh/gltf_accessor.hpp"
#include "formats/mesh/gltf_hierarchy.hpp"
#include "formats/mesh/readers.hpp"

namespace nif::mesh::detail {
namespace {

constexpr const char* kDraco = "KHR_draco_mesh_compression";

tinygltf::Model parse_model(const Input& input, const std::string& json) {
  if (json.size() > std::numeric_limits<unsigned>::max()) {
    input.fail(Status::too_large, "has more than 4 GiB of JSON");
  }
  tinygltf::TinyGLTF loader;
  tinygltf::Model model;
  std::string error, warning;
  if (!loader.LoadASCIIFromString(&model, &error, &warning, json.data(), static_cast<unsigned>(json.size()),
                                  "")) {
    while (!error.empty() && (error.back() == '\n' || error.back() == '.')) error.pop_back();
    for (char& c : error) c = c == '\n' ? ' ' : c;
    input.fail(Status::malformed_mesh, fmt::format("is not valid glTF ({})", error));
  }
  return model;
}

class MeshReader {
 public:
  MeshReader(const Input& input, const GltfData& data, const tinygltf::Mesh& source, size_t index)
      : input_(input), data_(data), source_(source), index_(index) {}

  /// All primitives as one mesh.
  Mesh read(std::vector<std::string>& warnings) {
    mesh_.name = source_.name.empty() ? input_.stem : source_.name;
    for (size_t i = 0; i < source_.primitives.size(); ++i) read_primitive(source_.primitives[i], i);
    const std::string name = fmt::format("{}: mesh '{}' ", input_.file.string(), mesh_.name);
    if (skipped_ != 0)
      warnings.push_back(name + fmt::format("lost {} primitives of points or lines.", skipped_));
    if (loose_ != 0)
      warnings.push_back(name + fmt::format("ends with {} indices that make no triangle.", loose_));
    if (morphs_) warnings.push_back(name + "has morph targets; it is taken at rest.");
    return std::move(mesh_);
  }

 private:
  void read_primitive(const tinygltf::Primitive& primitive, size_t number) {
    const int mode = primitive.mode;
    if (mode < TINYGLTF_MODE_POINTS || mode > TINYGLTF_MODE_TRIANGLE_FAN) {
      fail(number, fmt::format("has the unknown mode {}", mode));
    }
    if (mode < TINYGLTF_MODE_TRIANGLES) {
      ++skipped_;
      return;
    }
    morphs_ |= !primitive.targets.empty();
    if (const auto draco = primitive.extensions.find(kDraco); draco != primitive.extensions.end()) {
      read_draco_primitive(primitive, draco->second, number);
      return;
    }
    const auto position = primitive.attributes.find("POSITION");
    if (position == primitive.attributes.end()) {
      ++skipped_;  // valid: an extension may bring the positions, or there is nothing to see
      return;
    }
    const auto [base, count] = vertices(position->second);
    std::vector<uint32_t> indices;
    if (primitive.indices >= 0) {
      indices = data_.indices(primitive.indices);
    } else {
      indices.resize(count);
      for (uint32_t i = 0; i < count; ++i) indices[i] = i;
    }
    for (size_t i = 0; i < indices.size(); ++i) {
      if (indices[i] >= count) {
        input_.fail(Status::index_out_of_range,
                    fmt::format("index {} of primitive {} of mesh {} names vertex {}, but there are {}", i,
                                number, index_, indices[i], count));
      }
      indices[i] += base;
    }
    add_triangles(mode, indices);
  }

  struct Range {
    uint32_t base;
    uint32_t count;
  };

  /// Primitives of one mesh often share one set of vertices; it is read once.
  Range vertices(int accessor) {
    if (const auto known = ranges_.find(accessor); known != ranges_.end()) return known->second;
    const std::vector<Float3> positions = data_.positions(accessor);
    if (mesh_.positions.size() + positions.size() > std::numeric_limits<uint32_t>::max()) {
      input_.fail(Status::too_large,
                  fmt::format("mesh {} has more vertices than 32-bit indices reach", index_));
    }
    const Range range{static_cast<uint32_t>(mesh_.positions.size()), static_cast<uint32_t>(positions.size())};
    mesh_.positions.insert(mesh_.positions.end(), positions.begin(), positions.end());
    ranges_.emplace(accessor, range);
    return range;
  }

  void add_triangles(int mode, const std::vector<uint32_t>& v) {
    const size_t n = v.size();
    check_triangle_limit(input_, mesh_.triangles.size() + (mode == TINYGLTF_MODE_TRIANGLES ? n / 3 : n));
    if (mode == TINYGLTF_MODE_TRIANGLES) {
      mesh_.triangles.reserve(mesh_.triangles.size() + n / 3);
      for (size_t i = 2; i < n; i += 3) mesh_.triangles.push_back({v[i - 2], v[i - 1], v[i]});
      loose_ += n % 3;
      return;
    }
    for (size_t i = 2; i < n; ++i) {
      const Triangle t = mode == TINYGLTF_MODE_TRIANGLE_FAN ? Triangle{v[0], v[i - 1], v[i]}
                         : i % 2 == 0                       ? Triangle{v[i - 2], v[i - 1], v[i]}
                                                            : Triangle{v[i - 1], v[i - 2], v[i]};
      // Strips are joined through triangles that name a vertex twice; they were never part of the surface.
      if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) mesh_.triangles.push_back(t);
    }
  }

  void read_draco_primitive(const tinygltf::Primitive& primitive, const tinygltf::Value& extension,
                            size_t number) {
    const tinygltf::Value& view = extension.Get("bufferView");
    const tinygltf::Value& position = extension.Get("attributes").Get("POSITION");
    const auto accessor = primitive.attributes.find("POSITION");
    if (!view.IsInt() || !position.IsInt() || position.Get<int>() < 0 ||
        accessor == primitive.attributes.end()) {
      fail(number, "has Draco data without a buffer view and positions");
    }
    append_draco(input_,
                 {.bytes = data_.view(view.Get<int>()),
                  .where = fmt::format("the Draco data of primitive {} of mesh {}", number, index_),
                  .position_id = position.Get<int>(),
                  .normalized = data_.normalized(accessor->second)},
                 mesh_);
  }

  [[noreturn]] void fail(size_t number, const std::string& reason) const {
    input_.fail(Status::malformed_mesh, fmt::format("primitive {} of mesh {} {}", number, index_, reason));
  }

  const Input& input_;
  const GltfData& data_;
  const tinygltf::Mesh& source_;
  size_t index_;
  Mesh mesh_;
  std::map<int, Range> ranges_;
  uint64_t skipped_ = 0, loose_ = 0;
  bool morphs_ = false;
};

}  // namespace

Scene read_gltf(const Input& input, std::vector<ExternalFile>& external) {
  GltfSource source = open_gltf(input, external);
  const tinygltf::Model model = parse_model(input, source.json);
  const GltfData data(input, source, model);
  Scene scene;
  scene.warnings = std::move(source.warnings);

  FixturePlacer fixtures(input, source.fixtures, scene);
  std::vector<GltfPlacement> placements = flatten(
      input, model, [&](size_t node, const Affine& world) { fixtures.visit(node, to_transform(world)); });
  fixtures.report();
  if (model.nodes.empty()) {
    for (size_t i = 0; i < model.meshes.size(); ++i) placements.push_back({"", i, false, kIdentity});
  }
  std::vector<bool> shown(model.meshes.size());
  for (const GltfPlacement& placement : placements) shown[placement.mesh] = true;

  constexpr uint32_t kAbsent = std::numeric_limits<uint32_t>::max();
  std::vector<uint32_t> mesh_of(model.meshes.size(), kAbsent);
  uint64_t triangles = 0;
  for (size_t i = 0; i < model.meshes.size(); ++i) {
    if (!shown[i]) {
      scene.warnings.push_back(
          fmt::format("{}: mesh {} is not in the scene and was left out", input.file.string(), i));
      continue;
    }
    Mesh mesh = MeshReader(input, data, model.meshes[i], i).read(scene.warnings);
    if (mesh.triangles.empty()) continue;
    check_triangle_limit(input, triangles += mesh.triangles.size());
    mesh_of[i] = static_cast<uint32_t>(scene.meshes.size());
    scene.meshes.push_back(std::move(mesh));
  }
  bool skinned = false;
  for (const GltfPlacement& placement : placements) {
    const uint32_t mesh = mesh_of[placement.mesh];
    if (mesh == kAbsent) continue;
    // Posing needs the joints; the plain mesh under its node is the bind pose as modelling programs export
    // it.
    skinned |= placement.skinned;
    scene.instances.push_back(
        {placement.name.empty() ? scene.meshes[mesh].name : placement.name, mesh, placement.transform});
  }
  if (skinned)
    scene.warnings.push_back(input.file.string() + ": has skins; its meshes are taken in the bind pose.");
  return scene;
}

}  // namespace nif::mesh::detail
