// Flattens the node hierarchy: which nodes a glTF scene shows, and where.
#pragma once

#include <array>
#include <cstdint>
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

/// The place of what stands at `b` within what stands at `a`.
Affine multiply(const Affine& a, const Affine& b);

/// None where a number is beyond float.
std::optional<Transform> to_transform(const Affine& world);
/// What that takes from the translation. It must not be none.
Double3 remainder_of(const Affine& world);

/// A node that carries a mesh.
struct GltfPlacement {
  size_t node = 0;  ///< index into the file's nodes
  size_t mesh = 0;  ///< index into the file's meshes
  int skin = -1;    ///< index into the file's skins, not checked; -1: none
  Transform transform = kIdentity;
  Double3 remainder{};  ///< what rounding took from its translation
};

/// What the default scene shows; all roots where there is no scene.
struct GltfHierarchy {
  static constexpr size_t kNone = SIZE_MAX;
  std::vector<GltfPlacement> placements;  ///< in the order in which the hierarchy is walked: parents first
  std::vector<size_t> parents;            ///< [node]; kNone: a root, or not shown
};

/// Throws malformed_mesh where the nodes are not a forest. `visit_node` is called with each node that is
/// shown, whatever it carries.
GltfHierarchy flatten(const Input& input, const tinygltf::Model& model,
                      const std::function<void(size_t node, const Affine& world)>& visit_node);

}  // namespace nif::mesh::detail
