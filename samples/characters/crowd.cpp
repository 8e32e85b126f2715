#include "crowd.hpp"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>

using nlohmann::json;

namespace {

/// A number in 0 .. 1 that depends only on the argument.
float random_of(uint32_t number) {
  number = (number ^ number >> 16) * 0x7feb352du;
  number = (number ^ number >> 15) * 0x846ca68bu;
  return float((number ^ number >> 16) >> 8) / (1 << 24);
}

Transform transform_of(const NifAssetInstanceInfo& info) {
  Transform transform;
  std::copy_n(info.transform, 12, transform.begin());
  return transform;
}

}  // namespace

double thread_seconds() {
  timespec time;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return double(time.tv_sec) + 1e-9 * double(time.tv_nsec);
}

Crowd::Crowd(const nifkit::Device& device, const CrowdOptions& options)
    : rig_(Gltf(options.character_mesh), options.clip),
      place_(nifkit::Asset::load(device, options.place)),
      asset_(nifkit::Asset::load(device, options.character)),
      scene_(device),
      bones_(rig_.node_count()),
      world_(rig_.node_count()),
      x_(options.x),
      z_(options.z),
      speed_(options.speed) {
  read_parts(Gltf(options.character_mesh), options);
  const auto [first, count] = scene_.add_asset(place_);
  set_biases(place_, first, count);
  for (uint32_t i = first; i < first + count; ++i) scene_.set_instance_mask(i, kGroundMask);
  scene_.commit();
  const float top = scene_.info().bounds_max[1] + 1;
  first_character_ = count;
  for (uint32_t k = 0; k < options.count; ++k) {
    // Three lanes, and places that do not look counted.
    Member& member = members_.emplace_back();
    member.angle = 6.2831853f * (float(k) + 0.5f * random_of(2 * k)) / float(options.count);
    member.radius = options.radius + 0.17f * options.radius * (float(k % 3) - 1);
    member.phase = rig_.seconds() * random_of(2 * k + 1);
    member.height = ground_below(x_ + member.radius * std::cos(member.angle), top,
                                 z_ + member.radius * std::sin(member.angle));
  }
  for (Member& member : members_) {
    const nifkit::AddedInstances added = scene_.add_asset(asset_);
    set_biases(asset_, added.first, added.count);
    for (uint32_t i = 0; i < added.count; ++i) {
      scene_.set_instance_mask(added.first + i, kCharacterMask);
      if (hidden_[i]) scene_.set_instance_flags(added.first + i, NIF_INSTANCE_DISABLED);
    }
    member.first = added.first;
  }
  scene_.commit();
  scene_bytes_at_rest_ = scene_.info().resident_bytes;
}

/// What moves each instance of the character's file, and which glTF meshes it has: the asset's metadata says it. Like the
/// glTF, it comes from an artist whom you know: metadata is shown, not checked, by the library.
void Crowd::read_parts(const Gltf& file, const CrowdOptions& options) {
  const json metadata = json::parse(asset_.metadata());
  const json& hierarchy = metadata.at("hierarchy").at("instances");
  const json& document = file.document();
  std::vector<std::vector<size_t>> nodes;
  for (uint32_t i = 0; i < asset_.info().instance_count; ++i) {
    const NifAssetInstanceInfo info = asset_.instance(i);
    const NifObjectInfo object = asset_.object(info.object);
    Part& part = parts_.emplace_back();
    part.in_file = transform_of(info);
    part.bends = object.joints != 0;
    nodes.emplace_back();
    if (!hierarchy.at(i).is_null()) {
      part.node = hierarchy[i];
      nodes.back() = {size_t(part.node)};
      part.from_rest = inverse(rig_.at_rest().at(size_t(part.node))) * part.in_file;
    }
    for (const json& merged : metadata.value("merge", json::object()).value("objects", json::array()))
      if (merged.at("instance") == i && merged.contains("nodes")) {
        nodes.back().clear();
        for (const json& node : merged["nodes"])
          if (!node.is_null()) nodes.back().push_back(node);
      }
    hidden_.push_back(std::find(options.hidden.begin(), options.hidden.end(), info.name) !=
                      options.hidden.end());
    if (!hidden_.back()) triangles_ += object.triangles;
    if (!part.bends) continue;
    bending_triangles_ += object.triangles;
    const json& skin =
        document.at("skins").at(document.at("nodes").at(nodes.back().at(0)).at("skin").get<size_t>());
    joints_ = skin.at("joints").get<std::vector<uint32_t>>();
    if (joints_.size() != object.joints || !inverse_binds_.empty())
      throw std::runtime_error("the asset's skin is not the glTF's: the sample takes characters of one skin");
    const std::vector<float> inverses = file.values(skin.at("inverseBindMatrices"));
    for (size_t j = 0; j < joints_.size(); ++j) {
      Transform& bind = inverse_binds_.emplace_back();
      for (size_t row = 0; row < 3; ++row)
        for (size_t column = 0; column < 4; ++column)
          bind[4 * row + column] = inverses.at(16 * j + 4 * column + row);
    }
  }
  if (joints_.empty()) throw std::runtime_error("nothing of the character bends; bake it with --deforms");
  matrices_.resize(joints_.size());
  look_.emplace_back(file, nodes);
}

void Crowd::set_biases(const nifkit::Asset& asset, uint32_t first, uint32_t count) {
  biases_.resize(first + count);
  for (uint32_t i = 0; i < count; ++i) {
    // Assets that place nothing themselves have an instance of each object.
    const uint32_t object = asset.info().instance_count == 0 ? i : asset.instance(i).object;
    biases_[first + i] = asset.object(object).bias;
  }
}

float Crowd::ground_below(float x, float y, float z) const {
  const NifRay down{{x, y, z}, 0, {0, -1, 0}, std::numeric_limits<float>::infinity()};
  float t = 0;
  uint8_t hit = 0;
  nifkit::Rays rays(std::span(&down, 1));
  scene_.intersect(rays.mask(kGroundMask), nifkit::Hits().t({&t, 1}).hit({&hit, 1}));
  return hit ? y - t : 0;
}

FrameTimes Crowd::move(double seconds) {
  FrameTimes times;
  double last = thread_seconds();
  const auto lap = [&](double& into) {
    const double now = thread_seconds();
    into += now - last;
    last = now;
  };
  for (Member& member : members_) {
    const float angle = member.angle + speed_ * float(seconds) / member.radius;
    const float x = x_ + member.radius * std::cos(angle), z = z_ + member.radius * std::sin(angle);
    // From where a knee is, so that the character walks under roofs and up steps.
    member.height = ground_below(x, member.height + 0.6f, z);
    member.place = placed(-angle, {x, member.height, z});
  }
  lap(times.ground);
  for (const Member& member : members_) {
    rig_.evaluate(seconds + member.phase, bones_, world_);
    for (const Part& part : parts_) {
      if (!part.bends) continue;
      const Transform to_object = inverse(part.in_file);
      for (size_t j = 0; j < joints_.size(); ++j)
        matrices_[j] = to_object * world_[joints_[j]] * inverse_binds_[j];
    }
    lap(times.animate);
    for (uint32_t i = 0; i < parts_.size(); ++i) {
      const Part& part = parts_[i];
      if (part.bends) scene_.pose_instance(member.first + i, matrices_);
      const bool carried = !part.bends && part.node >= 0;
      scene_.set_instance_transform(
          member.first + i,
          member.place * (carried ? world_[size_t(part.node)] * part.from_rest : part.in_file));
    }
    lap(times.pose);
  }
  scene_.commit();
  lap(times.commit);
  return times;
}

Float3 Crowd::colour(uint32_t instance, uint32_t triangle, float u, float v, const Float3& from_asset) const {
  if (instance < first_character_) return from_asset;
  return look_[0].colour((instance - first_character_) % uint32_t(parts_.size()), triangle, u, v);
}

uint64_t Crowd::bytes_of_a_frame() const {
  return members_.size() * (matrices_.size() + parts_.size()) * sizeof(Transform);
}
