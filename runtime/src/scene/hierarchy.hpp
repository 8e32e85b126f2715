// The scene's top level: a bounding volume hierarchy (BVH) over the instances' world boxes, four children a
// node, whose boxes are tested at once.
//
// The boxes of the instances themselves are the innermost children: they are stored nowhere else. A node has
// few children only where few instances are left, and n instances take at most n / 2 + 1 nodes.
#pragma once

#include <memory_resource>
#include <span>
#include <vector>

#include "scene/instance.hpp"

namespace nif::runtime {

using Node = kernels::TopNode;
using kernels::kNoPlace;
inline constexpr uint32_t kWidth = kernels::kTopWidth, kLeaf = kernels::kTopLeaf;
/// Nodes on a path from the root at most: a traversal keeps 4 bits for each in 64.
inline constexpr uint32_t kMaxLevels = 16;
inline constexpr uint32_t kMaxInstances = kLeaf - 1;

class Hierarchy {
 public:
  explicit Hierarchy(std::pmr::memory_resource* memory) : nodes_(memory) {}

  /// Builds anew, the same nodes for the same boxes; places[i] receives where box i is: kNoPlace if it is
  /// empty.
  void build(std::span<const kernels::WorldBox> boxes, std::span<uint32_t> places);

  /// A place is 4 * node + child. Changed boxes count after refit(). No ray meets an empty one.
  kernels::WorldBox box(uint32_t place) const;
  void set_box(uint32_t place, const kernels::WorldBox& box);

  /// Fits the boxes of inner nodes to their children. False where rays would now visit so many more nodes
  /// than just after build() that building anew pays.
  bool refit();

  kernels::WorldBox bounds() const;
  std::span<const Node> nodes() const { return nodes_; }
  size_t resident_bytes() const { return nodes_.capacity() * sizeof(Node); }

 private:
  double cost() const;

  std::pmr::vector<Node> nodes_;  ///< each after its parent
  double built_cost_ = 0;
};

}  // namespace nif::runtime
