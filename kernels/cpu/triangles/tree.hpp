// A `bvh` object as the SIMD kernel keeps it: the field, the boxes of its root, and how far frames reach.
#pragma once

#include <optional>

#include "kernels/cpu/kernel_options.hpp"
#include "kernels/cpu/triangles/decoded_tree.hpp"
#include "kernels/reference/triangles/refit.hpp"

namespace nif::kernels::cpu {

struct BvhTree {
  BuiltBytes built_bytes() const {
    return {.decoded_triangles = decoded.bytes() + boxes.capacity() * sizeof(VertexBox)};
  }
  bool reads_nodes() const { return decoded.nodes.empty(); }

  TrianglesField field;
  DecodedTree decoded;  ///< empty if the object is too large
  /// No corner of a triangle, and no plane that is computed with, lies farther than this from the origin of object space
  /// along any axis. Planes of nodes' frames are computed with even if no box uses them, but not those of decoded nodes.
  float reach;
  // The root's slots.
  uint32_t inner = 0, leaves = 0;                         ///< bits by slot
  float low[kBvhWidth][3] = {}, high[kBvhWidth][3] = {};  ///< of the slots in use, which come first
  std::pmr::vector<VertexBox> boxes{};                    ///< room for move(): one for each decoded node
};

/// Rays of a batch that ask one tree: those before number `end` that no earlier part has. At least one.
struct TreePart {
  const BvhTree* tree;
  uint32_t end;
};

/// A tree without anything decoded. What is assigned to its vectors will be in this memory.
inline BvhTree empty_tree(const TrianglesField& field, std::pmr::memory_resource* memory) {
  return {.field = field,
          .decoded = {.nodes = std::pmr::vector<DecodedNode>(memory),
                      .leaves = std::pmr::vector<DecodedLeaf>(memory),
                      .large = std::pmr::vector<LargeTriangle>(memory),
                      .large_boxes = {},
                      .reach = 0},
          .reach = field.extent,
          .boxes = std::pmr::vector<VertexBox>(memory)};
}

/// Sets what a tree says of its root, and how far it reaches.
inline void describe_root(BvhTree& tree) {
  const TrianglesField& field = tree.field;
  tree.inner = tree.leaves = 0;
#ifdef NIF_DECODES
  if (!tree.decoded.nodes.empty()) {
    // Often a third of the extent. Not far below it, so that nothing underflows that did not before.
    tree.reach = max_of(tree.decoded.reach, field.extent / 8);
    const DecodedNode& root = tree.decoded.nodes[0];
    for (uint32_t s = 0; s < kBvhWidth && root.low[0][s] <= root.high[0][s]; ++s) {
      ((root.order[0] >> (24 + s) & 1) != 0 ? tree.inner : tree.leaves) |= 1u << s;
      for (uint32_t a = 0; a < 3; ++a) {
        tree.low[s][a] = root.low[a][s];
        tree.high[s][a] = root.high[a][s];
      }
    }
    return;
  }
#endif
  tree.reach = field.extent;
  for (uint32_t i = 0; i < field.node_count; ++i) tree.reach = max_of(bvh_extent(field.nodes[i]), tree.reach);
  const BvhNode& root = field.nodes[0];
  for (uint32_t s = 0; s < kBvhWidth && root.slots[s] != 0; ++s) {
    (slot_kind(root.slots[s]) == kInnerSlot ? tree.inner : tree.leaves) |= 1u << s;
    for (uint32_t a = 0; a < 3; ++a) {
      tree.low[s][a] = frame_plane(root.frame[a], root.low[a][s]);
      tree.high[s][a] = frame_plane(root.frame[a], root.high[a][s]);
    }
  }
}

/// Decodes the field if `options` allow it. `holes`: null if the triangles have none.
inline BvhTree tree_of(const TrianglesField& field, [[maybe_unused]] const KernelOptions& options,
                       [[maybe_unused]] const HolesField* holes = nullptr) {
#ifndef NIF_DECODES
  BvhTree tree{field, {}, field.extent};
#else
  // Vectors that are assigned keep the memory in which they were made.
  BvhTree tree = empty_tree(field, options.memory);
  if (least_decoded_bytes(field.triangle_count) <= options.most_decoded) {
    std::optional<BlockingBoxes> boxes;
    if (holes != nullptr) boxes.emplace(*holes, options.copies, options.memory);
    tree.decoded =
        decode(field, options.most_decoded, options.memory, boxes ? &*boxes : nullptr, options.moves);
  }
  if (options.moves)
    tree.boxes = std::pmr::vector<VertexBox>(tree.decoded.nodes.size(), VertexBox(), options.memory);
#endif
  describe_root(tree);
  return tree;
}

}  // namespace nif::kernels::cpu
