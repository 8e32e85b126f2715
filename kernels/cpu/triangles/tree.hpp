// A `bvh` object as the SIMD kernel keeps it: the field, the boxes of its root, and how far frames reach.
#pragma once

#include "kernels/cpu/kernel_options.hpp"
#include "kernels/cpu/triangles/decoded_tree.hpp"

namespace nif::kernels::cpu {

struct BvhTree {
  BuiltBytes built_bytes() const { return {.decoded_triangles = decoded.bytes}; }

  TrianglesField field;
  DecodedTree decoded;  ///< empty if the object is too large
  /// No plane of any node's frame, used or not, lies farther from the origin of object space along any axis.
  /// The baker's frames lie within the root's, so this is the extent. A file may have others: only the planes
  /// that boxes use must lie within the root's.
  float reach = 0;
  // The root's slots.
  uint32_t inner = 0, leaves = 0;               ///< bits by slot
  float low[kBvhWidth][3], high[kBvhWidth][3];  ///< of the slots in use, which come first
};

/// Decodes the field if `options` allow it.
inline BvhTree tree_of(const TrianglesField& field, const KernelOptions& options) {
  BvhTree tree{field,
               kDecodes ? decode(field, options.most_decoded, options.copies, options.memory) : DecodedTree(),
               field.extent,
               0,
               0,
               {},
               {}};
  for (uint32_t i = 0; i < field.node_count; ++i) tree.reach = max_of(bvh_extent(field.nodes[i]), tree.reach);
  const auto take = [&](uint32_t slot, bool inner, const auto& low, const auto& high) {
    (inner ? tree.inner : tree.leaves) |= 1u << slot;
    for (uint32_t a = 0; a < 3; ++a) {
      tree.low[slot][a] = low(a);
      tree.high[slot][a] = high(a);
    }
  };
  if (const DecodedNode* const root = tree.decoded.nodes; kDecodes && root != nullptr) {
    for (uint32_t s = 0; s < kBvhWidth && root->low[0][s] <= root->high[0][s]; ++s)
      take(
          s, (root->order[0] >> (24 + s) & 1) != 0, [&](uint32_t a) { return root->low[a][s]; },
          [&](uint32_t a) { return root->high[a][s]; });
    return tree;
  }
  const BvhNode& root = field.nodes[0];
  for (uint32_t s = 0; s < kBvhWidth && root.slots[s] != 0; ++s)
    take(
        s, slot_kind(root.slots[s]) == kInnerSlot,
        [&](uint32_t a) { return frame_plane(root.frame[a], root.low[a][s]); },
        [&](uint32_t a) { return frame_plane(root.frame[a], root.high[a][s]); });
  return tree;
}

}  // namespace nif::kernels::cpu
