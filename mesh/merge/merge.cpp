// The order of steps: find instances that may merge, select those whose copies fit the budget (small meshes
// first), separate what moves differently, cut by space until groups are small enough, check memory, then
// copy.
#include "mesh/merge/merge.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <numeric>
#include <span>
#include <tuple>

#include "formats/base/glob.hpp"
#include "formats/base/memory.hpp"
#include "formats/base/vector.hpp"
#include "formats/mesh/alike.hpp"
#include "formats/mesh/box.hpp"
#include "formats/mesh/flat_scene.hpp"
#include "formats/mesh/skin.hpp"
#include "formats/mesh/transform.hpp"

namespace nif::mesh {
namespace {

/// Finds the nodes whose name, or the name of a node above them, matches a list.
class NamedNodes {
 public:
  NamedNodes(const std::vector<std::string>& names, std::span<const Node> nodes)
      : names_(names), used_(names.size()) {
    for (const Node& node : nodes)  // parents come before their children
      named_.push_back(has(node.name) || (node.parent != kNoNode && named_[node.parent]));
  }

  /// An instance whose node has no name goes by the name of its mesh.
  bool has(const Instance& instance) {
    const bool by_node = instance.node != kNoNode && named_[instance.node];
    return has(instance.name) || by_node;
  }

  void list_unused(std::vector<std::string>& unused) const {
    for (size_t i = 0; i < names_.size(); ++i)
      if (!used_[i]) unused.push_back(names_[i]);
  }

 private:
  bool has(const std::string& name) {
    bool any = false;
    for (size_t i = 0; i < names_.size(); ++i) {
      if (!fits(name, names_[i])) continue;
      used_[i] = any = true;  // marks every pattern that matches as used
    }
    return any;
  }

  const std::vector<std::string>& names_;
  std::vector<bool> used_, named_;
};

/// The cost of a mesh, in triangles: it may have more vertices than its triangles use.
uint64_t weight_of(const Mesh& mesh) {
  return std::max<uint64_t>(mesh.triangles.size(), (mesh.positions.size() + 2) / 3);
}

/// Whether rounding would deform an instance because it is far from the origin for its size: this limit keeps
/// corners within 1/4096 of the size. Also refuses what bake::prepare() does not accept.
bool is_too_far(const Box& box) {
  constexpr float kLargest = 1e14f, kSmallest = 1e-12f, kParts = 4096;
  const float side = box.longest_side();
  float reach = 0;
  for (size_t a = 0; a < 3; ++a) {
    if (!std::isfinite(box.min[a]) || !std::isfinite(box.max[a])) return true;
    reach = std::max({reach, std::abs(box.min[a]), std::abs(box.max[a])});
  }
  return !(reach <= kLargest && side >= kSmallest && side >= reach / kParts);
}

/// Where an instance is in the space of another one, whose transform must have an inverse.
Instance relative(const Instance& instance, const Instance& to) {
  Instance moved = instance;
  moved.transform = kIdentity, moved.remainder = {};
  if (instance.transform == to.transform && instance.remainder == to.remainder) return moved;
  const auto inverse = inverse_rows(to.transform), rows = rows_of(instance.transform);
  const auto origin = [](const Instance& placed) {
    const Transform& t = placed.transform;
    return Double3{t[3], t[7], t[11]} + placed.remainder;
  };
  const Double3 translation = product(inverse, origin(instance) - origin(to));
  for (size_t row = 0; row < 3; ++row) {
    for (size_t k = 0; k < 3; ++k) {
      double sum = 0;
      for (size_t j = 0; j < 3; ++j) sum += inverse[row][j] * rows[j][k];
      moved.transform[4 * row + k] = float(sum);
    }
    moved.transform[4 * row + 3] = float(translation[row]);
    moved.remainder[row] = translation[row] - double(moved.transform[4 * row + 3]);
  }
  return moved;
}

/// Instances with the same frame never move against each other: kStill, or the number of the node that moves
/// them all.
using Frame = uint32_t;
constexpr Frame kStill = kNoNode;

/// A mesh that bends, or that a joint carries.
struct BentPart {
  const Mesh* mesh;
  std::optional<uint16_t> carrier;  ///< the joint that moves it, and nothing else does
};

/// What bends several meshes together, one after the other. Those that bend, at least one, must have one skin.
std::shared_ptr<const Skin> joined(std::span<const BentPart> parts) {
  const auto bends = [](const BentPart& part) { return !part.carrier; };
  Skin all = *std::ranges::find_if(parts, bends)->mesh->skin;
  all.joints.clear(), all.weights.clear();
  for (const BentPart& part : parts)
    if (bends(part)) all.influences = std::max(all.influences, part.mesh->skin->influences);
  for (const BentPart& part : parts) {
    for (size_t v = 0; v < part.mesh->positions.size(); ++v) {
      if (part.carrier) {
        all.joints.push_back(*part.carrier);
        all.weights.push_back(1);
      } else {
        const Skin& skin = *part.mesh->skin;
        const auto from = std::ptrdiff_t(v * skin.influences), to = from + std::ptrdiff_t(skin.influences);
        all.joints.insert(all.joints.end(), skin.joints.begin() + from, skin.joints.begin() + to);
        all.weights.insert(all.weights.end(), skin.weights.begin() + from, skin.weights.begin() + to);
      }
      const size_t unused = all.influences - (part.carrier ? 1 : part.mesh->skin->influences);
      all.joints.insert(all.joints.end(), unused, uint16_t{0});
      all.weights.insert(all.weights.end(), unused, 0.0f);
    }
  }
  return std::make_shared<const Skin>(std::move(all));
}

class Merger {
 public:
  Merger(Scene scene, const MergeOptions& options) : scene_(std::move(scene)), options_(options) {
    merging_.options = options;
    merging_.instances = scene_.instances.size();
    for (const Mesh& mesh : scene_.meshes) {
      boxes_.push_back(bounds(mesh.positions, mesh.triangles));
      weights_.push_back(weight_of(mesh));
    }
    firsts_ = first_alike(scene_.meshes);
    placed_.resize(scene_.meshes.size());
    for (const Instance& instance : scene_.instances) ++placed_[firsts_[instance.mesh]];
    for (const Node& node : scene_.nodes)  // parents come before their children
      frames_.push_back(node.moves_itself        ? Frame(frames_.size())
                        : node.parent == kNoNode ? kStill
                                                 : frames_[node.parent]);
    places_.resize(scene_.instances.size());
  }

  Scene run() {
    std::vector<uint32_t> rigid = named_and_rigid();
    find_bent();
    attach_carried(rigid);
    std::vector<std::vector<uint32_t>> groups = grouped(chosen(rigid));
    for (std::vector<uint32_t>& group : skinned()) groups.push_back(std::move(group));
    require_room(groups);
    build(groups);
    return std::move(scene_);
  }

 private:
  /// What bends together.
  struct Bent {
    std::vector<uint32_t> bending, carried;  // instances
    uint64_t weight = 0;                     // of both
  };
  /// What a joint carries.
  struct Carried {
    Bent* by;
    uint16_t joint;
    const std::array<double, 12>* to_bound;
  };

  void keep(Stays why, uint64_t count = 1) { merging_.stay[size_t(why)] += count; }

  Frame frame_of(const Instance& instance) const {
    return instance.node == kNoNode ? kStill : frames_[instance.node];
  }

  /// The instances that names, movement and transforms allow to merge, in order.
  std::vector<uint32_t> named_and_rigid() {
    NamedNodes named(options_.nodes, scene_.nodes), excepted(options_.except, scene_.nodes);
    std::vector<uint32_t> rigid;
    for (uint32_t i = 0; i < scene_.instances.size(); ++i) {
      const Instance& instance = scene_.instances[i];
      const bool in = named.has(instance), out = excepted.has(instance);
      if (out || (!in && !options_.nodes.empty()))
        keep(Stays::not_named);
      else if (instance.deforms && joins_by_skin(instance))
        by_skin_.push_back(i);
      else if (instance.deforms)
        keep(Stays::deforms);
      else if (instance.moves && frame_of(instance) == kStill)
        keep(Stays::moves);
      else if (flattens(instance.transform))
        keep(Stays::flattened);
      else
        rigid.push_back(i);
    }
    named.list_unused(merging_.unmatched);
    excepted.list_unused(merging_.unmatched);
    return rigid;
  }

  /// Whether the instance may merge with others of its skin. With holes the whole would not bend (bake::prepare_objects()).
  bool joins_by_skin(const Instance& instance) const {
    const mesh::Mesh& mesh = scene_.meshes[instance.mesh];
    return options_.skins && mesh.skin && mesh.skin->influences > 0 && mesh.skin->targets.empty() &&
           mesh.holes.empty();
  }

  /// Collects what bends, by skin and place. Sets places.
  void find_bent() {
    std::vector<uint32_t> uses(scene_.meshes.size());
    for (const Instance& instance : scene_.instances) ++uses[instance.mesh];
    for (const uint32_t i : by_skin_) {
      const Instance& instance = scene_.instances[i];
      const Skin& skin = *scene_.meshes[instance.mesh].skin;
      places_[i] = boxes_[instance.mesh];
      if (weights_[instance.mesh] >= options_.object_triangles)
        keep(Stays::too_large);
      else if (is_too_far(places_[i]))
        keep(Stays::too_far);
      else if (uses[instance.mesh] > 1)
        keep(Stays::deforms);
      else
        bent_[{skin.number, skin.joint_count, instance.transform, instance.remainder}].bending.push_back(i);
    }
  }

  /// The joint of a skin that carries an instance: the nearest node above it, without one between that moves by itself.
  std::optional<Carried> carrier_of(const Instance& instance,
                                    const std::map<uint32_t, std::optional<Carried>>& joints) const {
    for (uint32_t node = instance.node; node != kNoNode; node = scene_.nodes[node].parent) {
      const auto joint = joints.find(scene_.nodes[node].number);
      if (joint != joints.end()) return joint->second;
      if (scene_.nodes[node].moves_itself) break;
    }
    return std::nullopt;
  }

  /// Moves what joints carry from `rigid` to what bends, unless that gets too large. Sets places.
  void attach_carried(std::vector<uint32_t>& rigid) {
    if (!options_.carried) return;
    std::map<uint32_t, std::optional<Carried>> joints;  // by number of the node; nothing: it cannot carry
    for (auto& [key, bent] : bent_) {
      for (const uint32_t i : bent.bending) bent.weight += weight(i);
      const auto skin = std::ranges::find(scene_.skins, std::get<0>(key), &SkinJoints::number);
      if (skin == scene_.skins.end()) continue;
      for (size_t k = 0; k < skin->joints.size(); ++k) {
        const bool usable = skin->joints[k].to_bound && k <= std::numeric_limits<uint16_t>::max();
        joints.try_emplace(
            skin->joints[k].node,
            usable ? std::optional(Carried{&bent, uint16_t(k), &*skin->joints[k].to_bound}) : std::nullopt);
      }
    }
    for (const uint32_t i : rigid) {
      const Instance& instance = scene_.instances[i];
      const bool copied = placed_[firsts_[instance.mesh]] > 1;
      if ((copied && weight(i) >= options_.part_triangles) || !scene_.meshes[instance.mesh].holes.empty())
        continue;
      const std::optional<Carried> carried = carrier_of(instance, joints);
      if (!carried) continue;
      const Box place = bounds(boxes_[instance.mesh], bound(instance, *carried->to_bound).transform);
      if (is_too_far(place)) continue;
      places_[i] = place;
      carried_.emplace(i, *carried);
      carried->by->carried.push_back(i);
      carried->by->weight += weight(i);
    }
    for (auto& [key, bent] : bent_) {
      if (bent.weight <= options_.object_triangles) continue;
      for (const uint32_t i : bent.carried) carried_.erase(i);
      bent.carried.clear();
    }
    std::erase_if(rigid, [&](uint32_t i) { return carried_.contains(i); });
  }

  /// Where an instance is in the space in which the meshes of a skin are bound.
  static Instance bound(const Instance& instance, const std::array<double, 12>& to_bound) {
    Instance part = instance;
    const auto rows = rows_of(instance.transform);
    const Transform& t = instance.transform;
    const Double3 origin = Double3{t[3], t[7], t[11]} + instance.remainder;
    for (size_t row = 0; row < 3; ++row) {
      double at = to_bound[4 * row + 3];
      for (size_t k = 0; k < 3; ++k) {
        double sum = 0;
        for (size_t j = 0; j < 3; ++j) sum += to_bound[4 * row + j] * rows[j][k];
        part.transform[4 * row + k] = float(sum);
        at += to_bound[4 * row + k] * origin[k];
      }
      part.transform[4 * row + 3] = float(at);
      part.remainder[row] = lost_to_float(at);
    }
    return part;
  }

  /// Groups of at least two instances that bend together, each in the order of the scene.
  std::vector<std::vector<uint32_t>> skinned() {
    std::vector<std::vector<uint32_t>> groups;
    for (auto& [key, bent] : bent_) {
      std::vector<uint32_t> instances = std::move(bent.bending);
      instances.insert(instances.end(), bent.carried.begin(), bent.carried.end());
      for (std::vector<uint32_t>& group : by_space(std::move(instances), Stays::deforms))
        groups.push_back(std::move(group));
    }
    return groups;
  }

  /// Why a mesh as large and as often placed as this stays, if it does.
  std::optional<Stays> too_much(uint32_t mesh) const {
    const bool once = placed_[firsts_[mesh]] == 1;
    if (weights_[mesh] >= options_.object_triangles) return Stays::too_large;
    if (!once && options_.added_triangles == 0u) return Stays::over_budget;
    if (!once && weights_[mesh] >= options_.part_triangles) return Stays::large_copy;
    return std::nullopt;
  }

  /// Of rigid instances those that may merge, in order. Sets their places.
  std::vector<uint32_t> suited(const std::vector<uint32_t>& rigid) {
    std::map<Frame, size_t> together;
    for (const uint32_t i : rigid) {
      const Instance& instance = scene_.instances[i];
      if (too_much(instance.mesh)) continue;
      ++together[frame_of(instance)];
      spaces_.try_emplace(frame_of(instance), frame_of(instance) == kStill ? Instance{} : instance);
    }
    std::vector<uint32_t> suited;
    for (const uint32_t i : rigid) {
      const Instance& instance = scene_.instances[i];
      const Frame frame = frame_of(instance);
      if (const std::optional<Stays> why = too_much(instance.mesh)) {
        keep(*why);
        continue;
      }
      places_[i] = bounds(boxes_[instance.mesh], in_frame(instance).transform);
      if (frame != kStill && together[frame] == 1)
        keep(Stays::moves);
      else if (is_too_far(places_[i]))
        keep(Stays::too_far);
      else
        suited.push_back(i);
    }
    return suited;
  }

  /// The instance in the space of the merged object that it may become a part of.
  Instance in_frame(const Instance& instance) const {
    const Frame frame = frame_of(instance);
    return frame == kStill ? instance : relative(instance, spaces_.at(frame));
  }

  /// Of rigid instances those that merge if others do, in order.
  std::vector<uint32_t> chosen(const std::vector<uint32_t>& rigid) {
    const auto stay = merging_.stay;
    std::vector<uint32_t> all = suited(rigid);
    if (!options_.added_triangles) {
      options_.added_triangles = budget_for(all);
      // As if that had been asked for, because what comes of it must be what comes of the options that a file keeps: what is
      // not copied has no part in the choice of the spaces.
      if (options_.added_triangles == 0u) {
        merging_.stay = stay;
        spaces_.clear();
        all = suited(rigid);
      }
      merging_.options.added_triangles = options_.added_triangles;
    }
    return within_budget(all);
  }

  /// How many of these instances a mesh has.
  std::vector<uint64_t> counts_of(const std::vector<uint32_t>& suited) const {
    std::vector<uint64_t> counts(scene_.meshes.size());
    for (const uint32_t i : suited) ++counts[firsts_[scene_.instances[i].mesh]];
    return counts;
  }
  /// Triangles that merging so many instances of a mesh adds. The mesh itself is dropped if all of its instances merge.
  uint64_t added_by(uint32_t mesh, uint64_t instances) const {
    return weights_[mesh] * (instances - (instances > 0 && instances == placed_[mesh] ? 1 : 0));
  }

  /// The default: all copies or none.
  uint64_t budget_for(const std::vector<uint32_t>& suited) const {
    const std::vector<uint64_t> counts = counts_of(suited);
    uint64_t wanted = 0, once = 0;
    for (uint32_t m = 0; m < counts.size(); ++m) {
      wanted += added_by(m, counts[m]);
      if (counts[m] == 1 && placed_[m] == 1) once += weights_[m];
    }
    const uint64_t most = options_.few_copies ? once / kTrianglesForAdded : kAddedTriangles;
    return wanted <= most ? most : 0;
  }

  /// The instances whose copies fit the budget, in order.
  std::vector<uint32_t> within_budget(const std::vector<uint32_t>& suited) {
    const std::vector<uint64_t> merging = counts_of(suited);
    std::vector<uint32_t> meshes;
    for (uint32_t m = 0; m < scene_.meshes.size(); ++m)
      if (merging[m] > 0) meshes.push_back(m);
    std::ranges::stable_sort(meshes, {}, [&](uint32_t m) { return weights_[m]; });
    std::vector<bool> fits(scene_.meshes.size());
    for (const uint32_t m : meshes) {
      const uint64_t added = added_by(m, merging[m]);
      fits[m] = added <= *options_.added_triangles - merging_.added_triangles;
      if (fits[m])
        merging_.added_triangles += added;
      else
        keep(Stays::over_budget, merging[m]);
    }
    std::vector<uint32_t> chosen;
    for (const uint32_t i : suited)
      if (fits[firsts_[scene_.instances[i].mesh]]) chosen.push_back(i);
    return chosen;
  }

  /// Groups of at least two instances that may be one mesh each, each in the order of the scene.
  std::vector<std::vector<uint32_t>> grouped(const std::vector<uint32_t>& chosen) {
    std::map<Frame, std::vector<uint32_t>> together;
    for (const uint32_t i : chosen) together[frame_of(scene_.instances[i])].push_back(i);
    std::vector<std::vector<uint32_t>> groups;
    for (auto& [frame, instances] : together) {
      const Stays single = frame == kStill ? Stays::alone : Stays::moves;
      for (std::vector<uint32_t>& group : by_space(std::move(instances), single))
        groups.push_back(std::move(group));
    }
    return groups;
  }

  double centre(uint32_t instance, size_t axis) const {
    return double(places_[instance].min[axis]) + double(places_[instance].max[axis]);
  }
  uint64_t weight(uint32_t instance) const { return weights_[scene_.instances[instance].mesh]; }

  size_t longest_axis(std::span<const uint32_t> part) const {
    Double3 sides;
    for (size_t a = 0; a < 3; ++a) {
      const auto [low, high] = std::ranges::minmax(part, {}, [&](uint32_t i) { return centre(i, a); });
      sides[a] = centre(high, a) - centre(low, a);
    }
    return size_t(std::ranges::max_element(sides) - sides.begin());
  }

  /// Sorts a part along its longest axis and returns where to cut it: where both sides are short for their
  /// triangles, so that groups are separated by gaps, but near the middle, so that few cuts suffice. No side
  /// is empty.
  size_t cut(std::span<uint32_t> part, uint64_t total) const {
    const size_t axis = longest_axis(part), last = part.size() - 1;
    std::ranges::sort(part, {}, [&](uint32_t i) { return std::pair(centre(i, axis), i); });
    const auto distance = [&](size_t from, size_t to) {
      return centre(part[to], axis) - centre(part[from], axis);
    };
    std::tuple best(true, 0.0, total, size_t{0});  // off the middle, cost, imbalance, position
    uint64_t left = 0;
    for (size_t at = 1; at <= last; ++at) {
      left += weight(part[at - 1]);
      const uint64_t right = total - left;
      const bool off = std::min(left, right) < total / 4;
      const double cost = double(left) * distance(0, at - 1) + double(right) * distance(at, last);
      const std::tuple here(off, off ? 0.0 : cost, std::max(left, right) - std::min(left, right), at);
      if (at == 1 || here < best) best = here;
    }
    return std::get<3>(best);
  }

  /// Cuts instances into groups. Counts those that are left alone as `single`.
  std::vector<std::vector<uint32_t>> by_space(std::vector<uint32_t> instances, Stays single) {
    std::vector<std::vector<uint32_t>> groups;
    std::vector<std::span<uint32_t>> open;
    if (!instances.empty()) open.emplace_back(instances);
    while (!open.empty()) {
      const std::span<uint32_t> part = open.back();
      open.pop_back();
      uint64_t total = 0;
      for (const uint32_t i : part) total += weight(i);
      if (part.size() == 1) {
        keep(single);
      } else if (total <= options_.object_triangles) {
        std::ranges::sort(part);
        groups.emplace_back(part.begin(), part.end());
      } else {
        const size_t middle = cut(part, total);
        open.push_back(part.subspan(middle));
        open.push_back(part.first(middle));
      }
    }
    return groups;
  }

  /// Checks memory before anything is copied, because the budget may be any number.
  void require_room(const std::vector<std::vector<uint32_t>>& groups) const {
    uint64_t bytes = 0;
    for (const std::vector<uint32_t>& group : groups)
      for (const uint32_t i : group) {
        const Mesh& mesh = scene_.meshes[scene_.instances[i].mesh];
        bytes += mesh.positions.size() * sizeof(Float3) + mesh.triangles.size() * sizeof(Triangle);
      }
    require_memory(bytes, "merging");
  }

  float middle_side(const std::vector<uint32_t>& group) const {
    std::vector<float> sides;
    for (const uint32_t i : group) sides.push_back(places_[i].longest_side());
    const auto middle = sides.begin() + std::ptrdiff_t(sides.size() / 2);
    std::nth_element(sides.begin(), middle, sides.end());
    return *middle;
  }

  /// An instance as a part of a group's mesh: what bends keeps its own space.
  Instance as_part(uint32_t i) const {
    const Instance& instance = scene_.instances[i];
    if (const auto carried = carried_.find(i); carried != carried_.end())
      return bound(instance, *carried->second.to_bound);
    if (!instance.deforms) return in_frame(instance);
    Instance part = instance;
    part.transform = kIdentity, part.remainder = {};
    return part;
  }

  /// The first of a group that bends, or its first.
  const Instance& host_of(const std::vector<uint32_t>& group) const {
    for (const uint32_t i : group)
      if (scene_.instances[i].deforms) return scene_.instances[i];
    return scene_.instances[group.front()];
  }

  /// How the mesh of a group bends; null if it does not.
  std::shared_ptr<const Skin> skin_of(const std::vector<uint32_t>& group) const {
    if (!host_of(group).deforms) return nullptr;
    std::vector<BentPart> parts;
    for (const uint32_t i : group) {
      const auto carried = carried_.find(i);
      parts.push_back({&scene_.meshes[scene_.instances[i].mesh], {}});
      if (carried != carried_.end()) parts.back().carrier = carried->second.joint;
    }
    return joined(parts);
  }

  void build(const std::vector<std::vector<uint32_t>>& groups) {
    std::vector<Mesh> merged;
    std::vector<bool> gone(scene_.instances.size());
    for (const std::vector<uint32_t>& group : groups) {
      std::vector<Instance> parts;
      MergedInstance& record = merging_.merged.emplace_back();
      for (const uint32_t i : group) {
        gone[i] = true;
        const Instance& part = parts.emplace_back(as_part(i));
        record.parts.push_back({i, part.name, part.node, scene_.meshes[part.mesh].triangles.size()});
      }
      merged.push_back(flatten(FlatScene(scene_.meshes, parts), fmt::format("merged {}", merged.size() + 1)));
      merged.back().part_side = middle_side(group);
      merged.back().skin = skin_of(group);
    }
    std::vector<Instance> places;
    for (const std::vector<uint32_t>& group : groups) {
      const Instance& first = host_of(group);
      const Frame frame = frame_of(first);
      places.push_back(first.deforms ? first : frame == kStill ? Instance{} : spaces_.at(frame));
    }
    drop(gone);
    for (size_t k = 0; k < merged.size(); ++k) {
      merging_.merged[k].instance = uint32_t(scene_.instances.size());
      Instance& instance = scene_.instances.emplace_back(std::move(places[k]));
      instance.name = merged[k].name, instance.mesh = uint32_t(scene_.meshes.size());
      scene_.meshes.push_back(std::move(merged[k]));
    }
    scene_.merging = std::move(merging_);
  }

  /// Drops instances, and the meshes that no other instance uses.
  void drop(const std::vector<bool>& gone) {
    std::vector<Instance> instances;
    for (size_t i = 0; i < gone.size(); ++i)
      if (!gone[i]) instances.push_back(std::move(scene_.instances[i]));
    std::vector<bool> placed(scene_.meshes.size());
    for (const Instance& instance : instances) placed[instance.mesh] = true;
    std::vector<uint32_t> moved_to(placed.size());
    std::vector<Mesh> meshes;
    for (size_t m = 0; m < placed.size(); ++m) {
      moved_to[m] = uint32_t(meshes.size());
      if (placed[m]) meshes.push_back(std::move(scene_.meshes[m]));
    }
    for (Instance& instance : instances) instance.mesh = moved_to[instance.mesh];
    scene_.instances = std::move(instances);
    scene_.meshes = std::move(meshes);
  }

  Scene scene_;
  MergeOptions options_;
  Merging merging_;
  std::vector<Box> boxes_;            // [mesh]
  std::vector<uint64_t> weights_;     // [mesh]
  std::vector<uint32_t> firsts_;      // [mesh], the first equal one
  std::vector<uint64_t> placed_;      // [mesh], how often it and its equals are placed, for the first
  std::vector<Frame> frames_;         // [node]
  std::map<Frame, Instance> spaces_;  // for each frame that moves: the instance whose space its objects have
  std::vector<Box> places_;           // [instance], its bounds in the space of the merged object
  std::vector<uint32_t> by_skin_;     // instances that may merge with others of their skin
  /// By skin, its joints, and where the instances are.
  std::map<std::tuple<uint32_t, uint32_t, Transform, Double3>, Bent> bent_;
  std::map<uint32_t, Carried> carried_;  // by instance
};

}  // namespace

Scene merge(Scene scene, const MergeOptions& options) { return Merger(std::move(scene), options).run(); }

MergeOptions few_copies() {
  MergeOptions options;
  options.few_copies = true;
  options.part_triangles = kPartTriangles;
  options.object_triangles = kObjectTriangles;
  return options;
}

}  // namespace nif::mesh
