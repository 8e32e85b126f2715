// Flattens the node hierarchy: which nodes a glTF scene shows, and where.
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
}

namespace nif::mesh::detail {

struct GltfSurface;

/// Of a translation, a quaternion of any length, and a scale.
Affine from_parts(const std::array<double, 3>& translation, const std::array<double, 4>& rotation,
                  const std::array<double, 3>& scale);

/// The place of what stands at `b` within what stands at `a`.
Affine multiply(const Affine& a, const Affine& b);

/// None where a number is beyond float.
std::optional<Transform> to_transform(const Affine& world);
/// What that takes from the translation. It must not be none.
Double3 remainder_of(const Affine& world);

/// A mesh that a node places.
struct GltfPlacement {
  size_t node = 0;  ///< index into the file's nodes
  size_t mesh = 0;  ///< index into the file's meshes
  int skin = -1;    ///< index into the file's skins, not checked; -1: none
  Affine place{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
  bool by_material = false;  ///< only what has a material that is chosen; the names of node and mesh are not
  size_t pose = SIZE_MAX;    ///< the pose that deforms it; SIZE_MAX: none
  bool instanced = false;    ///< one of several of its node
};

/// What a scene shows or hides, and by which names it is chosen.
struct GltfNaming {
  explicit GltfNaming(const Input& input) : chooser(input) {}

  Chooser chooser;
  std::vector<Named> meshes, materials;  ///< of the file

  /// Adds a placement if something of it may be chosen; `node` is what is known by the names of its nodes.
  void place(GltfPlacement placement, const Named& node, std::vector<GltfPlacement>& placements) const;
};

/// What the default scene shows; all roots where there is no scene.
struct GltfHierarchy {
  static constexpr size_t kNone = SIZE_MAX;
  std::vector<GltfPlacement> placements;  ///< in the order in which the hierarchy is walked: parents first
  std::vector<size_t> parents;            ///< [node]; kNone: a root, or not in the scene
  std::vector<bool> in_scene;             ///< [mesh] whether a node of the scene has it, hidden or not
  uint64_t hidden = 0;                    ///< nodes with a mesh that KHR_node_visibility hides
};

/// Throws malformed_mesh where the nodes are not a forest. `visit_node` is called with each node of the
/// scene, whatever it carries, and told whether it is hidden.
GltfHierarchy flatten(const Input& input, const tinygltf::Model& model, GltfNaming& naming,
                      const std::function<void(size_t node, const Affine& world, bool hidden)>& visit_node);

/// The names of meshes and materials; whoever calls flatten() after it has looked all names up.
GltfNaming name_things(const Input& input, const tinygltf::Model& model,
                       const std::vector<GltfSurface>& materials);

}  // namespace nif::mesh::detail
