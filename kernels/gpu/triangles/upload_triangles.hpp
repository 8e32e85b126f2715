// Lays out a BVH in device memory, for every encoding that has one.
#pragma once

#include <utility>
#include <vector>

#include "kernels/gpu/upload.hpp"

namespace nif::kernels::gpu {

/// Levels of a tree, including the root's.
inline uint32_t bvh_levels(const TrianglesField& field) {
  // Nodes on the way down, and their siblings that are still to be visited; each with its level.
  std::vector<std::pair<uint32_t, uint32_t>> pending{{0, 1}};
  uint32_t deepest = 1;
  while (!pending.empty()) {
    const auto [number, level] = pending.back();
    pending.pop_back();
    if (level > deepest) deepest = level;
    const BvhNode& node = field.nodes[number];
    for (const uint8_t slot : node.slots)
      if (slot != 0 && slot_kind(slot) == kInnerSlot)
        pending.emplace_back(node.first_node + slot_rank(slot), level + 1);
  }
  return deepest;
}

/// Adds the arrays of a BVH, and points the field to their future addresses.
inline void move_bvh(TrianglesField& field, Arena& arena) {
  arena.move(field.nodes, field.node_count);
  arena.move(field.vertices, field.vertex_count);
  arena.move(field.triangles, field.triangle_count);
}

}  // namespace nif::kernels::gpu
