// Checks the tree in one pass with a stack of fixed size. Each node must name exactly the next numbers, so no
// node or triangle is shared, left out or visited twice. Each box must contain what is below it.
#include "formats/nif/triangles/check_triangles.hpp"

#include <algorithm>
#include <array>

namespace nif::format {
namespace {

using kernels::BvhNode;
using kernels::kBvhWidth;
using kernels::kInnerSlot;

struct Box {
  float low[3], high[3];

  bool holds(const float* low_end, const float* high_end) const {  // false if one is NaN
    for (int a = 0; a < 3; ++a)
      if (!(low[a] <= low_end[a] && high_end[a] <= high[a])) return false;
    return true;
  }
};

/// A node that has been named but not yet visited.
struct Pending {
  uint32_t node, depth;
  Box box;
};

class Checker {
 public:
  explicit Checker(const kernels::TrianglesField& field) : field_(field) {}

  std::optional<Rule> run() {
    if (field_.node_count == 0 || field_.triangle_count == 0) return Rule::tree_empty;
    const BvhNode& root = field_.nodes[0];
    if (!scales_in_range(root)) return Rule::tree_scale;
    if (!(kernels::bvh_extent(root) <= kernels::kMaxBvhCoordinate)) return Rule::tree_large;
    Pending& first = stack_[size_++];
    first = {0, 1, {}};
    for (int a = 0; a < 3; ++a) {
      first.box.low[a] = kernels::frame_plane(root.frame[a], 0);
      first.box.high[a] = kernels::frame_plane(root.frame[a], 255);
    }
    while (size_ > 0) {
      const Pending pending = stack_[--size_];
      if (const auto wrong = visit(pending)) return wrong;
    }
    if (next_node_ != field_.node_count) return Rule::node_of_no_node;
    if (next_triangle_ != field_.triangle_count) return Rule::triangle_of_no_node;
    return std::nullopt;
  }

 private:
  static bool scales_in_range(const BvhNode& node) {
    return std::all_of(std::begin(node.frame), std::end(node.frame), [](uint32_t frame) {
      const uint32_t scale = frame & 255;
      return scale >= kernels::kMinBvhScale && scale <= kernels::kMaxBvhScale;
    });
  }

  std::optional<Rule> visit(const Pending& pending) {
    const BvhNode& node = field_.nodes[pending.node];
    if (!scales_in_range(node)) return Rule::tree_scale;
    uint32_t used = 0, inner = 0, triangles = 0;
    for (; used < kBvhWidth && node.slots[used] != 0; ++used) {
      const uint32_t kind = kernels::slot_kind(node.slots[used]), rank = kernels::slot_rank(node.slots[used]);
      if (kind == 0 || (kind > kernels::kBvhLeafTriangles && kind != kInnerSlot)) return Rule::slot_kind;
      if (rank != (kind == kInnerSlot ? inner : triangles)) return Rule::slot_rank;
      (kind == kInnerSlot ? inner : triangles) += kind == kInnerSlot ? 1 : kind;
    }
    if (used == 0) return Rule::node_empty;
    for (uint32_t s = used; s < kBvhWidth; ++s) {
      bool zero = node.slots[s] == 0;
      for (int a = 0; a < 3; ++a) zero = zero && node.low[a][s] == 0 && node.high[a][s] == 0;
      if (!zero) return Rule::empty_slot;
    }
    if (node.first_node != (inner > 0 ? next_node_ : 0) || inner > field_.node_count - next_node_)
      return Rule::node_order;
    if (node.first_triangle != next_triangle_ || triangles > field_.triangle_count - next_triangle_)
      return Rule::triangle_order;
    if (triangles == 0 && node.first_vertex != 0) return Rule::vertex_of_no_triangle;
    if (inner > 0 && pending.depth == kernels::kMaxBvhDepth) return Rule::tree_deep;
    next_node_ += inner;
    next_triangle_ += triangles;

    for (uint32_t s = used; s-- > 0;) {  // pushed from the last on, so that the first is visited next
      Box box;
      for (int a = 0; a < 3; ++a) {
        if (node.low[a][s] > node.high[a][s]) return Rule::box_inside_out;
        box.low[a] = kernels::frame_plane(node.frame[a], node.low[a][s]);
        box.high[a] = kernels::frame_plane(node.frame[a], node.high[a][s]);
      }
      if (!pending.box.holds(box.low, box.high)) return Rule::box_outside;
      if (kernels::slot_kind(node.slots[s]) == kInnerSlot) {
        stack_[size_++] = {node.first_node + kernels::slot_rank(node.slots[s]), pending.depth + 1, box};
      } else if (const auto wrong = check_leaf(node, node.slots[s], box)) {
        return wrong;
      }
    }
    return std::nullopt;
  }

  std::optional<Rule> check_leaf(const BvhNode& node, uint8_t slot, const Box& box) const {
    const uint32_t first = node.first_triangle + kernels::slot_rank(slot);
    for (uint32_t i = first; i < first + kernels::slot_kind(slot); ++i)
      for (const uint8_t index : field_.triangles[i]) {
        const uint64_t vertex = uint64_t(node.first_vertex) + index;
        if (vertex >= field_.vertex_count) return Rule::vertex_range;
        if (!box.holds(field_.vertices[vertex], field_.vertices[vertex])) return Rule::vertex_outside;
      }
    return std::nullopt;
  }

  const kernels::TrianglesField& field_;
  uint32_t next_node_ = 1, next_triangle_ = 0, size_ = 0;
  std::array<Pending, kernels::kBvhStack> stack_;
};

}  // namespace

std::optional<Rule> fault_of(const kernels::TrianglesField& field) { return Checker(field).run(); }

}  // namespace nif::format
