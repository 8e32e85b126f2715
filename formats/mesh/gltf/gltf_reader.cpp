// glTF and GLB: tinygltf parses the structure; geometry, hierarchy and compression are read with our own
// checks.
#include <fmt/format.h>
#include <tiny_gltf.h>

#include <algorithm>
#include <limits>
#include <map>
#include <new>
#include <set>

#include "formats/mesh/far_from_origin.hpp"
#include "formats/mesh/flat_meshes.hpp"
#include "formats/mesh/gltf/accessor.hpp"
#include "formats/mesh/gltf/clip.hpp"
#include "formats/mesh/gltf/gltf_hierarchy.hpp"
#include "formats/mesh/gltf/instancing.hpp"
#include "formats/mesh/gltf/look.hpp"
#include "formats/mesh/gltf/mesh_reader.hpp"
#include "formats/mesh/gltf/skin.hpp"
#include "formats/mesh/readers.hpp"

namespace nif::mesh::detail {
namespace {

/// The variants of meshes that nodes need: one for each set of weights, pose and choice.
class Variants {
 public:
  Variants(const tinygltf::Model& model, bool keeps_skins)
      : model_(model), keeps_skins_(keeps_skins), of_mesh_(model.meshes.size()) {
    for (const tinygltf::Mesh& mesh : model.meshes) {
      size_t& targets = targets_.emplace_back(0);
      for (const tinygltf::Primitive& primitive : mesh.primitives)
        targets = std::max(targets, primitive.targets.size());
    }
  }

  bool morphs(size_t mesh) const { return targets_[mesh] > 0; }

  /// The number of the placement's mesh with the weights of its node, or those of the mesh if the node has
  /// none; without weights if skins are kept, because these say how to move it.
  size_t add(const GltfPlacement& placement) {
    const bool same = !parts_.empty() && last_.node == placement.node && last_.mesh == placement.mesh &&
                      last_.pose == placement.pose && last_.by_material == placement.by_material &&
                      last_.bends == placement.bends;
    // another instance of the same node
    if (same && placement.node != GltfHierarchy::kNone) return last_variant_;
    last_ = placement;
    const size_t mesh = placement.mesh;
    const bool own = placement.node != GltfHierarchy::kNone && !model_.nodes[placement.node].weights.empty();
    const std::vector<double>& weights =
        own ? model_.nodes[placement.node].weights : model_.meshes[mesh].weights;
    const size_t count = keeps_skins_ ? 0 : std::min(weights.size(), targets_[mesh]);
    Key key{mesh,
            placement.pose,
            placement.bends ? uint32_t(placement.skin) : kNoSkin,
            placement.by_material,
            {weights.begin(), weights.begin() + std::ptrdiff_t(count)}};
    while (!key.weights.empty() && key.weights.back() == 0) key.weights.pop_back();
    const auto [at, added] = known_.emplace(std::move(key), parts_.size());
    if (added) {
      of_mesh_[mesh].push_back(at->second);
      parts_.push_back(&at->first);
    }
    return last_variant_ = at->second;
  }

  /// The variants of a mesh, in the order in which they were added.
  const std::vector<size_t>& of_mesh(size_t mesh) const { return of_mesh_[mesh]; }
  GltfVariant variant(size_t number, const std::vector<GltfPose>& poses,
                      const std::vector<GltfSkin>& skins) const {
    const Key& key = *parts_[number];
    return {key.weights, key.pose == SIZE_MAX ? nullptr : &poses[key.pose], key.by_material, key.skin,
            key.skin == kNoSkin ? 0 : skins[key.skin].joints.size()};
  }
  size_t size() const { return parts_.size(); }

 private:
  struct Key {
    size_t mesh, pose;
    uint32_t skin;  ///< that is kept, or kNoSkin
    bool by_material;
    std::vector<double> weights;  ///< empty if all are 0

    auto operator<=>(const Key&) const = default;
  };

  const tinygltf::Model& model_;
  bool keeps_skins_;
  std::map<Key, size_t> known_;
  std::vector<const Key*> parts_;  // from known_, by number
  std::vector<std::vector<size_t>> of_mesh_;
  std::vector<size_t> targets_;  // by mesh: most morph targets of any primitive
  GltfPlacement last_{};
  size_t last_variant_ = 0;
};

/// Where the instances of a skin that is kept are, of which one would be at `place`: a transform that has an inverse, whatever
/// the pose, because poses are relative to it. It is rounded, so that no instance keeps a remainder that another loses.
Affine place_of_kept(const GltfPose& pose, const Affine* bind_place, const Affine& place) {
  const Affine& rest = !bind_place                         ? pose.joints.front()
                       : pose.is_alike(*bind_place, place) ? place
                                                           : *bind_place;
  const Transform rounded = *to_transform(rest);  // poses and places are finite
  Affine kept;
  std::copy(rounded.begin(), rounded.end(), kept.begin());
  if (bind_place && !is_flat(kept)) return kept;
  return {1, 0, 0, kept[3], 0, 1, 0, kept[7], 0, 0, 1, kept[11]};
}

SkinJoints joints_of(uint32_t number, const GltfSkin& skin, const GltfPose& pose) {
  SkinJoints described{number, {}};
  for (size_t k = 0; k < skin.joints.size(); ++k)
    described.joints.push_back({uint32_t(skin.joints[k]), inverse(pose.joints[k])});
  return described;
}

/// Places skinned meshes by their joints. Returns the poses that deform some of them: none, if skins are kept; these go to
/// `kept`.
std::vector<GltfPose> place_skins(const Input& input, const GltfData& data,
                                  const std::vector<GltfSkin>& skins,
                                  const std::vector<std::optional<Affine>>& worlds,
                                  std::vector<GltfPlacement>& placements, std::vector<SkinJoints>& kept,
                                  std::vector<Note>& notes) {
  struct Known {
    std::optional<GltfPose> pose;
    const Affine* bind_place = nullptr;
    size_t deforming = SIZE_MAX;
    Affine place{};  ///< of what keeps it
  };
  std::map<int, Known> known;
  std::vector<GltfPose> poses;
  size_t bound = 0, posed = 0, unreadable = 0;
  for (GltfPlacement& placement : placements) {
    if (placement.skin < 0) continue;
    const auto [at, fresh] = known.try_emplace(placement.skin);
    Known& skin = at->second;
    if (fresh && size_t(placement.skin) < skins.size()) {
      skin.pose = pose_of(data, skins[size_t(placement.skin)], worlds);
      if (skin.pose) skin.bind_place = skin.pose->bind_place();
      if (skin.pose && input.limits.skins) {
        skin.place = place_of_kept(*skin.pose, skin.bind_place, placement.place);
        kept.push_back(joints_of(uint32_t(placement.skin), skins[size_t(placement.skin)], *skin.pose));
      } else if (skin.pose && !skin.bind_place) {
        skin.deforming = poses.size();
        poses.push_back(*skin.pose);
      }
    }
    Affine& place = placement.place;
    if (skin.pose && input.limits.skins) {
      placement.bends = true;
      place = skin.place;
    } else if (skin.bind_place) {
      ++bound;
      // otherwise the exact transform is kept
      if (!skin.pose->is_alike(*skin.bind_place, place)) place = *skin.bind_place;
    } else if (skin.pose) {
      ++posed;
      placement.pose = skin.deforming;
      const Float3 origin = skin.pose->origin();
      place = {1, 0, 0, double{origin[0]}, 0, 1, 0, double{origin[1]}, 0, 0, 1, double{origin[2]}};
    } else {
      ++unreadable;
      // A scale of 0 in its node does not affect a skinned mesh.
      if (is_flat(place)) place = {1, 0, 0, place[3], 0, 1, 0, place[7], 0, 0, 1, place[11]};
    }
  }
  const auto note = [&](NoteKind kind, size_t count, const char* text) {
    if (count != 0) notes.push_back({kind, fmt::format("{}: {}", input.file.string(), text)});
  };
  note(NoteKind::bind_pose, bound, "has skins; its meshes are read in the bind pose.");
  note(NoteKind::pose, posed,
       "has skins in another pose than the bind pose; its meshes are read in the pose that "
       "its nodes have.");
  note(NoteKind::posed_skin, unreadable,
       "has skins whose joints cannot be read; their meshes are read in their shape before binding, at their "
       "nodes.");
  return poses;
}

/// Collects nodes with all their ancestors, parents first and each once.
class NodeCollector {
 public:
  NodeCollector(const tinygltf::Model& model, const GltfHierarchy& hierarchy, const std::set<size_t>& moving)
      : model_(model), hierarchy_(hierarchy), moving_(moving), index_(model.nodes.size(), kNoNode) {}

  /// Returns the node's index in `nodes`; kNoNode for GltfHierarchy::kNone.
  uint32_t add(size_t node, std::vector<Node>& nodes) {
    std::vector<size_t> missing;
    for (; node != GltfHierarchy::kNone && index_[node] == kNoNode; node = hierarchy_.parents[node])
      missing.push_back(node);
    uint32_t last = node == GltfHierarchy::kNone ? kNoNode : index_[node];
    for (auto next = missing.rbegin(); next != missing.rend(); ++next) {
      const bool itself = moving_.contains(*next), moves = itself || (last != kNoNode && nodes[last].moves);
      nodes.push_back({static_cast<uint32_t>(*next), model_.nodes[*next].name, last, moves, itself});
      last = index_[*next] = static_cast<uint32_t>(nodes.size() - 1);
    }
    return last;
  }

 private:
  const tinygltf::Model& model_;
  const GltfHierarchy& hierarchy_;
  const std::set<size_t>& moving_;
  std::vector<uint32_t> index_;  // [node number in the file]
};

/// Instances whose transforms leave no area of their meshes.
class LeftOut {
 public:
  void add(std::string_view name) {
    ++count_;
    if (names_.size() > kNamed) return;
    std::string text = fmt::format("'{}'", short_name(name));
    if (std::ranges::find(names_, text) == names_.end())
      names_.push_back(names_.size() < kNamed ? std::move(text) : "...");
  }
  void note(const Input& input, std::vector<Note>& notes) const {
    if (count_ == 0) return;
    notes.push_back({NoteKind::flattened,
                     fmt::format("{}: left out {} whose transform leaves no area: {}.", input.file.string(),
                                 count_ == 1 ? "an instance" : fmt::format("{} instances", count_),
                                 fmt::join(names_, ", "))});
  }

 private:
  static constexpr size_t kNamed = 3;
  uint64_t count_ = 0;
  std::vector<std::string> names_;
};

/// Adds each note once, because several variants of a mesh mostly have the same notes.
void add_new(std::vector<Note> notes, std::vector<Note>& to) {
  const auto first = std::ptrdiff_t(to.size());
  for (Note& note : notes) {
    const auto begin = to.begin() + first;
    if (std::find_if(begin, to.end(), [&](const Note& known) { return known.text == note.text; }) == to.end())
      to.push_back(std::move(note));
  }
}

/// Drops meshes that are not placed, unless none is placed at all.
void drop_unplaced(Scene& scene) {
  std::vector<bool> placed(scene.meshes.size(), scene.instances.empty());
  for (const Instance& instance : scene.instances) placed[instance.mesh] = true;
  std::vector<uint32_t> moved_to(placed.size());
  size_t count = 0;
  for (size_t m = 0; m < placed.size(); ++m) {
    moved_to[m] = static_cast<uint32_t>(count);
    if (!placed[m]) continue;
    if (count != m) scene.meshes[count] = std::move(scene.meshes[m]);
    ++count;
  }
  scene.meshes.resize(count);
  for (Instance& instance : scene.instances) instance.mesh = moved_to[instance.mesh];
}

/// Adds notes about what blocks rays in this file.
void note_what_is_shown(const Input& input, const GltfHierarchy& hierarchy,
                        const std::vector<GltfSurface>& surfaces, const ReadSoFar& so_far, Scene& scene) {
  const auto note = [&](NoteKind kind, const std::string& text) {
    scene.notes.push_back({kind, fmt::format("{}: {}", input.file.string(), text)});
  };
  if (hierarchy.hidden != 0 && scene.meshes.empty())
    input.fail(Status::no_triangles,
               fmt::format("has no triangles that are not hidden (KHR_node_visibility); {} with a mesh {}",
                           hierarchy.hidden == 1 ? "a node" : fmt::format("{} nodes", hierarchy.hidden),
                           hierarchy.hidden == 1 ? "is" : "are"));
  if (hierarchy.hidden != 0)
    note(NoteKind::hidden,
         fmt::format("{} (KHR_node_visibility) and {} nothing.",
                     hierarchy.hidden == 1 ? "a node with a mesh is hidden"
                                           : fmt::format("{} nodes with a mesh are hidden", hierarchy.hidden),
                     hierarchy.hidden == 1 ? "blocks" : "block"));
  if (so_far.empty_primitives != 0)
    note(NoteKind::empty_primitives,
         so_far.empty_primitives == 1
             ? "a primitive without any vertex or index was left out."
             : fmt::format("{} primitives without any vertex or index were left out.",
                           so_far.empty_primitives));
  if (so_far.see_through.empty()) return;
  constexpr size_t kNamed = 5;
  std::vector<std::string> named;
  uint64_t triangles = 0;
  for (const auto& [material, count] : so_far.see_through) {
    triangles += count;
    const std::string& name = surfaces[material].name;
    if (named.size() < kNamed)
      named.push_back(name.empty() ? fmt::format("material {}", material)
                                   : fmt::format("'{}'", short_name(name)));
  }
  const size_t materials = so_far.see_through.size();
  note(NoteKind::see_through,
       fmt::format("{} let{} light through ({}{}); {} of {} {} as if solid, unless --except leaves {} out.",
                   materials == 1 ? "a material" : fmt::format("{} materials", materials),
                   materials == 1 ? "s" : "", fmt::join(named, ", "), materials > kNamed ? ", ..." : "",
                   triangles == 1 ? "1 triangle" : fmt::format("{} triangles", triangles),
                   materials == 1 ? "it" : "them", triangles == 1 ? "blocks" : "block",
                   materials == 1 ? "it" : "them"));
}

/// Keeps the first of each.
void drop_repeated(std::vector<std::string>& files) {
  std::set<std::string> known;
  std::erase_if(files, [&](const std::string& file) { return !known.insert(file).second; });
}

/// [material] whether a primitive of a mesh uses it.
std::vector<bool> used_materials(const tinygltf::Model& model, const GltfLook& look) {
  std::vector<bool> used(look.materials.size());
  for (const tinygltf::Mesh& mesh : model.meshes)
    for (const tinygltf::Primitive& primitive : mesh.primitives)
      if (primitive.material >= 0 && size_t(primitive.material) < used.size())
        used[size_t(primitive.material)] = true;
  return used;
}

}  // namespace

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

Scene read_gltf(const Input& input, std::vector<ExternalFile>& external) {
  GltfSource source = open_gltf(input, external);
  tinygltf::Model model = parse_model(input, source.json);
  const GltfData data(input, source, model);
  Scene scene;
  scene.notes = std::move(source.notes);
  if (input.limits.clips) scene.clips = describe_clips(input, data, source.clips, scene.notes);
  if (input.limits.moment) pose_nodes(input, data, source.clips, *input.limits.moment, model);

  if (input.limits.colors) add_materials(input, source.look, used_materials(model, source.look), data, scene);

  FixturePlacer fixtures(input, source.fixtures, scene);
  std::vector<std::optional<Affine>> worlds(model.nodes.size());
  GltfNaming naming = name_things(input, model, source.surfaces);
  GltfHierarchy hierarchy = flatten(input, model, naming, [&](size_t node, const Affine& world, bool hidden) {
    fixtures.visit(node, to_transform(world), hidden);
    worlds[node] = world;
  });
  fixtures.report();
  std::vector<GltfPlacement>& placements = hierarchy.placements;
  if (model.nodes.empty())
    for (size_t i = 0; i < model.meshes.size(); ++i) {
      hierarchy.in_scene[i] = true;
      naming.place({.node = GltfHierarchy::kNone, .mesh = i}, {}, placements);
    }
  naming.chooser.require_used("node, mesh or material");
  const std::vector<GltfPose> poses =
      place_skins(input, data, source.skins, worlds, placements, scene.skins, scene.notes);
  expand_instances(input, data, model, placements, scene.notes);

  Variants variants(model, input.limits.skins);
  std::vector<size_t> variant_of;
  for (const GltfPlacement& placement : placements) variant_of.push_back(variants.add(placement));
  constexpr uint32_t kAbsent = std::numeric_limits<uint32_t>::max();
  std::vector<uint32_t> mesh_of(variants.size(), kAbsent);
  uint64_t triangles = 0;
  ReadSoFar so_far;
  GltfAlpha alpha(input, source, data, scene);
  const GltfMeshSources sources{input,           data,   source.look,
                                source.surfaces, naming, input.limits.alpha.read ? &alpha : nullptr};
  for (size_t i = 0; i < model.meshes.size(); ++i) {
    if (!hierarchy.in_scene[i]) {
      scene.notes.push_back(
          {NoteKind::hidden_mesh,
           fmt::format("{}: mesh {} is not in the scene and was left out", input.file.string(), i)});
    }
    std::vector<Note> notes;
    for (const size_t variant : variants.of_mesh(i)) {
      Mesh mesh = read_mesh(sources, model.meshes[i], i, variants.variant(variant, poses, source.skins),
                            so_far, notes);
      if (mesh.triangles.empty()) continue;
      check_triangle_limit(input, triangles += mesh.triangles.size());
      mesh_of[variant] = static_cast<uint32_t>(scene.meshes.size());
      scene.meshes.push_back(std::move(mesh));
    }
    add_new(std::move(notes), scene.notes);
  }
  note_what_is_shown(input, hierarchy, source.surfaces, so_far, scene);
  alpha.report().write(input, scene);
  drop_repeated(scene.files);  // pictures that are read for their colours and for their alpha

  NodeCollector nodes(model, hierarchy, source.moving);
  FlatMeshes flat(input, scene);
  LeftOut gone;
  for (size_t i = 0; i < placements.size(); ++i) {
    const GltfPlacement& placement = placements[i];
    if (mesh_of[variant_of[i]] == kAbsent) continue;
    // Not a copy: a node may have many instances, and a long name.
    const std::string_view node_name =
        placement.node == GltfHierarchy::kNone ? std::string_view() : model.nodes[placement.node].name;
    uint32_t mesh = mesh_of[variant_of[i]];
    Affine place = placement.place;
    if (is_flat(place)) {
      const std::optional<uint32_t> moved = flat.add(mesh, place);
      if (!moved) {
        gone.add(node_name.empty() ? std::string_view(scene.meshes[mesh].name) : node_name);
        continue;
      }
      if (*moved != mesh) place = {1, 0, 0, place[3], 0, 1, 0, place[7], 0, 0, 1, place[11]};
      mesh = *moved;
    }
    const uint32_t node = nodes.add(placement.node, scene.nodes);
    const bool moves = placement.skin >= 0 || (node != kNoNode && scene.nodes[node].moves);
    const bool deforms = placement.skin >= 0 || variants.morphs(placement.mesh);
    std::string name = node_name.empty()     ? scene.meshes[mesh].name
                       : placement.instanced ? short_name(node_name)
                                             : std::string(node_name);
    scene.instances.push_back(
        {std::move(name), mesh, *to_transform(place), node, moves, remainder_of(place), deforms});
  }
  gone.note(input, scene.notes);
  drop_unplaced(scene);
  forget_small_remainders(scene);
  return scene;
}

}  // namespace nif::mesh::detail
