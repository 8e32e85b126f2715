// Moves the triangles of a `bvh` object: new corners and boxes for its decoded tree, from the leaves up.
//
// Boxes are the least and the most of coordinates, without rounding, so they are the same for every instruction set.
// Which child comes first for a ray stays as it was: that changes no answer.
//
// Compiled once for each target.
#if defined(NIF_BVH_REFIT_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef NIF_BVH_REFIT_INL
#undef NIF_BVH_REFIT_INL
#else
#define NIF_BVH_REFIT_INL
#endif

#include <hwy/highway.h>

#include "kernels/cpu/lanes-inl.hpp"
#include "kernels/cpu/triangles/tree.hpp"

HWY_BEFORE_NAMESPACE();
namespace nif::kernels::cpu::HWY_NAMESPACE {

#ifdef NIF_DECODES
/// A vertex: x, y, z and 0. Also the ends of boxes.
using OneVertex = hn::FixedTag<float, 4>;

struct VectorBox {
  hn::Vec<OneVertex> low, high;
};

/// The coordinates of four vertices, by axis.
struct Axes {
  hn::Vec<OneVertex> x, y, z;
};
HWY_INLINE Axes by_axis(hn::Vec<OneVertex> p, hn::Vec<OneVertex> q, hn::Vec<OneVertex> r,
                        hn::Vec<OneVertex> s) {
  const OneVertex d;
  const auto xy_pq = hn::InterleaveLower(d, p, q), xy_rs = hn::InterleaveLower(d, r, s);
  const auto z_pq = hn::InterleaveUpper(d, p, q), z_rs = hn::InterleaveUpper(d, r, s);
  return {hn::ConcatLowerLower(d, xy_rs, xy_pq), hn::ConcatUpperUpper(d, xy_rs, xy_pq),
          hn::ConcatLowerLower(d, z_rs, z_pq)};
}

/// Gives the triangles of a leaf their new corners. Returns the box around them.
HWY_INLINE VectorBox move_leaf(const MovedTriangles& moved, DecodedLeaf& leaf) {
  const OneVertex d;
  const uint32_t(*const triangles[kBvhLeafTriangles])[3] = {
      moved.corners + leaf.triangles[0], moved.corners + leaf.triangles[1], moved.corners + leaf.triangles[2],
      moved.corners + leaf.triangles[3]};
  VectorBox box;
  for (uint32_t k = 0; k < 3; ++k) {
    const auto corner = [&](uint32_t i) HWY_ATTR { return hn::Load(d, moved.positions[(*triangles[i])[k]]); };
    const auto p = corner(0), q = corner(1), r = corner(2), s = corner(3);
    const Axes axes = by_axis(p, q, r, s);
    hn::Store(axes.x, d, leaf.corners[k][0]);
    hn::Store(axes.y, d, leaf.corners[k][1]);
    hn::Store(axes.z, d, leaf.corners[k][2]);
    const auto low = hn::Min(hn::Min(p, q), hn::Min(r, s)), high = hn::Max(hn::Max(p, q), hn::Max(r, s));
    box.low = k == 0 ? low : hn::Min(box.low, low);
    box.high = k == 0 ? high : hn::Max(box.high, high);
  }
  return box;
}

/// Sets the planes of eight boxes.
HWY_INLINE void set_planes(const float (*boxes)[4], float (*planes)[kBvhWidth]) {
  const OneVertex d;
  for (uint32_t s = 0; s < kBvhWidth; s += 4) {
    const Axes axes = by_axis(hn::Load(d, boxes[s]), hn::Load(d, boxes[s + 1]), hn::Load(d, boxes[s + 2]),
                              hn::Load(d, boxes[s + 3]));
    hn::Store(axes.x, d, planes[0] + s);
    hn::Store(axes.y, d, planes[1] + s);
    hn::Store(axes.z, d, planes[2] + s);
  }
}

/// Of a hundred instances none is in the cache. Nodes are fetched some steps before their turn, and their leaves once
/// they have come.
HWY_INLINE void fetch_ahead(DecodedTree& tree, size_t number) {
  constexpr size_t kNodesAhead = 8, kLeavesAhead = 4, kLine = 64;
  if (number >= kNodesAhead)
    for (size_t byte = 0; byte < sizeof(DecodedNode); byte += kLine)
      __builtin_prefetch(reinterpret_cast<char*>(&tree.nodes[number - kNodesAhead]) + byte, 1);
  if (number < kLeavesAhead) return;
  const DecodedNode& node = tree.nodes[number - kLeavesAhead];
  const uint32_t inner = node.order[0] >> 24;
  for (uint32_t slot = 0; slot < kBvhWidth && node.low[0][slot] <= node.high[0][slot]; ++slot) {
    if ((inner >> slot & 1) != 0) continue;
    for (size_t byte = 0; byte < sizeof(DecodedLeaf); byte += kLine)
      __builtin_prefetch(
          reinterpret_cast<char*>(&tree.leaves[node.children[slot] / kBvhLeafTriangles]) + byte, 1);
  }
}

HWY_NOINLINE inline void move_decoded(const MovedTriangles& moved, DecodedTree& tree, VertexBox* boxes) {
  const OneVertex d;
  const VectorBox empty{hn::Set(d, std::numeric_limits<float>::infinity()),
                        hn::Set(d, -std::numeric_limits<float>::infinity())};
  for (size_t number = tree.nodes.size(); number-- > 0;) {
    fetch_ahead(tree, number);
    DecodedNode& node = tree.nodes[number];
    const uint32_t inner = node.order[0] >> 24;
    alignas(16) float low[kBvhWidth][4], high[kBvhWidth][4];
    VectorBox whole = empty;
    uint32_t slot = 0;
    // Empty slots are the last ones.
    for (; slot < kBvhWidth && node.low[0][slot] <= node.high[0][slot]; ++slot) {
      const Child child = node.children[slot];
      VectorBox box;
      if ((inner >> slot & 1) != 0)
        box = {hn::Load(d, boxes[child].low), hn::Load(d, boxes[child].high)};
      else
        box = move_leaf(moved, tree.leaves[child / kBvhLeafTriangles]);
      hn::Store(box.low, d, low[slot]);
      hn::Store(box.high, d, high[slot]);
      whole = {hn::Min(whole.low, box.low), hn::Max(whole.high, box.high)};
    }
    for (; slot < kBvhWidth; ++slot) {
      hn::Store(empty.low, d, low[slot]);
      hn::Store(empty.high, d, high[slot]);
    }
    set_planes(low, node.low);
    set_planes(high, node.high);
    hn::Store(whole.low, d, boxes[number].low);
    hn::Store(whole.high, d, boxes[number].high);
  }
  tree.reach = 0;
  for (uint32_t a = 0; a < 3; ++a)
    tree.reach = max_of(max_of(-moved.box.low[a], moved.box.high[a]), tree.reach);
}
#endif

inline void move_bvh(BvhTree& tree, const MovedTriangles& moved) {
  tree.field = moved.field;
#ifdef NIF_DECODES
  if (!tree.decoded.nodes.empty()) move_decoded(moved, tree.decoded, tree.boxes.data());
#endif
  describe_root(tree);
}

}  // namespace nif::kernels::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
