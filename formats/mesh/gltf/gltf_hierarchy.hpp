// Flattens the node hierarchy: finds the nodes that a glTF scene shows, and their transforms.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "formats/mesh/chooser.hpp"
#include "formats/mesh/input.hpp"
#include "formats/mesh/transform.hpp"

namespace tinygltf {
class Model;
class Node;
}  // namespace tinygltf

namespace nif::mesh::detail {

struct GltfSurface;

/// Composes a translation, a quaternion of any length, and a scale.
Affine from_parts(const std::array<double, 3>& translation, const std::array<double, 4>& rotation,
                  const std::array<double, 3>& scale);

/// The transform of a node that has no matrix. Its default moves nothing.
struct NodeParts {
  std::array<double, 3> translation{0, 0, 0};
  std::array<double, 4> rotation{0, 0, 0, 1};
  std::array<double, 3> scale{1, 1, 1};

  Affine transform() const { return from_parts(translation, rotation, scale); }
};

/// Nothing if the node has a matrix.
std::optional<NodeParts> parts_of(const tinygltf::Node& node);
Affine local_transform(const tinygltf::Node& node);

inline constexpr Affine kUnmoved{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

/// Composes transforms: first b, then a.
Affine multiply(const Affine& a, const Affine& b);
/// Nothing if it has none.
std::optional<Affine> inverse(const Affine& m);

/// Returns nothing if a number exceeds the range of float.
std::optional<Transform> to_transform(const Affine& world);
/// The rounding error of the translation in to_transform(), which must succeed.
Double3 remainder_of(const Affine& world);

/// A mesh placed by a node.
struct GltfPlacement {
  size_t node = 0;  ///< index into the file's nodes
  size_t mesh = 0;  ///< index into the file's meshes
  int skin = -1;    ///< index into the file's skins, not checked; -1: none
  Affine place{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
  /// Only the parts with a chosen material; the names of node and mesh are not chosen.
  bool by_material = false;
  size_t pose = SIZE_MAX;  ///< the pose that deforms it; SIZE_MAX: none
  bool instanced = false;  ///< one of several instances of its node
  bool bends = false;      ///< its skin, whose joints can be read, is kept: ReadLimits::skins
};

/// Records which names are chosen, for everything that a scene shows or hides.
struct GltfNaming {
  explicit GltfNaming(const Input& input) : chooser(input) {}

  Chooser chooser;
  std::vector<Named> meshes, materials;  ///< of the file

  /// Adds a placement if any part of it may be chosen; `node` is the result for the names of its nodes.
  void place(GltfPlacement placement, const Named& node, std::vector<GltfPlacement>& placements) const;
};

/// What the default scene shows; all roots if there is no scene.
struct GltfHierarchy {
  static constexpr size_t kNone = SIZE_MAX;
  std::vector<GltfPlacement> placements;  ///< in the order of traversal: parents first
  std::vector<size_t> parents;            ///< [node]; kNone: a root, or not in the scene
  std::vector<bool> in_scene;             ///< [mesh] whether a node of the scene uses it, hidden or not
  uint64_t hidden = 0;                    ///< nodes with a mesh that KHR_node_visibility hides
};

/// Throws malformed_mesh if the nodes are not a forest. `visit_node` is called for each node of the scene,
/// whatever it contains, with a flag that tells whether it is hidden.
GltfHierarchy flatten(const Input& input, const tinygltf::Model& model, GltfNaming& naming,
                      const std::function<void(size_t node, const Affine& world, bool hidden)>& visit_node);

/// Looks up the names of meshes and materials; after flatten(), all names have been looked up.
GltfNaming name_things(const Input& input, const tinygltf::Model& model,
                       const std::vector<GltfSurface>& materials);

}  // namespace nif::mesh::detail
