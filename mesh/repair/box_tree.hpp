// Finds boxes in space without testing all of them: a tree that halves them along their longest axis.
#pragma once

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <utility>
#include <vector>

#include "formats/mesh/box.hpp"

namespace nif::repair {

class BoxTree {
 public:
  explicit BoxTree(std::vector<mesh::Box> boxes) : boxes_(std::move(boxes)), order_(boxes_.size()) {
    std::iota(order_.begin(), order_.end(), 0u);
    if (!boxes_.empty()) build(0, uint32_t(boxes_.size()));
  }

  /// Calls found(i) for each box that `enter` accepts, until found() returns false. `enter` must then also
  /// accept all boxes that contain it. The half that `nearer` prefers comes first. The order depends only on
  /// the boxes.
  template <class Enter, class Found, class Nearer>
  void visit(Enter enter, Found found, Nearer nearer) const {
    std::vector<uint32_t> open;
    if (!nodes_.empty()) open.push_back(0);
    while (!open.empty()) {
      const uint32_t at = open.back();
      open.pop_back();
      const Node& node = nodes_[at];
      if (!enter(node.box)) continue;
      if (node.right == 0) {
        for (uint32_t i = node.begin; i < node.end; ++i)
          if (enter(boxes_[order_[i]]) && !found(order_[i])) return;
        continue;
      }
      const bool right_first = nearer(nodes_[node.right].box, nodes_[at + 1].box);
      open.push_back(right_first ? at + 1 : node.right);
      open.push_back(right_first ? node.right : at + 1);
    }
  }
  template <class Enter, class Found>
  void visit(Enter enter, Found found) const {
    visit(enter, found, [](const mesh::Box&, const mesh::Box&) { return false; });
  }

  const mesh::Box& box(uint32_t i) const { return boxes_[i]; }

 private:
  static constexpr uint32_t kLeaf = 4;
  struct Node {
    mesh::Box box;
    uint32_t begin, end;
    uint32_t right = 0;  ///< the other half follows its parent; 0: a leaf
  };

  double middle(uint32_t i, size_t axis) const {
    return double(boxes_[i].min[axis]) + double(boxes_[i].max[axis]);
  }

  void build(uint32_t begin, uint32_t end) {
    const auto at = uint32_t(nodes_.size());
    nodes_.push_back({boxes_[order_[begin]], begin, end});
    std::array<double, 3> low, high;
    low.fill(std::numeric_limits<double>::infinity()), high.fill(-low[0]);
    for (uint32_t i = begin; i < end; ++i) {
      nodes_[at].box.add(boxes_[order_[i]]);
      for (size_t axis = 0; axis < 3; ++axis) {
        low[axis] = std::min(low[axis], middle(order_[i], axis));
        high[axis] = std::max(high[axis], middle(order_[i], axis));
      }
    }
    if (end - begin <= kLeaf) return;
    size_t axis = 0;
    for (size_t other = 1; other < 3; ++other)
      if (high[other] - low[other] > high[axis] - low[axis]) axis = other;
    const uint32_t half = begin + (end - begin) / 2;
    std::nth_element(order_.begin() + begin, order_.begin() + half, order_.begin() + end,
                     [&](uint32_t a, uint32_t b) {
                       return std::pair(middle(a, axis), a) < std::pair(middle(b, axis), b);
                     });
    build(begin, half);
    nodes_[at].right = uint32_t(nodes_.size());
    build(half, end);
  }

  std::vector<mesh::Box> boxes_;
  std::vector<uint32_t> order_;
  std::vector<Node> nodes_;
};

}  // namespace nif::repair
