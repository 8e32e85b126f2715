// A binary tree over triangles, which the baker improves (reinsert.hpp) before it becomes nodes of eight slots (collapse.hpp).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "formats/mesh/box.hpp"
#include "kernels/reference/triangles/triangles_field.hpp"

namespace nif::bake {

/// Half the surface of a box: as often as this says, rays meet it. In double precision, where it cannot overflow.
double half_surface(const mesh::Box& box);

/// Node 0 is the root. Children may stand before their parents.
struct BinaryTree {
  static constexpr uint32_t kNone = ~uint32_t{0};
  struct Node {
    mesh::Box box;
    uint32_t parent = kNone;  ///< kNone: the root
    /// Inner nodes from this one down, on the longest way. 0: a leaf, of what is below it: at most kBvhLeafTriangles triangles.
    uint32_t height = 0;
    uint32_t children[2] = {kNone, kNone};  ///< kNone: a triangle
    uint32_t triangle = 0;

    bool has_children() const { return children[0] != kNone; }
  };
  std::vector<Node> nodes;

  /// Box and height of a node from those of its children.
  void refit(uint32_t node);
};

/// Levels of nodes of eight slots; with some to spare, as a root that is a leaf needs a node above it.
inline constexpr uint32_t kMostLevels = kernels::kMaxBvhDepth - 2;
/// Of a binary tree that fits into so many levels, whatever its shape: a node of eight slots always has room for three levels.
inline constexpr uint32_t kMostHeight = 3 * kMostLevels;

/// Embree's builder decides which triangles belong together. At least one triangle. A few become a leaf where rays test it less
/// often than smaller ones. The result does not depend on the number of threads. Throws Error(out_of_memory) with Embree's own message.
BinaryTree build_binary_tree(std::span<const mesh::Float3> positions,
                             std::span<const mesh::Triangle> triangles);

}  // namespace nif::bake
