// Records what was merged in a scene, where many instances of the file became few. mesh/merge does it, a bake
// records it, and comparing an asset with its file repeats it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace nif::mesh {

inline constexpr uint32_t kNoNode = 0xffffffffu;

/// What is merged, and how far. The result depends only on these and the scene. mesh/merge has the defaults.
struct MergeOptions {
  /// Names of nodes, or patterns with *, ? and [...]. They also apply to everything below a node.
  std::vector<std::string> nodes;   ///< only these merge; empty: all
  std::vector<std::string> except;  ///< these stay separate
  /// Limit for triangles that merging adds: a mesh placed k times becomes k copies instead of one. Nothing: a
  /// default if that is enough for everything that could merge, otherwise 0.
  std::optional<uint64_t> added_triangles;
  /// That default: a tenth of the triangles that merge without copies, or else mesh::kAddedTriangles.
  bool few_copies = false;
  uint64_t part_triangles = 0;    ///< meshes with at least this many are not copied
  uint64_t object_triangles = 0;  ///< limit for one merged mesh
  /// Also what the joints of one skin move, of a scene that was read with ReadLimits::skins. What has morph targets or holes stays.
  bool skins = false;
  /// With `skins`, also what a joint carries and does not move against it.
  bool carried = false;
};

/// Why an instance stays.
enum class Stays : uint8_t {
  not_named,
  moves,    ///< and nothing else moves with it
  deforms,  ///< by a skin or morph targets; with MergeOptions::skins, nothing else has its skin, or it has targets or holes
  flattened,    ///< its transform has no inverse
  too_far,      ///< too far from the origin for its size: single precision would be visible in its positions
  too_large,    ///< its mesh has MergeOptions::object_triangles or more
  large_copy,   ///< its mesh is placed several times and has MergeOptions::part_triangles or more
  over_budget,  ///< the copies of its mesh would exceed MergeOptions::added_triangles
  alone,        ///< no other instance to merge with is near
};
inline constexpr size_t kStays = 9;

/// An instance of the file that is part of a merged mesh.
struct MergedPart {
  uint32_t instance = 0;  ///< index into Scene::instances before merging
  std::string name;
  uint32_t node = kNoNode;  ///< index into Scene::nodes, or kNoNode
  uint64_t triangles = 0;   ///< number of its triangles in the merged mesh, which are consecutive
};

/// An instance that stands for several of the file.
struct MergedInstance {
  uint32_t instance = 0;          ///< index into Scene::instances
  std::vector<MergedPart> parts;  ///< in the file's order, which is that of the merged mesh's triangles
};

struct Merging {
  MergeOptions options;                 ///< added_triangles has a value
  std::vector<MergedInstance> merged;   ///< empty if there was nothing to merge
  uint64_t instances = 0;               ///< of the file
  uint64_t added_triangles = 0;         ///< how much of MergeOptions::added_triangles was used
  std::array<uint64_t, kStays> stay{};  ///< number of instances that stay, by Stays
  std::vector<std::string> unmatched;   ///< names and patterns that no node matches
};

}  // namespace nif::mesh
