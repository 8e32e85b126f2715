// The corners of a polygon that can block an ear, and a tree that finds those inside a triangle. Long thin
// triangles, as in combs, meet few of its boxes. Internal to formats/mesh.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "formats/base/orientation.hpp"

namespace nif::mesh::detail {

class Blockers {
 public:
  void clear(size_t corners);

  /// Sets whether `corner` blocks from now on.
  void set(uint32_t corner, bool blocks);

  /// Sorts all corners into a tree, if many block. To be called once.
  void sort(std::span<const Point2> points);

  /// Whether `blocks` returns true for a corner in the closed triangle, or within `slack` of it; it may also
  /// be called for other corners. Subtracts the work from `budget`.
  template <class Blocks>
  bool any_in(const std::array<Point2, 3>& triangle, double slack, int64_t& budget,
              const Blocks& blocks) const;

 private:
  static constexpr size_t kLeaf = 8;
  // Measured with polygon_speed (tests/measure) on polygons of 3 to 200 corners: 1.9 million corners per
  // second with 24 here, 2.5 with 48, 3.2 with 96, 3.7 with 200. Without a tree, the work for a corner is up
  // to twice this number.
  static constexpr size_t kFewest = 128;
  static constexpr uint32_t kNone = UINT32_MAX;

  struct Box {
    Point2 min, max;
    uint32_t first = 0, last = 0;  // range of its items
    uint32_t live = 0;             // corners that still block
    bool leaf = true;
  };

  void build(std::span<const Point2> points, size_t box, uint32_t first, uint32_t last);
  /// If true, they are certainly apart.
  static bool apart(const Box& box, const std::array<Point2, 3>& triangle, double slack);

  std::vector<uint32_t> list_;     // blocking corners, in no order
  std::vector<uint32_t> place_;    // of a corner in list_, or kNone
  std::vector<uint32_t> items_;    // of the tree: all corners
  std::vector<uint32_t> leaf_of_;  // of a corner
  std::vector<Box> boxes_;         // children of i are 2 i and 2 i + 1; the root is 1
};

template <class Blocks>
bool Blockers::any_in(const std::array<Point2, 3>& triangle, double slack, int64_t& budget,
                      const Blocks& blocks) const {
  if (boxes_.empty()) {
    const auto found = std::ranges::find_if(list_, blocks);
    budget -= found - list_.begin();
    return found != list_.end();
  }
  std::array<uint32_t, 64> stack;
  size_t depth = 0;
  stack[depth++] = 1;
  while (depth != 0) {
    const uint32_t at = stack[--depth];
    const Box& box = boxes_[at];
    --budget;
    if (box.live == 0 || apart(box, triangle, slack)) continue;
    if (!box.leaf) {
      stack[depth++] = 2 * at;
      stack[depth++] = 2 * at + 1;
      continue;
    }
    budget -= box.last - box.first;
    for (uint32_t i = box.first; i < box.last; ++i)
      if (place_[items_[i]] != kNone && blocks(items_[i])) return true;
  }
  return false;
}

}  // namespace nif::mesh::detail
