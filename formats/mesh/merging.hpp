// What was merged in a scene: many instances of the file became few. mesh/merge does it, a bake records it,
// and whoever compares an asset with its file repeats it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace nif::mesh {

inline constexpr uint32_t kNoNode = 0xffffffffu;

/// What is merged, and how far. The result depends on these and the scene alone. mesh/merge has the defaults.
struct MergeOptions {
  /// Names of nodes, or patterns with *, ? and [...]. They count for all that is below a node, too.
  std::vector<std::string> nodes;   ///< only these merge; empty: all
  std::vector<std::string> except;  ///< these stay apart
  /// The most that merging may add: a mesh placed k times has k copies then, in place of one. None: some
  /// number if that is enough for all that could merge, else 0 (mesh::kAddedTriangles).
  std::optional<uint64_t> added_triangles;
  uint64_t part_triangles = 0;    ///< meshes with so many or more stay
  uint64_t object_triangles = 0;  ///< the most of one merged mesh
};

/// Why an instance stays what it is.
enum class Stays : uint8_t {
  not_named,
  moves,
  flattened,  ///< its transform has no inverse
  too_far,    ///< the place is too far from the origin for its size: positions in single precision would show
  too_large,  ///< its mesh has MergeOptions::part_triangles or more
  over_budget,  ///< the copies of its mesh would be more than MergeOptions::added_triangles
  alone,        ///< no other is near that could be merged with it
};
inline constexpr size_t kStays = 7;

/// An instance of the file that is now in a merged mesh.
struct MergedPart {
  uint32_t instance = 0;  ///< in the file's order
  std::string name;
  uint32_t node = kNoNode;  ///< index into Scene::nodes, or kNoNode
  uint64_t triangles = 0;   ///< that it has in the merged mesh, one after the other
};

/// An instance that stands for several of the file.
struct MergedInstance {
  uint32_t instance = 0;          ///< index into Scene::instances
  std::vector<MergedPart> parts;  ///< in the file's order, which is that of the merged mesh's triangles
};

struct Merging {
  MergeOptions options;                 ///< added_triangles is some number
  std::vector<MergedInstance> merged;   ///< none where there was nothing to merge
  uint64_t instances = 0;               ///< of the file
  uint64_t added_triangles = 0;         ///< as far as MergeOptions::added_triangles was used
  std::array<uint64_t, kStays> stay{};  ///< how many instances stay what they are, by Stays
  std::vector<std::string> unmatched;   ///< of the names and patterns, those that no node has
};

}  // namespace nif::mesh
