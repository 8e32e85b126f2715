// A file may have any number of sets of joints for the same vertices, so only the largest weights are kept, set by set.
#include "formats/mesh/gltf/skin_collector.hpp"

#include <algorithm>
#include <cmath>

namespace nif::mesh::detail {

/// What moves a vertex: the largest weights, in the order of the file.
struct SkinCollector::Influences {
  std::array<float, kMostInfluences> weights{};
  std::array<uint16_t, kMostInfluences> joints{};
  uint8_t count = 0;
  bool more = false;

  void add(uint16_t joint, float weight) {
    size_t at = count;
    if (count == kMostInfluences) {
      more = true;
      const auto least = size_t(std::ranges::min_element(weights) - weights.begin());
      if (weights[least] >= weight) return;
      std::copy(weights.begin() + least + 1, weights.end(), weights.begin() + least);
      std::copy(joints.begin() + least + 1, joints.end(), joints.begin() + least);
      at = kMostInfluences - 1;
    } else {
      ++count;
    }
    weights[at] = weight, joints[at] = joint;
  }

  /// Makes weights sum to 1; returns false if there are none.
  bool normalise() {
    double total = 0;
    for (const float weight : weights) total += double{weight};
    if (!(total > 0)) return false;
    const Influences all = *this;
    *this = {};
    more = all.more;
    for (size_t k = 0; k < all.count; ++k)
      if (const auto weight = static_cast<float>(double{all.weights[k]} / total); weight > 0)
        add(all.joints[k], weight);
    return true;
  }
};

SkinCollector::SkinCollector(const GltfData& data, uint32_t number, size_t joints, size_t targets)
    : data_(data), joint_count_(joints) {
  if (joints > 0) {
    skin_.number = number;
    skin_.joint_count = static_cast<uint32_t>(joints);
  }
  skin_.targets.resize(targets);
}

bool SkinCollector::add_set(std::pair<int, int> accessors, std::vector<Influences>& vertices) const {
  const auto joints = data_.joints(accessors.first);
  const auto weights = data_.weights(accessors.second);
  if (joints.size() != vertices.size() || weights.size() != vertices.size()) return false;
  for (size_t i = 0; i < vertices.size(); ++i)
    for (size_t k = 0; k < 4; ++k) {
      const float weight = weights[i][k];
      if (weight == 0) continue;
      if (!(weight > 0 && std::isfinite(weight)) || joints[i][k] >= joint_count_) return false;
      vertices[i].add(joints[i][k], weight);
    }
  return true;
}

void SkinCollector::append(const Influences& vertex) {
  most_ = std::max<size_t>(most_, vertex.count);
  skin_.joints.insert(skin_.joints.end(), vertex.joints.begin(), vertex.joints.end());
  skin_.weights.insert(skin_.weights.end(), vertex.weights.begin(), vertex.weights.end());
}

void SkinCollector::add_joints(size_t vertices, const GltfInfluences& influences) {
  vertices_ += vertices;
  if (!has_joints()) return;
  std::vector<Influences> added(vertices);
  bool fine = !influences.empty();
  try {
    for (size_t i = 0; fine && i < influences.size(); ++i) fine = add_set(influences[i], added);
  } catch (const Error&) {
    fine = false;
  }
  unreadable_ |= !fine;
  Influences first;
  first.add(0, 1);
  for (Influences& vertex : added) {
    if (!fine) {
      vertex = first;
    } else if (!vertex.normalise()) {
      vertex = first;
      ++loose_;
    }
    many_ += vertex.more;
    append(vertex);
  }
}

void SkinCollector::set_target(size_t target, const std::vector<Float3>& moves) {
  std::vector<Float3>& all = skin_.targets[target];
  all.resize(vertices_ - moves.size());
  all.insert(all.end(), moves.begin(), moves.end());
}

std::shared_ptr<const Skin> SkinCollector::finish(std::vector<float> rest_weights) {
  if (!has_joints() && skin_.targets.empty()) return nullptr;
  skin_.rest_weights = std::move(rest_weights);
  for (std::vector<Float3>& target : skin_.targets) target.resize(vertices_);
  if (!has_joints()) return std::make_shared<const Skin>(std::move(skin_));
  skin_.influences = most_ <= 4 ? 4 : kMostInfluences;
  for (size_t v = 0; v < vertices_; ++v)
    for (size_t k = 0; k < skin_.influences; ++k) {
      skin_.joints[v * skin_.influences + k] = skin_.joints[v * kMostInfluences + k];
      skin_.weights[v * skin_.influences + k] = skin_.weights[v * kMostInfluences + k];
    }
  skin_.joints.resize(vertices_ * skin_.influences);
  skin_.weights.resize(vertices_ * skin_.influences);
  skin_.joints.shrink_to_fit();
  skin_.weights.shrink_to_fit();
  return std::make_shared<const Skin>(std::move(skin_));
}

}  // namespace nif::mesh::detail
