// How a mesh bends: the joints that move its vertices, and its morph targets.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "formats/mesh/mesh_scene.hpp"

namespace nif::mesh {

inline constexpr uint32_t kNoSkin = 0xffffffffu;

/// Of a mesh that bends, with ReadLimits::skins. Its positions are then those of the file, in the shape before any joint or
/// target moves them. As in glTF, targets move a vertex first, and joints move what that gives.
struct Skin {
  uint32_t influences = 0;       ///< joints that move a vertex, at most: 4 or 8; 0 without joints
  uint32_t joint_count = 0;      ///< of the skin, whether they move a vertex of this mesh or not
  std::vector<uint16_t> joints;  ///< [vertex][influences], below joint_count
  /// [vertex][influences], not negative. They sum to 1, apart from the rounding of each. Unused ones come last, with weight 0
  /// and joint 0.
  std::vector<float> weights;
  std::vector<std::vector<Float3>>
      targets;                      ///< [target][vertex] how far a target of weight 1 moves it; finite
  std::vector<float> rest_weights;  ///< [target] of the mesh in the file, for nodes that have none
  uint32_t number = kNoSkin;        ///< index into the skins of the file; kNoSkin without joints
};

/// Whether two bend alike, if their joints and weights do. Skins of the file with the same joints have different numbers,
/// which are not compared.
bool bend_alike(const Skin* a, const Skin* b);

/// Row-major 3x4, from a mesh's own space, in which it is bound to its joints, to that of its instance.
using JointMatrix = std::array<float, 12>;

/// The positions of a mesh that is bent, computed in double and rounded once. Missing joints move nothing, and missing
/// weights are 0: `joints` has Skin::joint_count matrices, or none, and `weights` one for each target.
std::vector<Float3> bent(const Mesh& mesh, std::span<const JointMatrix> joints,
                         std::span<const float> weights);

}  // namespace nif::mesh
