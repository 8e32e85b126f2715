// Which meshes a glTF scene shows, and where: the node hierarchy, flattened.
#pragma once

#include <string>
#include <vector>

#include "formats/mesh/input.hpp"

namespace tinygltf {
class Model;
}

namespace nif::mesh::detail {

/// A node that carries a mesh.
struct GltfPlacement {
  std::string name;  ///< may be empty
  size_t mesh = 0;   ///< index into the file's meshes
  bool skinned = false;
  Transform transform = kIdentity;
};

/// The placements of the default scene; of all roots where there is no scene. Throws malformed_mesh where the
/// nodes are not a forest.
std::vector<GltfPlacement> flatten(const Input& input, const tinygltf::Model& model);

}  // namespace nif::mesh::detail
