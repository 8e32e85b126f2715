// Reads glTF primitives (indices, vertices and looks), with our own checks.
#include "formats/mesh/gltf/mesh_reader.hpp"

#include <fmt/format.h>
#include <tiny_gltf.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <span>

#include "formats/base/memory.hpp"
#include "formats/mesh/gltf/look.hpp"
#include "formats/mesh/gltf/skin_collector.hpp"
#include "formats/mesh/readers.hpp"

namespace nif::mesh::detail {
namespace {

constexpr const char* kDraco = "KHR_draco_mesh_compression";

class MeshReader {
 public:
  MeshReader(const GltfMeshSources& sources, const tinygltf::Mesh& source, size_t index,
             const GltfVariant& variant, ReadSoFar& so_far)
      : input_(sources.input),
        data_(sources.data),
        look_(sources.look),
        surfaces_(sources.surfaces),
        naming_(sources.naming),
        alpha_(sources.alpha),
        source_(source),
        index_(index),
        weights_(variant.weights),
        pose_(variant.pose),
        by_material_(variant.by_material),
        so_far_(so_far) {
    if (!input_.limits.skins) return;
    size_t targets = 0;
    for (const tinygltf::Primitive& primitive : source.primitives)
      targets = std::max(targets, primitive.targets.size());
    skin_.emplace(data_, variant.skin, variant.joints, targets);
  }

  /// Reads all primitives as one mesh.
  Mesh read(std::vector<Note>& notes) {
    mesh_.name = source_.name.empty() ? input_.stem : short_name(source_.name);
    for (size_t i = 0; i < source_.primitives.size(); ++i) {
      if (!is_chosen(source_.primitives[i])) continue;
      read_primitive(source_.primitives[i], i);
      if (input_.limits.colors) set_material(source_.primitives[i]);
      if (alpha_)
        decide_alpha(source_.primitives[i]);
      else
        count_see_through(source_.primitives[i]);
    }
    if (skin_ && !mesh_.positions.empty()) mesh_.skin = skin_->finish(rest_weights());
    if (!mesh_.alpha.empty()) mesh_.alpha.resize(mesh_.triangles.size(), TriangleAlpha::solid);
    holes_.finish(mesh_);
    mesh_.look.complete(mesh_.positions.size(), mesh_.triangles.size());
    const auto note = [&](NoteKind kind, const std::string& text) {
      notes.push_back({kind, fmt::format("{}: mesh '{}' {}", input_.file.string(), mesh_.name, text)});
    };
    if (skipped_ != 0)
      note(NoteKind::points_and_lines,
           fmt::format("has {} primitives of points or lines, which were left out.", skipped_));
    if (loose_ != 0)
      note(NoteKind::loose_indices, fmt::format("ends with {} indices that do not make a triangle.", loose_));
    if (morphs_ && !skin_)
      note(NoteKind::morphs, weights_.empty() ? "has morph targets; its rest shape is used."
                                              : "has morph targets; the weights in the file are used.");
    if (uncolored_)
      note(NoteKind::colors,
           "has colours or texture coordinates that do not fit its vertices or are in Draco data; they were "
           "left out.");
    if (unposed_ || (skin_ && skin_->unreadable()))
      note(NoteKind::posed_skin,
           "has joints and weights that cannot be read or are in Draco data; the first joint places what "
           "they should move.");
    const auto vertices = [](uint64_t count) {
      return count == 1 ? std::string("a vertex") : fmt::format("{} vertices", count);
    };
    if (skin_ && skin_->with_many() != 0)
      note(NoteKind::posed_skin,
           fmt::format("has {} with more than {} joints; those with the largest weights move them.",
                       vertices(skin_->with_many()), SkinCollector::kMostInfluences));
    if (skin_ && skin_->without_weights() != 0)
      note(NoteKind::pose, fmt::format("has {} without weights; the first joint moves them.",
                                       vertices(skin_->without_weights())));
    if (unmorphed_) note(NoteKind::draco_morphs, "has morph targets in Draco data, which were left out.");
    return std::move(mesh_);
  }

 private:
  /// Whether the primitive is chosen, as far as its material decides.
  bool is_chosen(const tinygltf::Primitive& primitive) const {
    const bool there = primitive.material >= 0 && size_t(primitive.material) < naming_.materials.size();
    const Named named = there ? naming_.materials[size_t(primitive.material)] : Named();
    return !named.except && (named.only || !by_material_);
  }

  /// Counts the triangles that were just read, if their material lets light through.
  void count_see_through(const tinygltf::Primitive& primitive) {
    const size_t count = mesh_.triangles.size() - first_triangle_, material = size_t(primitive.material);
    if (count == 0 || primitive.material < 0 || material >= surfaces_.size()) return;
    const auto colors = primitive.attributes.find("COLOR_0");
    const bool alpha = colors != primitive.attributes.end() && data_.has_alpha(colors->second);
    if (surfaces_[material].lets_light_through(alpha)) so_far_.see_through[material] += count;
  }

  /// Decides what the triangles that were just read let through.
  void decide_alpha(const tinygltf::Primitive& primitive) {
    const std::span<const Triangle> triangles = std::span(mesh_.triangles).subspan(first_triangle_);
    if (triangles.empty() || !alpha_->may_matter(primitive.material)) return;
    const auto colors = primitive.attributes.find("COLOR_0");
    const bool has_colors = colors != primitive.attributes.end();
    const std::vector<TriangleAlpha> alpha =
        alpha_->decide({.material = primitive.material,
                        .colors = has_colors ? colors->second : -1,
                        .coordinates = coordinates_of(primitive),
                        .hidden = primitive.extensions.contains(kDraco)},
                       {triangles, first_triangle_, range_.base, range_.count}, holes_);
    if (alpha.empty()) return;
    mesh_.alpha.resize(first_triangle_, TriangleAlpha::solid);
    mesh_.alpha.insert(mesh_.alpha.end(), alpha.begin(), alpha.end());
  }

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
      // Draco may reorder the vertices.
      unmorphed_ |= (skin_ || !weights_.empty()) && !primitive.targets.empty();
      const size_t first = mesh_.positions.size();
      read_draco_primitive(primitive, draco->second, number);
      if (pose_) pose_from(first, {});
      if (skin_) keep_bending(mesh_.positions.size() - first, {}, {}, number);
      return;
    }
    const auto position = primitive.attributes.find("POSITION");
    if (position == primitive.attributes.end()) {
      ++skipped_;  // valid: an extension may supply the positions, or there is nothing to see
      return;
    }
    range_ = vertices(primitive, position->second, number);
    const auto [base, count] = range_;
    std::vector<uint32_t> indices;
    const auto accessor = primitive.attributes.find(kIndicesAttribute);
    if (accessor != primitive.attributes.end()) {
      indices = data_.indices(accessor->second);
    } else {
      indices.resize(count);
      for (uint32_t i = 0; i < count; ++i) indices[i] = i;
    }
    if (indices.empty()) ++so_far_.empty_primitives;
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

  /// The accessor of a morph target's positions, and its weight.
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
    count_moved(positions.size() * targets.size());
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

  /// The accessors of a primitive's morph targets if they are kept, -1 for those that move nothing.
  std::vector<int> kept_targets_of(const tinygltf::Primitive& primitive) const {
    std::vector<int> targets;
    for (size_t i = 0; skin_ && i < primitive.targets.size(); ++i) {
      const auto position = primitive.targets[i].find("POSITION");
      targets.push_back(position == primitive.targets[i].end() ? -1 : position->second);
    }
    return targets;
  }

  /// Keeps what moves vertices that follow those before.
  void keep_bending(size_t vertices, const GltfInfluences& influences, const std::vector<int>& targets,
                    size_t number) {
    count_moved(vertices * (1 + influences.size() + targets.size()));
    so_far_.kept_moves += vertices * skin_->targets();
    if (so_far_.kept_moves / 3 > input_.limits.max_triangles)
      input_.fail(
          Status::too_large,
          fmt::format("has more positions of morph targets than the limit of {} triangles has corners",
                      input_.limits.max_triangles));
    require_memory(vertices * (skin_->targets() * sizeof(Float3) + (skin_->has_joints() ? 100 : 0)),
                   fmt::format("{}: what moves the vertices of mesh {}", input_.file.string(), index_));
    skin_->add_joints(vertices, influences);
    for (size_t i = 0; i < targets.size(); ++i) {
      if (targets[i] < 0) continue;
      const std::vector<Float3> moves = data_.positions(targets[i]);
      if (moves.size() != vertices)
        fail(number, fmt::format("has {} positions, but a morph target of {}", vertices, moves.size()));
      for (const Float3& move : moves)
        if (!std::isfinite(move[0]) || !std::isfinite(move[1]) || !std::isfinite(move[2]))
          fail(number, fmt::format("has a morph target {} with numbers that are not finite", i));
      skin_->set_target(i, moves);
    }
  }

  /// The weights of the mesh's targets.
  std::vector<float> rest_weights() const {
    std::vector<float> weights;
    for (size_t i = 0; i < skin_->targets(); ++i) {
      weights.push_back(i < source_.weights.size() ? static_cast<float>(source_.weights[i]) : 0);
      if (!std::isfinite(weights.back()))
        input_.fail(Status::malformed_mesh,
                    fmt::format("mesh {} has the weight {}", index_, source_.weights[i]));
    }
    return weights;
  }

  /// A small file can have the same positions moved again and again, so their number is limited.
  void count_moved(uint64_t positions) {
    constexpr uint64_t kMostMoved = uint64_t{1} << 32;
    so_far_.moved += positions;
    if (so_far_.moved > kMostMoved)
      input_.fail(Status::too_large,
                  fmt::format("has more than {} positions of morph targets and of joints, up to mesh {}",
                              kMostMoved, index_));
  }

  /// Accessors of the joints that move a primitive, if they matter.
  GltfInfluences influences_of(const tinygltf::Primitive& primitive) const {
    GltfInfluences influences;
    for (size_t n = 0; pose_ || (skin_ && skin_->has_joints()); ++n) {
      const auto joints = primitive.attributes.find(fmt::format("JOINTS_{}", n)),
                 weights = primitive.attributes.find(fmt::format("WEIGHTS_{}", n));
      if (joints == primitive.attributes.end() || weights == primitive.attributes.end()) break;
      influences.emplace_back(joints->second, weights->second);
    }
    return influences;
  }

  void pose(std::vector<Float3>& positions, const GltfInfluences& influences) {
    count_moved(positions.size() * (1 + influences.size()));
    unposed_ |= !apply_pose(data_, *pose_, influences, positions);
  }

  /// Applies the pose to the mesh's positions from `first` on.
  void pose_from(size_t first, const GltfInfluences& influences) {
    const auto begin = mesh_.positions.begin() + ptrdiff_t(first);
    std::vector<Float3> positions(begin, mesh_.positions.end());
    pose(positions, influences);
    std::ranges::copy(positions, begin);
  }

  /// Accessors of a primitive's vertices.
  struct Attributes {
    int positions;
    std::vector<Target> targets;
    GltfInfluences influences;
    std::vector<int> kept_targets;
    int colors = -1, coordinates = -1;  ///< only if they matter; -1: none

    auto operator<=>(const Attributes&) const = default;
  };

  /// Null if the primitive has no existing material.
  const GltfMaterial* material_of(const tinygltf::Primitive& primitive) const {
    const bool there = primitive.material >= 0 && size_t(primitive.material) < look_.materials.size();
    return there ? &look_.materials[size_t(primitive.material)] : nullptr;
  }

  /// The accessor of the texture coordinates for the primitive's picture; -1: none.
  int coordinates_of(const tinygltf::Primitive& primitive) const {
    const GltfMaterial* material = material_of(primitive);
    if (!material || material->image == -1) return -1;
    const auto found = primitive.attributes.find(fmt::format("TEXCOORD_{}", material->coordinates));
    return found == primitive.attributes.end() ? -1 : found->second;
  }

  Attributes attributes_of(const tinygltf::Primitive& primitive, int positions) const {
    Attributes attributes{positions, targets_of(primitive), influences_of(primitive),
                          kept_targets_of(primitive)};
    if (!input_.limits.colors) return attributes;
    if (const auto found = primitive.attributes.find("COLOR_0"); found != primitive.attributes.end())
      attributes.colors = found->second;
    attributes.coordinates = coordinates_of(primitive);
    return attributes;
  }

  /// For the triangles that were just read. A picture without texture coordinates is ignored.
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
      const std::vector<Float3> colors = data_.colors(attributes.colors, range.count);
      uncolored_ |= data_.count(attributes.colors) != range.count;
      for (uint32_t i = 0; i < std::min<size_t>(colors.size(), range.count); ++i)
        look.set_color(range.base + i, colors[i]);
    }
    if (attributes.coordinates != -1) {
      const std::vector<std::array<float, 2>> places = data_.coordinates(attributes.coordinates, range.count);
      uncolored_ |= data_.count(attributes.coordinates) != range.count;
      look.coordinates.resize(range.base);
      look.coordinates.insert(look.coordinates.end(), places.begin(),
                              places.begin() + ptrdiff_t(std::min<size_t>(places.size(), range.count)));
    }
  }

  /// Primitives of one mesh often share one set of vertices, so each set is read once.
  Range vertices(const tinygltf::Primitive& primitive, int accessor, size_t number) {
    const Attributes key = attributes_of(primitive, accessor);
    const std::vector<Target>& targets = key.targets;
    if (const auto known = ranges_.find(key); known != ranges_.end()) return known->second;
    std::vector<Float3> positions = data_.positions(accessor);
    count_positions(positions.size());
    if (!targets.empty()) morph(positions, targets, number);
    if (pose_) pose(positions, key.influences);
    if (skin_) keep_bending(positions.size(), key.influences, key.kept_targets, number);
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
      // Strips are connected by triangles that use a vertex twice; these are not part of the surface.
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
  const std::vector<GltfSurface>& surfaces_;
  const GltfNaming& naming_;
  GltfAlpha* alpha_;
  const tinygltf::Mesh& source_;
  size_t index_;
  Mesh mesh_;
  HoleCollector holes_;
  const std::vector<double>& weights_;
  const GltfPose* pose_;
  std::optional<SkinCollector> skin_;  // if it is kept
  bool by_material_;
  std::map<Attributes, Range> ranges_;
  size_t first_triangle_ = 0;  // of the current primitive
  Range range_{};              // its vertices
  ReadSoFar& so_far_;
  uint64_t skipped_ = 0, loose_ = 0;
  bool morphs_ = false, unmorphed_ = false, uncolored_ = false, unposed_ = false;
};

}  // namespace

Mesh read_mesh(const GltfMeshSources& sources, const tinygltf::Mesh& mesh, size_t index,
               const GltfVariant& variant, ReadSoFar& so_far, std::vector<Note>& notes) {
  return MeshReader(sources, mesh, index, variant, so_far).read(notes);
}

}  // namespace nif::mesh::detail
