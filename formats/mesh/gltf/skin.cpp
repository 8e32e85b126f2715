// Linear blend skinning in doubles. Joints agree if their transforms differ by at most a thousandth, because
// exporters write about six digits. The JSON of skins is also read here.
#include "formats/mesh/gltf/skin.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

namespace nif::mesh::detail {
namespace {

/// Relative to what the joints move: exporters write matrices with some six digits, and errors add up along
/// chains of joints.
constexpr double kTolerance = 1e-3;

double largest_linear(const Affine& m) {
  double largest = 0;
  for (size_t row = 0; row < 3; ++row)
    for (size_t column = 0; column < 3; ++column) largest = std::max(largest, std::abs(m[row * 4 + column]));
  return largest;
}

double distance_of(const Affine& m) { return std::max({std::abs(m[3]), std::abs(m[7]), std::abs(m[11])}); }

}  // namespace

std::vector<GltfSkin> read_skins(const nlohmann::json& root) {
  std::vector<GltfSkin> skins;
  const auto listed = root.find("skins");
  if (listed == root.end() || !listed->is_array()) return skins;
  for (const nlohmann::json& described : *listed) {
    GltfSkin& skin = skins.emplace_back();
    if (!described.is_object()) continue;
    const auto joints = described.find("joints"), matrices = described.find("inverseBindMatrices");
    if (joints == described.end() || !joints->is_array()) continue;
    for (const nlohmann::json& joint : *joints)
      if (joint.is_number_unsigned()) skin.joints.push_back(joint.get<size_t>());
    if (skin.joints.size() != joints->size()) skin.joints.clear();
    if (matrices != described.end()) {
      if (matrices->is_number_unsigned() && matrices->get<uint64_t>() < size_t{1} << 31)
        skin.inverse_bind_matrices = matrices->get<int>();
      else
        skin.joints.clear();
    }
  }
  return skins;
}

bool GltfPose::is_alike(const Affine& place, const Affine& other) const {
  const double scale = largest_linear(place), step = std::max(scale * reach, distance_of(place));
  for (size_t i = 0; i < place.size(); ++i) {
    // Written so that NaN is not alike.
    if (!(std::abs(place[i] - other[i]) <= kTolerance * (i % 4 == 3 ? step : scale))) return false;
  }
  return true;
}

const Affine* GltfPose::bind_place() const {
  const auto agrees = [&](const Affine& joint) { return is_alike(joints.front(), joint); };
  return std::all_of(joints.begin() + 1, joints.end(), agrees) ? &joints.front() : nullptr;
}

Float3 GltfPose::origin() const {
  const Affine& first = joints.front();
  return {static_cast<float>(first[3]), static_cast<float>(first[7]), static_cast<float>(first[11])};
}

std::optional<GltfPose> pose_of(const GltfData& data, const GltfSkin& skin,
                                const std::vector<std::optional<Affine>>& worlds) {
  std::vector<Affine> inverses;
  try {
    if (skin.inverse_bind_matrices >= 0)
      inverses = data.matrices(skin.inverse_bind_matrices, skin.joints.size());
  } catch (const Error&) {  // the pose is lost, but not the mesh
    return std::nullopt;
  }
  if (skin.joints.empty() || (skin.inverse_bind_matrices >= 0 && inverses.size() < skin.joints.size()))
    return std::nullopt;
  GltfPose pose;
  // The bind positions of the joints tell how far a mesh extends from its origin.
  for (const Affine& inverse : inverses) pose.reach = std::max(pose.reach, distance_of(inverse));
  for (size_t i = 0; i < skin.joints.size(); ++i) {
    const size_t joint = skin.joints[i];
    if (joint >= worlds.size() || !worlds[joint]) return std::nullopt;
    pose.joints.push_back(inverses.empty() ? *worlds[joint] : multiply(*worlds[joint], inverses[i]));
    if (!to_transform(pose.joints.back())) return std::nullopt;
  }
  return pose;
}

namespace {

void move_by(const Affine& joint, double weight, const Float3& p, Double3& sum) {
  for (size_t row = 0; row < 3; ++row)
    sum[row] += weight * (joint[4 * row] * double{p[0]} + joint[4 * row + 1] * double{p[1]} +
                          joint[4 * row + 2] * double{p[2]} + joint[4 * row + 3]);
}

/// Adds weighted transforms, and weights; returns false if something is invalid.
bool add_influences(const GltfData& data, const GltfPose& pose, std::pair<int, int> accessors,
                    const std::vector<Float3>& positions, std::vector<Double3>& sums,
                    std::vector<double>& totals) {
  const auto joints = data.joints(accessors.first);
  const auto weights = data.weights(accessors.second);
  if (joints.size() != positions.size() || weights.size() != positions.size()) return false;
  for (size_t i = 0; i < positions.size(); ++i)
    for (size_t k = 0; k < 4; ++k) {
      const double weight = double{weights[i][k]};
      if (weight == 0) continue;
      if (!(weight > 0 && std::isfinite(weight)) || joints[i][k] >= pose.joints.size()) return false;
      move_by(pose.joints[joints[i][k]], weight, positions[i], sums[i]);
      totals[i] += weight;
    }
  return true;
}

}  // namespace

bool apply_pose(const GltfData& data, const GltfPose& pose, const GltfInfluences& influences,
                std::vector<Float3>& positions) {
  std::vector<Double3> sums(positions.size());
  std::vector<double> totals(positions.size());
  bool fine = !influences.empty();
  try {
    for (size_t i = 0; fine && i < influences.size(); ++i)
      fine = add_influences(data, pose, influences[i], positions, sums, totals);
  } catch (const Error&) {
    fine = false;
  }
  const Float3 origin = pose.origin();
  for (size_t i = 0; i < positions.size(); ++i) {
    if (!fine || totals[i] == 0) {  // a vertex without weights follows the first joint
      sums[i] = {};
      totals[i] = 1;
      move_by(pose.joints.front(), 1, positions[i], sums[i]);
    }
    for (size_t a = 0; a < 3; ++a)
      positions[i][a] = static_cast<float>(sums[i][a] / totals[i] - double{origin[a]});
  }
  return fine;
}

}  // namespace nif::mesh::detail
