// glTF and GLB: tinygltf gives the structure; geometry, hierarchy and compression are read with checks of
// ours.
#include <fmt/format.h>
#include <tiny_gltf.h>

#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <new>
#include <set>

#include "formats/mesh/far.hpp"
#include "formats/mesh/gltf/accessor.hpp"
#include "formats/mesh/gltf/hierarchy.hpp"
#include "formats/mesh/gltf/look.hpp"
#include "formats/mesh/gltf/skin.hpp"
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
    if (error == std::bad_alloc().what()) throw std::bad_alloc();  // tinygltf catches everything
    while (!error.empty() && (error.back() == '\n' || error.back() == '.')) error.pop_back();
    for (char& c : error) c = c == '\n' ? ' ' : c;
    input.fail(Status::malformed_mesh, fmt::format("is not valid glTF ({})", error));
  }
  return model;
}

/// What has been read for all meshes so far. They may share their data, so that the file's size bounds
/// nothing.
struct ReadSoFar {
  uint64_t positions = 0;  ///< also of meshes without triangles
  uint64_t morphed = 0;    ///< positions of morph targets
};

class MeshReader {
 public:
  /// `weights` of the morph targets; none: the targets are left alone.
  MeshReader(const Input& input, const GltfData& data, const GltfLook& look, const tinygltf::Mesh& source,
             size_t index, const std::vector<double>& weights, ReadSoFar& so_far)
      : input_(input),
        data_(data),
        look_(look),
        source_(source),
        index_(index),
        weights_(weights),
        so_far_(so_far) {}

  /// All primitives as one mesh.
  Mesh read(std::vector<Note>& notes) {
    mesh_.name = source_.name.empty() ? input_.stem : short_name(source_.name);
    for (size_t i = 0; i < source_.primitives.size(); ++i) {
      read_primitive(source_.primitives[i], i);
      if (input_.limits.colors) set_material(source_.primitives[i]);
    }
    mesh_.look.complete(mesh_.positions.size(), mesh_.triangles.size());
    const auto note = [&](NoteKind kind, const std::string& text) {
      notes.push_back({kind, fmt::format("{}: mesh '{}' {}", input_.file.string(), mesh_.name, text)});
    };
    if (skipped_ != 0)
      note(NoteKind::points_and_lines,
           fmt::format("has {} primitives of points or lines, which were left out.", skipped_));
    if (loose_ != 0)
      note(NoteKind::loose_indices, fmt::format("ends with {} indices that do not make a triangle.", loose_));
    if (morphs_)
      note(NoteKind::morphs, weights_.empty() ? "has morph targets; its rest shape is used."
                                              : "has morph targets; the weights in the file are used.");
    if (uncolored_)
      note(NoteKind::colors,
           "has colours or texture coordinates that do not fit its vertices, or of Draco data, which were "
           "left out.");
    if (unmorphed_) note(NoteKind::draco_morphs, "has morph targets of Draco data, which were left out.");
    return std::move(mesh_);
  }

 private:
  void read_primitive(const tinygltf::Primitive& primitive, size_t number) {
    first_triangle_ = mesh_.triangles.size();
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
      unmorphed_ |= !weights_.empty() && !primitive.targets.empty();  // Draco may reorder the vertices
      read_draco_primitive(primitive, draco->second, number);
      return;
    }
    const auto position = primitive.attributes.find("POSITION");
    if (position == primitive.attributes.end()) {
      ++skipped_;  // valid: an extension may bring the positions, or there is nothing to see
      return;
    }
    const auto [base, count] = vertices(primitive, position->second, number);
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
                    fmt::format("index {} of primitive {} of mesh {} uses vertex {}, but there are only {}",
                                i, number, index_, indices[i], count));
      }
      indices[i] += base;
    }
    add_triangles(mode, indices);
  }

  struct Range {
    uint32_t base;
    uint32_t count;
  };

  /// A morph target's positions, and how much of them is added.
  using Target = std::pair<int, double>;

  std::vector<Target> targets_of(const tinygltf::Primitive& primitive) const {
    std::vector<Target> targets;
    for (size_t i = 0; i < std::min(primitive.targets.size(), weights_.size()); ++i) {
      const auto position = primitive.targets[i].find("POSITION");
      if (position != primitive.targets[i].end() && weights_[i] != 0)
        targets.emplace_back(position->second, weights_[i]);
    }
    return targets;
  }

  void morph(std::vector<Float3>& positions, const std::vector<Target>& targets, size_t number) {
    constexpr uint64_t kMostMorphed = uint64_t{1} << 32;
    so_far_.morphed += positions.size() * targets.size();
    if (so_far_.morphed > kMostMorphed)
      input_.fail(Status::too_large, fmt::format("has more than {} positions of morph targets, up to mesh {}",
                                                 kMostMorphed, index_));
    std::vector<std::array<double, 3>> sums(positions.size());
    for (const auto& [accessor, weight] : targets) {
      const std::vector<Float3> moves = data_.positions(accessor);
      if (moves.size() != positions.size())
        fail(number,
             fmt::format("has {} positions, but a morph target of {}", positions.size(), moves.size()));
      for (size_t i = 0; i < moves.size(); ++i)
        for (size_t k = 0; k < 3; ++k) sums[i][k] += weight * double{moves[i][k]};
    }
    for (size_t i = 0; i < positions.size(); ++i)
      for (size_t k = 0; k < 3; ++k)
        positions[i][k] = static_cast<float>(double{positions[i][k]} + sums[i][k]);
  }

  /// What a primitive's vertices are read from.
  struct Attributes {
    int positions;
    std::vector<Target> targets;
    int colors = -1, coordinates = -1;  ///< only where they matter; -1: none

    auto operator<=>(const Attributes&) const = default;
  };

  /// Null where the primitive has no material that there is.
  const GltfMaterial* material_of(const tinygltf::Primitive& primitive) const {
    const bool there = primitive.material >= 0 && size_t(primitive.material) < look_.materials.size();
    return there ? &look_.materials[size_t(primitive.material)] : nullptr;
  }

  /// The accessor of the texture coordinates by which the primitive's picture is placed; -1: none.
  int coordinates_of(const tinygltf::Primitive& primitive) const {
    const GltfMaterial* material = material_of(primitive);
    if (!material || material->image == -1) return -1;
    const auto found = primitive.attributes.find(fmt::format("TEXCOORD_{}", material->coordinates));
    return found == primitive.attributes.end() ? -1 : found->second;
  }

  Attributes attributes_of(const tinygltf::Primitive& primitive, int positions) const {
    Attributes attributes{positions, targets_of(primitive)};
    if (!input_.limits.colors) return attributes;
    if (const auto found = primitive.attributes.find("COLOR_0"); found != primitive.attributes.end())
      attributes.colors = found->second;
    attributes.coordinates = coordinates_of(primitive);
    return attributes;
  }

  /// Of the triangles that were read last. A picture that nothing places counts for nothing.
  void set_material(const tinygltf::Primitive& primitive) {
    if (mesh_.triangles.size() == first_triangle_) return;
    std::vector<uint32_t>& materials = mesh_.look.materials;
    const bool draco = primitive.extensions.contains(kDraco);
    uncolored_ |= draco && primitive.attributes.contains("COLOR_0");
    if (!material_of(primitive)) {
      if (!materials.empty()) materials.resize(mesh_.triangles.size(), 0);
      return;
    }
    const auto material = size_t(primitive.material);
    const bool placed = coordinates_of(primitive) != -1;
    uncolored_ |= draco && placed;
    materials.resize(first_triangle_, 0);
    materials.resize(mesh_.triangles.size(),
                     placed && !draco ? with_picture(material) : with_factor(material));
  }

  void add_look(const Attributes& attributes, const Range& range) {
    Appearance& look = mesh_.look;
    if (attributes.colors != -1) {
      const std::vector<Float3> colors = data_.colors(attributes.colors);
      uncolored_ |= colors.size() != range.count;
      for (uint32_t i = 0; i < std::min<size_t>(colors.size(), range.count); ++i)
        look.set_color(range.base + i, colors[i]);
    }
    if (attributes.coordinates != -1) {
      const std::vector<std::array<float, 2>> places = data_.coordinates(attributes.coordinates);
      uncolored_ |= places.size() != range.count;
      look.coordinates.resize(range.base);
      look.coordinates.insert(look.coordinates.end(), places.begin(),
                              places.begin() + ptrdiff_t(std::min<size_t>(places.size(), range.count)));
    }
  }

  /// Primitives of one mesh often share one set of vertices; it is read once.
  Range vertices(const tinygltf::Primitive& primitive, int accessor, size_t number) {
    const Attributes key = attributes_of(primitive, accessor);
    const std::vector<Target>& targets = key.targets;
    if (const auto known = ranges_.find(key); known != ranges_.end()) return known->second;
    std::vector<Float3> positions = data_.positions(accessor);
    count_positions(positions.size());
    if (!targets.empty()) morph(positions, targets, number);
    if (mesh_.positions.size() + positions.size() > std::numeric_limits<uint32_t>::max()) {
      input_.fail(Status::too_large,
                  fmt::format("mesh {} has more vertices than 32-bit indices can address", index_));
    }
    const Range range{static_cast<uint32_t>(mesh_.positions.size()), static_cast<uint32_t>(positions.size())};
    mesh_.positions.insert(mesh_.positions.end(), positions.begin(), positions.end());
    add_look(key, range);
    ranges_.emplace(key, range);
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
    const tinygltf::Value& view = member_of(extension, "bufferView");
    const tinygltf::Value& position = member_of(member_of(extension, "attributes"), "POSITION");
    const auto accessor = primitive.attributes.find("POSITION");
    if (!view.IsInt() || !position.IsInt() || position.Get<int>() < 0 ||
        accessor == primitive.attributes.end()) {
      fail(number, "has Draco data without a buffer view and positions");
    }
    const size_t before = mesh_.positions.size();
    append_draco(input_,
                 {.bytes = data_.view(view.Get<int>()),
                  .where = fmt::format("the Draco data of primitive {} of mesh {}", number, index_),
                  .position_id = position.Get<int>(),
                  .normalized = data_.normalized(accessor->second)},
                 mesh_);
    count_positions(mesh_.positions.size() - before);
  }

  void count_positions(size_t more) {
    so_far_.positions += more;
    if (so_far_.positions / 3 > input_.limits.max_triangles)
      input_.fail(Status::too_large,
                  fmt::format("has more vertices than the limit of {} triangles has corners",
                              input_.limits.max_triangles));
  }

  [[noreturn]] void fail(size_t number, const std::string& reason) const {
    input_.fail(Status::malformed_mesh, fmt::format("primitive {} of mesh {} {}", number, index_, reason));
  }

  const Input& input_;
  const GltfData& data_;
  const GltfLook& look_;
  const tinygltf::Mesh& source_;
  size_t index_;
  Mesh mesh_;
  const std::vector<double>& weights_;
  std::map<Attributes, Range> ranges_;
  size_t first_triangle_ = 0;  // of the primitive that is read
  ReadSoFar& so_far_;
  uint64_t skipped_ = 0, loose_ = 0;
  bool morphs_ = false, unmorphed_ = false, uncolored_ = false;
};

/// Meshes as the nodes that carry them want them morphed: each once for each set of weights.
class Variants {
 public:
  explicit Variants(const tinygltf::Model& model)
      : model_(model), of_mesh_(model.meshes.size()), plain_(model.meshes.size(), kUnknown) {
    for (const tinygltf::Mesh& mesh : model.meshes) {
      size_t& targets = targets_.emplace_back(0);
      for (const tinygltf::Primitive& primitive : mesh.primitives)
        targets = std::max(targets, primitive.targets.size());
    }
  }

  /// A number for the placement's mesh with the weights of its node, else those of the mesh.
  size_t add(const GltfPlacement& placement) {
    const size_t mesh = placement.mesh;
    if (placement.node != GltfHierarchy::kNone && !model_.nodes[placement.node].weights.empty())
      return find(mesh, model_.nodes[placement.node].weights);
    if (plain_[mesh] == kUnknown) plain_[mesh] = find(mesh, model_.meshes[mesh].weights);
    return plain_[mesh];
  }

  /// Those of a mesh, in the order in which they were added.
  const std::vector<size_t>& of_mesh(size_t mesh) const { return of_mesh_[mesh]; }
  /// None where all are 0.
  const std::vector<double>& weights(size_t variant) const { return *weights_[variant]; }
  size_t size() const { return weights_.size(); }

 private:
  static constexpr size_t kUnknown = SIZE_MAX;

  size_t find(size_t mesh, std::vector<double> weights) {
    weights.resize(std::min(weights.size(), targets_[mesh]));
    while (!weights.empty() && weights.back() == 0) weights.pop_back();
    const auto [at, added] = known_.emplace(std::pair(mesh, std::move(weights)), weights_.size());
    if (added) {
      of_mesh_[mesh].push_back(at->second);
      weights_.push_back(&at->first.second);
    }
    return at->second;
  }

  const tinygltf::Model& model_;
  std::map<std::pair<size_t, std::vector<double>>, size_t> known_;
  std::vector<const std::vector<double>*> weights_;  // of known_, by number
  std::vector<std::vector<size_t>> of_mesh_;
  std::vector<size_t> plain_;    // by mesh: the variant with its own weights, once it is asked for
  std::vector<size_t> targets_;  // by mesh: most morph targets of a primitive
};

/// Puts skinned meshes where their joints have them in the bind pose.
void place_skins(const Input& input, const GltfData& data, const std::vector<GltfSkin>& skins,
                 const std::vector<std::optional<Affine>>& worlds, std::vector<GltfPlacement>& placements,
                 std::vector<Note>& notes) {
  std::map<size_t, std::optional<BindPlace>> places;  // by skin
  size_t posed = 0, deformed = 0;
  for (GltfPlacement& placement : placements) {
    if (placement.skin < 0) continue;
    const size_t skin = static_cast<size_t>(placement.skin);
    if (!places.contains(skin))
      places[skin] = skin < skins.size() ? bind_place(data, skins[skin], worlds) : std::nullopt;
    const std::optional<BindPlace>& place = places[skin];
    ++(place ? posed : deformed);
    if (!place || place->alike(*worlds[placement.node])) continue;  // as it is, without rounding
    if (const std::optional<Transform> transform = to_transform(place->place)) {
      placement.transform = *transform;
      placement.remainder = remainder_of(place->place);
    }
  }
  if (posed != 0)
    notes.push_back(
        {NoteKind::bind_pose, input.file.string() + ": has skins; its meshes are read in the bind pose."});
  if (deformed != 0)
    notes.push_back(
        {NoteKind::posed_skin,
         fmt::format(
             "{}: has {} whose joints are not in the bind pose; each mesh is read in its shape before "
             "binding, at its node.",
             input.file.string(), deformed == 1 ? "a skin" : fmt::format("{} skins", deformed))});
}

/// Collects nodes with all that is above them, parents first and each once.
class NodeCollector {
 public:
  NodeCollector(const tinygltf::Model& model, const GltfHierarchy& hierarchy,
                const std::set<size_t>& animated)
      : model_(model), hierarchy_(hierarchy), animated_(animated), index_(model.nodes.size(), kNoNode) {}

  /// The node's index in `nodes`; kNoNode for GltfHierarchy::kNone.
  uint32_t add(size_t node, std::vector<Node>& nodes) {
    std::vector<size_t> missing;
    for (; node != GltfHierarchy::kNone && index_[node] == kNoNode; node = hierarchy_.parents[node])
      missing.push_back(node);
    uint32_t last = node == GltfHierarchy::kNone ? kNoNode : index_[node];
    for (auto next = missing.rbegin(); next != missing.rend(); ++next) {
      const bool moves = animated_.contains(*next) || (last != kNoNode && nodes[last].moves);
      nodes.push_back({static_cast<uint32_t>(*next), model_.nodes[*next].name, last, moves});
      last = index_[*next] = static_cast<uint32_t>(nodes.size() - 1);
    }
    return last;
  }

 private:
  const tinygltf::Model& model_;
  const GltfHierarchy& hierarchy_;
  const std::set<size_t>& animated_;
  std::vector<uint32_t> index_;  // [node of the file]
};

/// [material] whether a primitive of a mesh has it.
std::vector<bool> used_materials(const tinygltf::Model& model, const GltfLook& look) {
  std::vector<bool> used(look.materials.size());
  for (const tinygltf::Mesh& mesh : model.meshes)
    for (const tinygltf::Primitive& primitive : mesh.primitives)
      if (primitive.material >= 0 && size_t(primitive.material) < used.size())
        used[size_t(primitive.material)] = true;
  return used;
}

}  // namespace

Scene read_gltf(const Input& input, std::vector<ExternalFile>& external) {
  GltfSource source = open_gltf(input, external);
  const tinygltf::Model model = parse_model(input, source.json);
  const GltfData data(input, source, model);
  Scene scene;
  scene.notes = std::move(source.notes);

  if (input.limits.colors) add_materials(input, source.look, used_materials(model, source.look), data, scene);

  FixturePlacer fixtures(input, source.fixtures, scene);
  std::vector<std::optional<Affine>> worlds(model.nodes.size());
  GltfHierarchy hierarchy = flatten(input, model, [&](size_t node, const Affine& world) {
    fixtures.visit(node, to_transform(world));
    worlds[node] = world;
  });
  fixtures.report();
  std::vector<GltfPlacement>& placements = hierarchy.placements;
  if (model.nodes.empty()) {
    for (size_t i = 0; i < model.meshes.size(); ++i)
      placements.push_back({GltfHierarchy::kNone, i, -1, kIdentity, {}});
  }
  place_skins(input, data, source.skins, worlds, placements, scene.notes);

  Variants variants(model);
  std::vector<size_t> variant_of;
  for (const GltfPlacement& placement : placements) variant_of.push_back(variants.add(placement));
  constexpr uint32_t kAbsent = std::numeric_limits<uint32_t>::max();
  std::vector<uint32_t> mesh_of(variants.size(), kAbsent);
  uint64_t triangles = 0;
  ReadSoFar so_far;
  for (size_t i = 0; i < model.meshes.size(); ++i) {
    if (variants.of_mesh(i).empty()) {
      scene.notes.push_back(
          {NoteKind::hidden_mesh,
           fmt::format("{}: mesh {} is not in the scene and was left out", input.file.string(), i)});
    }
    for (const size_t variant : variants.of_mesh(i)) {
      Mesh mesh = MeshReader(input, data, source.look, model.meshes[i], i, variants.weights(variant), so_far)
                      .read(scene.notes);
      if (mesh.triangles.empty()) continue;
      check_triangle_limit(input, triangles += mesh.triangles.size());
      mesh_of[variant] = static_cast<uint32_t>(scene.meshes.size());
      scene.meshes.push_back(std::move(mesh));
    }
  }
  NodeCollector nodes(model, hierarchy, source.animated);
  for (size_t i = 0; i < placements.size(); ++i) {
    const GltfPlacement& placement = placements[i];
    const uint32_t mesh = mesh_of[variant_of[i]];
    if (mesh == kAbsent) continue;
    const uint32_t node = nodes.add(placement.node, scene.nodes);
    const bool named = node != kNoNode && !scene.nodes[node].name.empty();
    const bool moves = placement.skin >= 0 || (node != kNoNode && scene.nodes[node].moves);
    scene.instances.push_back({named ? scene.nodes[node].name : scene.meshes[mesh].name, mesh,
                               placement.transform, node, moves, placement.remainder});
  }
  forget_small_remainders(scene);
  return scene;
}

}  // namespace nif::mesh::detail
