// Makes the tree of an object's triangles for shaders from its wide BVH: the children of each node are split in two until
// each is alone, where the sum of the halves' areas times their triangles is least.
#include "kernels/shader/triangle_tree.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>

namespace nif::kernels::shader {
namespace {

struct Box {
  double low[3] = {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity(),
                   std::numeric_limits<double>::infinity()};
  double high[3] = {-std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity(),
                    -std::numeric_limits<double>::infinity()};

  void add(const Box& other) {
    for (int a = 0; a < 3; ++a) {
      low[a] = std::min(low[a], other.low[a]);
      high[a] = std::max(high[a], other.high[a]);
    }
  }
  double half_area() const {
    const double x = high[0] - low[0], y = high[1] - low[1], z = high[2] - low[2];
    return x * y + y * z + z * x;
  }
};

/// A used slot of a node.
struct Child {
  const BvhNode* node;
  uint32_t slot;
  Box box;
};
using Children = std::span<Child>;

class Writer {
 public:
  Writer(const TrianglesField& field, std::pmr::vector<uint32_t>& words)
      : field_(field), words_(words), first_(words.size()) {
    // All boxes grow by this: a bound of what the CPU's own rounding may move a ray that starts in reach.
    margin_ = double(field.extent) * 0x1p-22;
    std::array<Child, kBvhWidth> children;
    Box whole;
    for (const Child& child : children_of(field.nodes[0], children)) whole.add(child.box);
    for (int a = 0; a < 3; ++a) {
      frame_.corner[a] =
          std::nextafter(float(whole.low[a] - margin_), -std::numeric_limits<float>::infinity());
      const double size = whole.high[a] + margin_ - double(frame_.corner[a]);
      frame_.step[a] = float(std::max({size, double(field.extent) * 0x1p-20, 0x1p-100}) / (kBoxSteps - 4));
    }
  }

  TreeFrame write() {
    std::array<Child, kBvhWidth> children;
    write_group(children_of(field_.nodes[0], children));
    return frame_;
  }

 private:
  static Children children_of(const BvhNode& node, std::array<Child, kBvhWidth>& children) {
    size_t count = 0;
    for (uint32_t s = 0; s < kBvhWidth && node.slots[s] != 0; ++s) {
      Child& child = children[count++];
      child = {&node, s, {}};
      for (int a = 0; a < 3; ++a) {
        child.box.low[a] = double(frame_plane(node.frame[a], node.low[a][s]));
        child.box.high[a] = double(frame_plane(node.frame[a], node.high[a][s]));
      }
    }
    return {children.data(), count};
  }

  /// Returns the box of the triangles.
  Box write_group(Children children) {
    if (children.size() == 1) {
      const Child& only = children[0];
      const uint8_t slot = only.node->slots[only.slot];
      if (slot_kind(slot) != kInnerSlot) return write_leaf(*only.node, slot);
      std::array<Child, kBvhWidth> below;
      return write_group(children_of(field_.nodes[only.node->first_node + slot_rank(slot)], below));
    }
    const size_t at = words_.size();
    words_.resize(at + 4);
    const size_t half = split(children);
    Box box = write_group(children.first(half));
    box.add(write_group(children.subspan(half)));
    put_box(box, at);
    words_[at + 3] = uint32_t(words_.size() - first_);
    return box;
  }

  Box write_leaf(const BvhNode& node, uint8_t slot) {
    const uint32_t count = slot_kind(slot), first = node.first_triangle + slot_rank(slot);
    const size_t at = words_.size();
    words_.resize(at + 3);
    words_.insert(words_.end(), {kTreeLeaf | count, node.first_vertex, first});
    Box box;
    for (uint32_t i = first; i < first + count; ++i) {
      const uint8_t* const corners = field_.triangles[i];
      words_.push_back(corners[0] | uint32_t(corners[1]) << 8 | uint32_t(corners[2]) << 16);
      for (uint32_t k = 0; k < 3; ++k) {
        const float* const vertex = field_.vertices[size_t(node.first_vertex) + corners[k]];
        Box point;
        for (int a = 0; a < 3; ++a) point.low[a] = point.high[a] = double(vertex[a]);
        box.add(point);
      }
    }
    put_box(box, at);
    return box;
  }

  /// Sorts the children so that the first ones, whose number it returns, make one half; that with the first slot, which
  /// is likely to block rays, comes first.
  static size_t split(Children children) {
    const auto order = [](int axis) {
      return [axis](const Child& a, const Child& b) {
        const double x = a.box.low[axis] + a.box.high[axis], y = b.box.low[axis] + b.box.high[axis];
        return x < y || (x == y && a.slot < b.slot);
      };
    };
    double least = std::numeric_limits<double>::infinity();
    int best_axis = 0;
    size_t half = children.size() / 2;
    for (int axis = 0; axis < 3; ++axis) {
      std::sort(children.begin(), children.end(), order(axis));
      for (size_t k = 1; k < children.size(); ++k) {
        Box first, second;
        for (size_t i = 0; i < children.size(); ++i) (i < k ? first : second).add(children[i].box);
        const double cost = first.half_area() * double(k) + second.half_area() * double(children.size() - k);
        if (cost < least) least = cost, best_axis = axis, half = k;
      }
    }
    std::sort(children.begin(), children.end(), order(best_axis));
    const auto by_slot = [](const Child& a, const Child& b) { return a.slot < b.slot; };
    const auto first_slot = std::min_element(children.begin(), children.end(), by_slot);
    if (size_t(first_slot - children.begin()) >= half) {
      std::rotate(children.begin(), children.begin() + ptrdiff_t(half), children.end());
      half = children.size() - half;
    }
    return half;
  }

  /// Rounded outwards to steps.
  void put_box(const Box& box, size_t at) {
    for (size_t a = 0; a < 3; ++a) {
      const double corner = double(frame_.corner[a]), step = double(frame_.step[a]);
      const double low = std::floor((box.low[a] - margin_ - corner) / step);
      const double high = std::ceil((box.high[a] + margin_ - corner) / step);
      words_[at + a] = uint32_t(std::clamp(low, 0.0, double(kBoxSteps))) |
                       uint32_t(std::clamp(high, 0.0, double(kBoxSteps))) << 16;
    }
  }

  const TrianglesField& field_;
  std::pmr::vector<uint32_t>& words_;
  size_t first_;
  TreeFrame frame_{};
  double margin_;
};

}  // namespace

uint64_t count_tree_words(const TrianglesField& field) {
  // A leaf has six words and one for each triangle, and there is one inner node less than there are leaves.
  uint64_t leaves = 0;
  for (uint32_t i = 0; i < field.node_count; ++i)
    for (const uint8_t slot : field.nodes[i].slots) leaves += slot != 0 && slot_kind(slot) != kInnerSlot;
  return 6 * leaves + field.triangle_count + 4 * (leaves - 1);
}

TreeFrame append_tree(const TrianglesField& field, std::pmr::vector<uint32_t>& words) {
  return Writer(field, words).write();
}

}  // namespace nif::kernels::shader
