#include "rig.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

using nlohmann::json;

namespace {

/// Reads an array of numbers, if the node has it.
template <size_t kCount>
void read_if_there(const json& node, const char* name, std::array<float, kCount>& numbers) {
  if (node.contains(name))
    for (size_t i = 0; i < kCount; ++i) numbers[i] = node[name].at(i);
}

/// Between two rotations, on the shorter way around.
std::array<float, 4> turn_between(const float* from, const float* to, float share) {
  float cosine = 0;
  for (size_t i = 0; i < 4; ++i) cosine += from[i] * to[i];
  const float side = cosine < 0 ? -1.0f : 1.0f;
  cosine = std::min(std::abs(cosine), 1.0f);
  const float angle = std::acos(cosine), sine = std::sin(angle);
  const float a = sine > 1e-3f ? std::sin((1 - share) * angle) / sine : 1 - share,
              b = side * (sine > 1e-3f ? std::sin(share * angle) / sine : share);
  std::array<float, 4> turned;
  float length = 0;
  for (size_t i = 0; i < 4; ++i) turned[i] = a * from[i] + b * to[i], length += turned[i] * turned[i];
  for (float& part : turned) part /= std::sqrt(length);
  return turned;
}

}  // namespace

Transform Bone::transform() const {
  const auto [x, y, z, w] = rotation;
  const float turn[9] = {1 - 2 * (y * y + z * z), 2 * (x * y - z * w),     2 * (x * z + y * w),
                         2 * (x * y + z * w),     1 - 2 * (x * x + z * z), 2 * (y * z - x * w),
                         2 * (x * z - y * w),     2 * (y * z + x * w),     1 - 2 * (x * x + y * y)};
  Transform transform;
  for (size_t row = 0; row < 3; ++row) {
    for (size_t k = 0; k < 3; ++k) transform[4 * row + k] = turn[3 * row + k] * scale[k];
    transform[4 * row + 3] = translation[row];
  }
  return transform;
}

Rig::Rig(const Gltf& file, const std::string& clip) {
  const json& document = file.document();
  const json& nodes = document.at("nodes");
  parents_.assign(nodes.size(), -1);
  for (size_t n = 0; n < nodes.size(); ++n) {
    const json& node = nodes[n];
    if (node.contains("matrix"))
      throw std::runtime_error("node " + std::to_string(n) +
                               " has a matrix; the sample reads only rotations, "
                               "translations and scales");
    Bone& bone = rest_.emplace_back();
    read_if_there(node, "translation", bone.translation);
    read_if_there(node, "rotation", bone.rotation);
    read_if_there(node, "scale", bone.scale);
    for (const size_t child : node.value("children", std::vector<size_t>())) parents_.at(child) = int(n);
  }
  for (size_t n = 0; n < nodes.size(); ++n)
    if (parents_[n] < 0) order_.push_back(n);
  for (size_t k = 0; k < order_.size(); ++k)
    for (const size_t child : nodes[order_[k]].value("children", std::vector<size_t>()))
      order_.push_back(child);
  if (order_.size() != nodes.size()) throw std::runtime_error("nodes are children of each other");
  at_rest_.resize(nodes.size());
  place(rest_, at_rest_);

  std::string names;
  for (const json& animation : document.value("animations", json::array())) {
    const std::string name = animation.value("name", "");
    names += (names.empty() ? "" : ", ") + name;
    if (name != clip) continue;
    for (const json& channel : animation.at("channels")) {
      const json &target = channel.at("target"),
                 &sampler = animation.at("samplers").at(channel.at("sampler").get<size_t>());
      const std::string path = target.at("path"), how = sampler.value("interpolation", "LINEAR");
      if (!target.contains("node") || (path != "translation" && path != "rotation" && path != "scale"))
        continue;
      if (how == "CUBICSPLINE")
        throw std::runtime_error("clip '" + clip + "' has curves; the sample reads only lines and steps");
      Channel& read = channels_.emplace_back();
      read.target = path == "rotation" ? Channel::Target::rotation
                    : path == "scale"  ? Channel::Target::scale
                                       : Channel::Target::translation;
      read.node = target["node"];
      read.steps = how == "STEP";
      read.times = file.values(sampler.at("input"));
      read.values = file.values(sampler.at("output"));
      if (read.node >= nodes.size() || read.times.empty() ||
          read.values.size() != read.times.size() * (path == "rotation" ? 4 : 3))
        throw std::runtime_error("clip '" + clip + "' has keys that do not fit");
      end_ = std::max(end_, double(read.times.back()));
    }
    return;
  }
  throw std::runtime_error("there is no clip '" + clip + "', but: " + (names.empty() ? "none" : names));
}

void Rig::place(std::span<const Bone> bones, std::span<Transform> world) const {
  for (const size_t n : order_) {
    const Transform own = bones[n].transform();
    world[n] = parents_[n] < 0 ? own : world[size_t(parents_[n])] * own;
  }
}

void Rig::evaluate(double time, std::span<Bone> bones, std::span<Transform> world) const {
  const auto now = float(end_ > 0 ? time - end_ * std::floor(time / end_) : 0);
  std::copy(rest_.begin(), rest_.end(), bones.begin());
  for (const Channel& channel : channels_) {
    const auto next =
        size_t(std::upper_bound(channel.times.begin(), channel.times.end(), now) - channel.times.begin());
    const size_t a = next == 0 ? 0 : next - 1, b = std::min(next, channel.times.size() - 1);
    const float length = channel.times[b] - channel.times[a];
    const float share = length > 0 && !channel.steps ? (now - channel.times[a]) / length : 0;
    Bone& bone = bones[channel.node];
    if (channel.target == Channel::Target::rotation) {
      bone.rotation = turn_between(&channel.values[4 * a], &channel.values[4 * b], share);
      continue;
    }
    Float3& moved = channel.target == Channel::Target::scale ? bone.scale : bone.translation;
    for (size_t i = 0; i < 3; ++i)
      moved[i] = (1 - share) * channel.values[3 * a + i] + share * channel.values[3 * b + i];
  }
  place(bones, world);
}
