// Places skinned meshes. glTF ignores the transform of a skinned mesh's node: joints place it, each with its
// own transform after the inverse of its bind transform. If all joints agree, the mesh is in its bind pose,
// moves as a whole and becomes an instance. If they do not, its vertices are moved by their weighted joints.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <vector>

#include "formats/mesh/gltf/accessor.hpp"
#include "formats/mesh/gltf/gltf_hierarchy.hpp"

namespace nif::mesh::detail {

/// The transforms of a skin's joints from the nodes of the scene.
struct GltfPose {
  std::vector<Affine> joints;  ///< each transforms a vertex of its mesh to the world; at least one
  double reach = 0;            ///< distance of the mesh's joints from its origin

  /// The common transform of the meshes, or null if the joints do not agree, apart from rounding and the few
  /// digits of the matrices.
  const Affine* bind_place() const;
  /// Whether two transforms are equal by the same tolerance.
  bool is_alike(const Affine& place, const Affine& other) const;
  /// The translation that places a mesh in this pose: near the mesh, so that its positions are small numbers.
  Float3 origin() const;
};

/// Returns nothing if the skin is malformed or a joint is not in the scene. `worlds` has the transforms of
/// the nodes of the scene. Throws only bad_alloc.
std::optional<GltfPose> pose_of(const GltfData& data, const GltfSkin& skin,
                                const std::vector<std::optional<Affine>>& worlds);

/// Accessors of JOINTS_n and WEIGHTS_n.
using GltfInfluences = std::vector<std::pair<int, int>>;

/// Moves each vertex by the weighted sum of its joints' transforms, relative to the pose's origin. Returns
/// false if the weights cannot be read; then all vertices move with the first joint. Throws only bad_alloc.
bool apply_pose(const GltfData& data, const GltfPose& pose, const GltfInfluences& influences,
                std::vector<Float3>& positions);

}  // namespace nif::mesh::detail
