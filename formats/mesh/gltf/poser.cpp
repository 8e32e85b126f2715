// Everything that a moment needs is read when a Poser is made, in the order in which the reader visits nodes, so that evaluating a
// moment is arithmetic alone, and any number of threads may do it.
#include "formats/mesh/poser.hpp"

#include <fmt/format.h>
#include <tiny_gltf.h>

#include <cmath>
#include <map>
#include <optional>

#include "formats/mesh/gltf/accessor.hpp"
#include "formats/mesh/gltf/clip.hpp"
#include "formats/mesh/gltf/gltf_hierarchy.hpp"
#include "formats/mesh/whole_file.hpp"

namespace nif::mesh {

using namespace detail;

class Poser::Work {
 public:
  Work(const std::filesystem::path& file, std::string_view bytes, const Scene& scene,
       const ReadLimits& limits)
      : input_(describe(file, bytes, limits)) {
    skip_byte_order_mark(input_);
    if (!limits.skins) input_.fail(Status::usage, "was read without skins, so its poses are not known");
    input_.limits.clips = true;
    if (is_gltf(input_))
      read_file(bytes, scene);
    else
      for (const Instance& instance : scene.instances) instances_.push_back(placed_at(instance));
    input_.bytes = {};  // they may be gone soon
  }

  const std::vector<Clip>& clips() const { return listed_; }

  std::vector<PosedInstance> at(const Moment& moment) const {
    const size_t number = number_of(input_, clips_, moment.clip);
    const Keyed& keyed = keyed_[number];
    if (keyed.error) throw *keyed.error;
    std::map<size_t, Moved> moved;
    for (const KeyedChannel& keys : keyed.channels) {
      const std::vector<double> value = value_at(input_, clips_[number], number, keys, moment.time);
      const size_t node = keys.channel.node;
      const auto [found, fresh] = moved.try_emplace(node);
      Moved& to = found->second;
      if (fresh) to.parts = nodes_[node].parts;
      switch (keys.channel.path) {
        case GltfChannel::Path::translation:
          std::copy_n(value.begin(), 3, to.parts.translation.begin());
          break;
        case GltfChannel::Path::rotation:
          std::copy_n(value.begin(), 4, to.parts.rotation.begin());
          break;
        case GltfChannel::Path::scale:
          std::copy_n(value.begin(), 3, to.parts.scale.begin());
          break;
        case GltfChannel::Path::weights:
          to.weights = value;
          continue;
      }
      to.placed = true;
    }
    return posed(moved);
  }

  std::vector<PosedInstance> rest() const {
    return input_.limits.moment ? at(*input_.limits.moment) : posed({});
  }

 private:
  static constexpr size_t kNone = GltfHierarchy::kNone;

  struct PosableNode {
    NodeParts parts;              // unless it has a matrix
    Affine local;                 // as the file has it
    std::vector<double> weights;  // of morph targets; empty: those of its mesh
    size_t parent = kNone;
  };
  /// What a clip changes of a node.
  struct Moved {
    NodeParts parts;
    bool placed = false;  // parts are changed
    std::optional<std::vector<double>> weights;
  };
  struct Keyed {
    std::vector<KeyedChannel> channels;
    std::optional<Error> error;  // instead of channels
  };
  struct Joint {
    size_t node;
    Affine inverse_bind;
  };
  struct Placed {
    Affine place;                  // in the scene
    size_t node = kNone;           // that moves it
    std::optional<Affine> offset;  // from the node to the instance; nothing: only the origin moves
    const std::vector<Joint>* joints = nullptr;
    std::vector<float> weights;  // [target] of its mesh
  };

  static Affine place_of(const Instance& instance) {
    Affine place;
    for (size_t i = 0; i < place.size(); ++i) place[i] = double{instance.transform[i]};
    for (size_t a = 0; a < 3; ++a) place[4 * a + 3] += instance.remainder[a];
    return place;
  }
  static Placed placed_at(const Instance& instance) {
    Placed placed;
    placed.place = place_of(instance);
    return placed;
  }

  void read_file(std::string_view bytes, const Scene& scene) {
    std::vector<ExternalFile> external;
    const GltfSource source = open_gltf(input_, external);
    if (source_hash(input_, bytes, external) != scene.source_hash)
      input_.fail(Status::mesh_mismatch, "is not the file that the scene was read from");
    tinygltf::Model model = parse_model(input_, source.json);
    const GltfData data(input_, source, model);
    clips_ = source.clips;
    std::vector<Note> notes;  // the scene has them
    listed_ = describe_clips(input_, data, clips_, notes);
    read_keys(data, model);
    for (const tinygltf::Node& node : model.nodes)
      nodes_.push_back({parts_of(node).value_or(NodeParts()), local_transform(node), node.weights});
    if (input_.limits.moment) pose_nodes(input_, data, clips_, *input_.limits.moment, model);

    std::vector<std::optional<Affine>> worlds(nodes_.size());
    GltfNaming naming = name_things(input_, model, source.surfaces);
    const GltfHierarchy hierarchy =
        flatten(input_, model, naming, [&](size_t node, const Affine& world, bool) {
          order_.push_back(node);
          worlds[node] = world;
        });
    for (const size_t node : order_) nodes_[node].parent = hierarchy.parents[node];
    for (const Mesh& mesh : scene.meshes)
      if (mesh.skin && mesh.skin->influences > 0) read_joints(data, source.skins, *mesh.skin, worlds);
    for (const Instance& instance : scene.instances) add_instance(instance, scene, worlds);
    rests_ = std::move(worlds);
  }

  void read_keys(const GltfData& data, const tinygltf::Model& model) {
    ClipKeys keys(input_, data);
    for (const GltfClip& clip : clips_) {
      Keyed& keyed = keyed_.emplace_back();
      try {
        keyed.channels = keys.channels(clip, keyed_.size() - 1, model);
      } catch (const Error& error) {
        keyed.error = error;
      }
    }
  }

  [[noreturn]] void fail_mismatch(const std::string& what) const {
    input_.fail(Status::mesh_mismatch, fmt::format("has no {}, which the scene has", what));
  }

  void read_joints(const GltfData& data, const std::vector<GltfSkin>& skins, const Skin& skin,
                   const std::vector<std::optional<Affine>>& worlds) {
    const auto [at, fresh] = joints_.try_emplace(skin.number);
    if (!fresh) return;
    if (skin.number >= skins.size() || skins[skin.number].joints.size() != skin.joint_count)
      fail_mismatch(fmt::format("skin {} of {} joints", skin.number, skin.joint_count));
    const GltfSkin& described = skins[skin.number];
    std::vector<Affine> inverses(described.joints.size(), kUnmoved);
    if (described.inverse_bind_matrices >= 0)
      inverses = data.matrices(described.inverse_bind_matrices, described.joints.size());
    for (size_t i = 0; i < described.joints.size(); ++i) {
      const size_t node = described.joints[i];
      if (i >= inverses.size() || node >= worlds.size() || !worlds[node])
        fail_mismatch(fmt::format("joint {} of skin {}", i, skin.number));
      at->second.push_back({node, inverses[i]});
    }
  }

  void add_instance(const Instance& instance, const Scene& scene,
                    const std::vector<std::optional<Affine>>& worlds) {
    Placed placed = placed_at(instance);
    const Skin* skin = scene.meshes[instance.mesh].skin.get();
    if (skin) placed.weights = skin->rest_weights;
    if (instance.node != kNoNode) {
      placed.node = scene.nodes[instance.node].number;
      if (placed.node >= worlds.size() || !worlds[placed.node])
        fail_mismatch(fmt::format("node {}", placed.node));
      const Affine& rest = *worlds[placed.node];
      if (to_transform(rest) == instance.transform)
        placed.offset = kUnmoved;
      else if (const std::optional<Affine> back = inverse(rest))
        placed.offset = multiply(*back, placed.place);
    }
    if (skin && skin->influences > 0) {
      placed.joints = &joints_.at(skin->number);
      if (!inverse(placed.place))
        fail_mismatch(fmt::format("place of '{}' that has an inverse", instance.name));
    }
    instances_.push_back(std::move(placed));
  }

  std::vector<PosedInstance> posed(const std::map<size_t, Moved>& moved) const {
    std::vector<Affine> worlds(nodes_.size(), kUnmoved);
    for (const size_t node : order_) {
      const auto found = moved.find(node);
      const Affine& still = nodes_[node].local;
      const Affine local =
          found != moved.end() && found->second.placed ? found->second.parts.transform() : still;
      const size_t parent = nodes_[node].parent;
      worlds[node] = multiply(parent == kNone ? kUnmoved : worlds[parent], local);
    }
    std::vector<PosedInstance> all;
    for (const Placed& placed : instances_) {
      PosedInstance& instance = all.emplace_back();
      instance.transform = placed.place;
      if (placed.joints)
        instance.joints = joints_of(placed, worlds);
      else if (placed.node != kNone)
        instance.transform = moved_with(placed, worlds[placed.node]);
      instance.weights = weights_of(placed, moved);
    }
    return all;
  }

  Affine moved_with(const Placed& placed, const Affine& world) const {
    Affine place = placed.place;
    for (const size_t i : {3, 7, 11}) place[i] += world[i] - (*rests_[placed.node])[i];
    if (placed.offset) place = multiply(world, *placed.offset);
    if (!to_transform(place))
      input_.fail(Status::malformed_mesh, fmt::format("node {} is placed at infinity", placed.node));
    return place;
  }

  std::vector<JointMatrix> joints_of(const Placed& placed, const std::vector<Affine>& worlds) const {
    const Affine to_object = *inverse(placed.place);
    std::vector<JointMatrix> joints;
    for (const Joint& joint : *placed.joints) {
      const std::optional<Transform> rounded =
          to_transform(multiply(to_object, multiply(worlds[joint.node], joint.inverse_bind)));
      if (!rounded)
        input_.fail(Status::malformed_mesh, fmt::format("joint {} is placed at infinity", joint.node));
      joints.push_back(*rounded);
    }
    return joints;
  }

  std::vector<float> weights_of(const Placed& placed, const std::map<size_t, Moved>& moved) const {
    std::vector<float> weights = placed.weights;
    if (weights.empty() || placed.node == kNone) return weights;
    const auto found = moved.find(placed.node);
    const std::vector<double>& own =
        found != moved.end() && found->second.weights ? *found->second.weights : nodes_[placed.node].weights;
    if (own.empty()) return weights;
    for (size_t t = 0; t < weights.size(); ++t) {
      weights[t] = t < own.size() ? static_cast<float>(own[t]) : 0;
      if (!std::isfinite(weights[t]))
        input_.fail(Status::malformed_mesh, fmt::format("node {} has the weight {}", placed.node, own[t]));
    }
    return weights;
  }

  Input input_;
  std::vector<GltfClip> clips_;  // of the file
  std::vector<Clip> listed_;
  std::vector<Keyed> keyed_;                       // [clip of the file]
  std::vector<PosableNode> nodes_;                 // of the file
  std::vector<size_t> order_;                      // nodes of the scene, parents first
  std::vector<std::optional<Affine>> rests_;       // [node] where it was when the scene was read
  std::map<uint32_t, std::vector<Joint>> joints_;  // by number of the skin
  std::vector<Placed> instances_;
};

Poser::Poser(const std::filesystem::path& file, const Scene& scene, const ReadLimits& limits)
    : work_(promised(file, [&] {
        const ByteBuffer bytes = load_unpacked(file, limits);
        return std::make_unique<const Work>(file, bytes.view(), scene, limits);
      })) {}
Poser::Poser(const std::filesystem::path& file, std::string_view bytes, const Scene& scene,
             const ReadLimits& limits)
    : work_(promised(file, [&] { return std::make_unique<const Work>(file, bytes, scene, limits); })) {}
Poser::Poser(Poser&&) noexcept = default;
Poser& Poser::operator=(Poser&&) noexcept = default;
Poser::~Poser() = default;

const std::vector<Clip>& Poser::clips() const { return work_->clips(); }
std::vector<PosedInstance> Poser::at(const Moment& moment) const { return work_->at(moment); }
std::vector<PosedInstance> Poser::rest() const { return work_->rest(); }

}  // namespace nif::mesh
