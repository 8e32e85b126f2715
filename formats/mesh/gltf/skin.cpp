#include "formats/mesh/gltf/skin.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

namespace nif::mesh::detail {
namespace {

/// Of what the joints move: exporters write matrices of some six digits, and chains of joints add them up.
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

bool BindPlace::alike(const Affine& other) const {
  const double scale = largest_linear(place), step = std::max(scale * reach, distance_of(place));
  for (size_t i = 0; i < place.size(); ++i) {
    // Written so that NaN is not alike.
    if (!(std::abs(place[i] - other[i]) <= kTolerance * (i % 4 == 3 ? step : scale))) return false;
  }
  return true;
}

std::optional<BindPlace> bind_place(const GltfData& data, const GltfSkin& skin,
                                    std::span<const std::optional<Affine>> worlds) {
  std::vector<Affine> inverses;
  try {
    if (skin.inverse_bind_matrices >= 0) inverses = data.matrices(skin.inverse_bind_matrices);
  } catch (const Error&) {  // it costs the pose, not the mesh
    return std::nullopt;
  }
  if (skin.joints.empty() || (skin.inverse_bind_matrices >= 0 && inverses.size() < skin.joints.size()))
    return std::nullopt;
  // How far a mesh reaches from its origin is known by where its joints are bound.
  double reach = 0;
  for (const Affine& inverse : inverses) reach = std::max(reach, distance_of(inverse));
  std::optional<BindPlace> place;
  for (size_t i = 0; i < skin.joints.size(); ++i) {
    const size_t joint = skin.joints[i];
    if (joint >= worlds.size() || !worlds[joint]) return std::nullopt;
    const Affine moved = inverses.empty() ? *worlds[joint] : multiply(*worlds[joint], inverses[i]);
    if (!place)
      place = BindPlace{moved, reach};
    else if (!place->alike(moved))
      return std::nullopt;
  }
  return place;
}

}  // namespace nif::mesh::detail
