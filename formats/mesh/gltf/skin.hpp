// Where a skinned mesh is. glTF ignores the transform of its node: joints place it, each with its own
// transform after the inverse of its bind transform. If all joints agree, the mesh is in its bind pose, moves
// as a whole and becomes an instance. If they do not, its vertices are moved by the joints that they weigh.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <vector>

#include "formats/mesh/gltf/accessor.hpp"
#include "formats/mesh/gltf/hierarchy.hpp"

namespace nif::mesh::detail {

/// The joints of a skin as the nodes of the scene have them.
struct GltfPose {
  std::vector<Affine> joints;  ///< each takes a vertex of its mesh to the world; at least one
  double reach = 0;            ///< how far from its origin the mesh has joints

  /// Where the meshes stand as a whole; null where the joints do not agree, but for what rounding and the
  /// matrices' few digits make of it.
  const Affine* bind_place() const;
  /// Likewise, whether another place is the same.
  bool is_alike(const Affine& place, const Affine& other) const;
  /// What a mesh in this pose is placed by: near to where it is, so that its positions are small numbers.
  Float3 origin() const;
};

/// None where the skin is malformed, or a joint is not in the scene. `worlds` has the places of the nodes of
/// the scene. Throws nothing but bad_alloc.
std::optional<GltfPose> pose_of(const GltfData& data, const GltfSkin& skin,
                                const std::vector<std::optional<Affine>>& worlds);

/// Accessors of JOINTS_n and WEIGHTS_n.
using GltfInfluences = std::vector<std::pair<int, int>>;

/// Moves vertices to where the joints have them, less the pose's origin: by the sum of the joints' transforms
/// of each, as it weighs them. False where its weights cannot be read; then all move with the first joint.
/// Throws nothing but bad_alloc.
bool apply_pose(const GltfData& data, const GltfPose& pose, const GltfInfluences& influences,
                std::vector<Float3>& positions);

}  // namespace nif::mesh::detail
