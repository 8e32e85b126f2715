// Decodes the tree and the triangles of an object.
#include "kernels/cpu/triangles/decoded_tree.hpp"

#include <algorithm>
#include <bit>
#include <limits>

namespace nif::kernels::cpu {
namespace {

constexpr uint32_t kLast = kBvhWidth - 1;

uint32_t leaf_count(const TrianglesField& field) {
  uint32_t count = 0;
  for (uint32_t n = 0; n < field.node_count; ++n)
    for (const uint8_t slot : field.nodes[n].slots) count += slot != 0 && slot_kind(slot) != kInnerSlot;
  return count;
}

DecodedLeaf decode_leaf(const TrianglesField& field, const BvhNode& node, uint8_t slot) {
  DecodedLeaf leaf;
  for (uint32_t i = 0; i < kBvhLeafTriangles; ++i) {
    leaf.triangles[i] = node.first_triangle + slot_rank(slot) + std::min(i, slot_kind(slot) - 1);
    for (uint32_t corner = 0; corner < 3; ++corner) {
      const float* const vertex =
          field.vertices[size_t(node.first_vertex) + field.triangles[leaf.triangles[i]][corner]];
      for (uint32_t a = 0; a < 3; ++a) leaf.corners[corner][a][i] = vertex[a];
    }
  }
  return leaf;
}

/// The slots sorted by where a ray with these signs enters and leaves their boxes, the farthest first.
uint32_t far_to_near(const DecodedNode& node, uint32_t signs) {
  uint32_t slots[kBvhWidth];
  float along[kBvhWidth] = {};
  for (uint32_t s = 0; s < kBvhWidth; ++s) {
    slots[s] = s;
    for (uint32_t a = 0; a < 3 && node.low[a][s] <= node.high[a][s]; ++a) {
      const float middle = node.low[a][s] + node.high[a][s];
      along[s] += (signs >> a & 1) != 0 ? -middle : middle;
    }
  }
  std::stable_sort(slots, slots + kBvhWidth, [&](uint32_t a, uint32_t b) { return along[a] > along[b]; });
  uint32_t order = 0;
  for (uint32_t s = 0; s < kBvhWidth; ++s) order |= slots[s] << 3 * s;
  return order;
}

}  // namespace

DecodedTree decode(const TrianglesField& field, size_t most_bytes, SharedCopies& copies) {
  const size_t leaves = leaf_count(field);
  const size_t bytes = field.node_count * sizeof(DecodedNode) + leaves * sizeof(DecodedLeaf);
  if (bytes > most_bytes || leaves > (uint32_t{1} << 29)) return {};
  constexpr size_t kAlignment = alignof(DecodedNode);
  const auto aligned = [](auto* words) {
    return reinterpret_cast<std::byte*>((reinterpret_cast<uintptr_t>(words) + kAlignment - 1) / kAlignment *
                                        kAlignment);
  };
  const uint32_t* const copy =
      copies.get(field.nodes, (bytes + kAlignment) / sizeof(uint32_t), [&](uint32_t* words) {
        auto* const nodes = reinterpret_cast<DecodedNode*>(aligned(words));
        auto* leaf = reinterpret_cast<DecodedLeaf*>(nodes + field.node_count);
        uint32_t leaf_number = 0;
        for (uint32_t n = 0; n < field.node_count; ++n) {
          const BvhNode& from = field.nodes[n];
          DecodedNode to;
          uint32_t inner = 0;
          for (uint32_t s = 0; s < kBvhWidth; ++s) {
            const uint8_t slot = from.slots[s];
            const uint32_t at = kLast - s;
            for (uint32_t a = 0; a < 3; ++a) {
              to.low[a][at] = slot == 0 ? std::numeric_limits<float>::infinity()
                                        : frame_plane(from.frame[a], from.low[a][s]);
              to.high[a][at] = slot == 0 ? -std::numeric_limits<float>::infinity()
                                         : frame_plane(from.frame[a], from.high[a][s]);
            }
            to.children[at] = 0;
            if (slot == 0) continue;
            if (slot_kind(slot) == kInnerSlot) {
              inner |= 1u << at;
              to.children[at] = from.first_node + slot_rank(slot);
            } else {
              to.children[at] = leaf_number++ * kBvhLeafTriangles + slot_kind(slot) - 1;
              *leaf++ = decode_leaf(field, from, slot);
            }
          }
          for (uint32_t signs = 0; signs < 8; ++signs) to.order[signs] = far_to_near(to, signs) | inner << 24;
          nodes[n] = to;
        }
      });
  const auto* const nodes = reinterpret_cast<const DecodedNode*>(aligned(copy));
  return {nodes, reinterpret_cast<const DecodedLeaf*>(nodes + field.node_count)};
}

}  // namespace nif::kernels::cpu
