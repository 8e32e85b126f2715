// Which nodes a glTF scene shows, and where: the hierarchy, flattened.
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "formats/mesh/input.hpp"

namespace tinygltf {
class Model;
}

namespace nif::mesh::detail {

using Affine = std::array<double, 12>;  ///< row-major 3x4, as Transform

/// None where a number is beyond float.
std::optional<Transform> to_transform(const Affine& world);

/// A node that carries a mesh.
struct GltfPlacement {
  std::string name;  ///< may be empty
  size_t mesh = 0;   ///< index into the file's meshes
  bool skinned = false;
  Transform transform = kIdentity;
};

/// The placements of the default scene; of all roots where there is no scene. Throws malformed_mesh where the
/// nodes are not a forest. `visit_node` is called with each node that is shown, whatever it carries.
std::vector<GltfPlacement> flatten(const Input& input, const tinygltf::Model& model,
                                   const std::function<void(size_t node, const Affine& world)>& visit_node);

}  // namespace nif::mesh::detail
