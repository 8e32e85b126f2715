// The scene's top level: a bounding volume hierarchy (BVH) over the instances' world boxes. A node has four
// children, whose boxes are tested at once.
//
// The instances' own boxes are stored only here, as the innermost children. A node has fewer children only if
// few instances are left, and n instances take at most n / 2 + 1 nodes.
#pragma once

#include <memory_resource>
#include <span>
#include <vector>

#include "scene/instance.hpp"

namespace nif::runtime {

using Node = kernels::TopNode;
using kernels::kNoBox;
inline constexpr uint32_t kWidth = kernels::kTopWidth, kLeaf = kernels::kTopLeaf;
/// Most nodes on a path from the root: a traversal keeps 4 bits for each in a 64-bit word.
inline constexpr uint32_t kMaxLevels = 16;
inline constexpr uint32_t kMaxInstances = kLeaf - 1;
/// Whether nodes say which children are near. On a web page the code is too much to download.
#ifdef __wasm__
inline constexpr bool kNearFirst = false;
#else
inline constexpr bool kNearFirst = true;
#endif

class Hierarchy {
 public:
  explicit Hierarchy(std::pmr::memory_resource* memory) : nodes_(memory) {}

  /// Rebuilds; the same boxes give the same nodes. places[i] receives the place of box i, or kNoBox if it
  /// is empty.
  void build(std::span<const kernels::WorldBox> boxes, std::span<uint32_t> places);

  /// A place is 4 * node + child. Changed boxes take effect after refit(). No ray meets an empty box.
  kernels::WorldBox box(uint32_t place) const;
  void set_box(uint32_t place, const kernels::WorldBox& box);

  /// Refits the boxes of inner nodes to their children. Returns false if rays would now visit so many more
  /// nodes than just after build() that a rebuild pays off.
  bool refit();

  kernels::WorldBox bounds() const;
  std::span<const Node> nodes() const { return nodes_; }
  size_t resident_bytes() const { return nodes_.capacity() * sizeof(Node); }

 private:
  double cost() const;

  std::pmr::vector<Node> nodes_;  ///< each node after its parent
  double built_cost_ = 0;
};

}  // namespace nif::runtime
