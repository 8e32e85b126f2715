// Packs a tree: measures boxes from the leaves up, then packs nodes from the root down. Planes take 8 bits
// each and are rounded outwards. Some vertices are stored twice, so that an index takes one byte.
#include "formats/nif/triangles/pack.hpp"

#include <algorithm>
#include <functional>
#include <limits>
#include <utility>

#include "formats/base/status.hpp"
#include "kernels/reference/triangles/refit.hpp"

namespace nif::format {
namespace {

using kernels::BvhNode;
using kernels::kBvhWidth;
using Position = std::array<float, 3>;
using Triangle = std::array<uint32_t, 3>;

class Packer {
 public:
  Packer(std::span<const Position> positions, std::span<const Triangle> triangles,
         std::vector<uint32_t>* order, std::vector<uint32_t>* sources)
      : positions_(positions),
        triangles_(triangles),
        order_(order),
        sources_(sources),
        copies_(positions.size(), kNone) {}

  TrianglesData pack(BvhBranch& root) {
    measure(root);
    bvh_.nodes.emplace_back();
    if (root.child_count == 0) {  // the root must be a node
      BvhBranch above;
      above.child_count = 1;
      above.children[0] = &root;
      measure(above);
      pack_node(above, 0, 1);
    } else {
      pack_node(root, 0, 1);
    }
    return std::move(bvh_);
  }

 private:
  static constexpr uint32_t kNone = 0xffffffffu;

  /// Computes the exact boxes of the triangles, from the leaves up.
  void measure(BvhBranch& branch) const {
    std::fill_n(branch.low, 3, std::numeric_limits<float>::infinity());
    std::fill_n(branch.high, 3, -std::numeric_limits<float>::infinity());
    for (uint32_t i = 0; i < branch.child_count; ++i) {
      measure(*branch.children[i]);
      include(branch, branch.children[i]->low, branch.children[i]->high);
    }
    for (uint32_t i = 0; i < branch.triangle_count; ++i)
      for (const uint32_t v : triangles_[branch.triangles[i]])
        include(branch, positions_[v].data(), positions_[v].data());
  }
  static void include(BvhBranch& branch, const float* low, const float* high) {
    for (int a = 0; a < 3; ++a) {
      branch.low[a] = std::min(branch.low[a], low[a]);
      branch.high[a] = std::max(branch.high[a], high[a]);
    }
  }

  void pack_node(const BvhBranch& branch, uint32_t index, uint32_t depth) {
    if (depth > kernels::kMaxBvhDepth) throw Error(Status::internal, "a bvh is too deep to be packed");
    BvhNode node{};
    double scale[3];
    for (size_t a = 0; a < 3; ++a)
      node.frame[a] = kernels::fit_frame(double(branch.low[a]), double(branch.high[a]), scale[a]);
    uint32_t inner = 0, triangles = 0;
    for (uint32_t s = 0; s < branch.child_count; ++s) {
      const BvhBranch& child = *branch.children[s];
      node.slots[s] = child.child_count > 0 ? kernels::make_slot(kernels::kInnerSlot, inner++)
                                            : kernels::make_slot(child.triangle_count, triangles);
      triangles += child.triangle_count;
      for (size_t a = 0; a < 3; ++a) {
        const kernels::FrameSteps steps =
            kernels::steps_in(node.frame[a], scale[a], double(child.low[a]), double(child.high[a]));
        node.low[a][s] = steps.low;
        node.high[a][s] = steps.high;
      }
    }
    node.first_node = inner > 0 ? uint32_t(bvh_.nodes.size()) : 0;
    node.first_triangle = uint32_t(bvh_.triangles.size());
    node.first_vertex = triangles > 0 ? pack_triangles(branch) : 0;
    bvh_.nodes.resize(bvh_.nodes.size() + inner);
    bvh_.nodes[index] = node;
    for (uint32_t s = 0, rank = 0; s < branch.child_count; ++s)
      if (branch.children[s]->child_count > 0)
        pack_node(*branch.children[s], node.first_node + rank++, depth + 1);
  }

  /// Appends the triangles of a node's leaves, with those of their vertices that are not among the last ones;
  /// returns the base of the node's indices. Vertices are repeated, rarely, so that an index takes one byte.
  uint32_t pack_triangles(const BvhBranch& branch) {
    std::vector<uint32_t> used;
    for (uint32_t s = 0; s < branch.child_count; ++s) {
      const BvhBranch& leaf = *branch.children[s];
      for (uint32_t i = 0; i < leaf.triangle_count; ++i)
        for (const uint32_t v : triangles_[leaf.triangles[i]])
          if (std::find(used.begin(), used.end(), v) == used.end()) used.push_back(v);
    }
    // Copies that stay within the window when all others are appended; each copy outside shrinks it.
    const auto end = uint32_t(bvh_.vertices.size());
    std::vector<uint32_t> kept;
    for (const uint32_t v : used)
      if (copies_[v] != kNone && copies_[v] + kernels::kBvhWindow >= end) kept.push_back(copies_[v]);
    std::sort(kept.begin(), kept.end(), std::greater<>());
    while (!kept.empty() && kept.back() + kernels::kBvhWindow < end + used.size() - kept.size())
      kept.pop_back();
    const uint32_t first = kept.empty() ? end : kept.back();
    for (const uint32_t v : used) {
      if (copies_[v] != kNone && copies_[v] >= first) continue;
      copies_[v] = uint32_t(bvh_.vertices.size());
      bvh_.vertices.push_back(positions_[v]);
      if (sources_) sources_->push_back(v);
    }
    for (uint32_t s = 0; s < branch.child_count; ++s) {
      const BvhBranch& leaf = *branch.children[s];
      for (uint32_t i = 0; i < leaf.triangle_count; ++i) {
        const Triangle& t = triangles_[leaf.triangles[i]];
        bvh_.triangles.push_back(
            {uint8_t(copies_[t[0]] - first), uint8_t(copies_[t[1]] - first), uint8_t(copies_[t[2]] - first)});
        if (order_) order_->push_back(leaf.triangles[i]);
      }
    }
    return first;
  }

  std::span<const Position> positions_;
  std::span<const Triangle> triangles_;
  std::vector<uint32_t>*order_, *sources_;
  std::vector<uint32_t> copies_;  ///< by position: where its latest copy is
  TrianglesData bvh_;
};

}  // namespace

TrianglesData pack_bvh(BvhBranch& root, std::span<const Position> positions,
                       std::span<const Triangle> triangles, std::vector<uint32_t>* order,
                       std::vector<uint32_t>* sources) {
  if (order) order->clear();
  if (sources) sources->clear();
  return Packer(positions, triangles, order, sources).pack(root);
}

}  // namespace nif::format
