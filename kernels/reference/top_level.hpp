// Traverses a scene's hierarchy with one ray, from one instance that it may meet to the next. No stack: a few
// bits per level record the way back, and nodes know their parents.
#pragma once

#include "kernels/reference/scene_field.hpp"

namespace nif::kernels {

/// Where a ray's traversal of the hierarchy continues: the node, and the children still to be visited, as places in an order:
/// its own (lowest 4 bits), its parent's (next 4), and so on.
struct Cursor {
  uint64_t trail;
  uint32_t node;
};

/// Takes the next child from a cursor, whose places are those of an order: an instance with kTopLeaf, or a node, to which the
/// cursor goes. Returns kNoBox after the last.
template <class Order>
inline uint32_t next_child(const TopNode* nodes, Cursor& cursor, const Order& order) {
  while ((cursor.trail & 15) == 0) {
    if (cursor.trail == 0) return kNoBox;
    cursor.trail >>= 4;
    cursor.node = nodes[cursor.node].parent / kTopWidth;
  }
  const TopNode& node = nodes[cursor.node];
  const uint32_t child = node.child[order.child_at(node, lowest_bit(cursor.trail))];
  cursor.trail &= cursor.trail - 1;
  if ((child & kTopLeaf) == 0) cursor.node = child;
  return child;
}

/// The next instance whose box the ray may meet, or kNoBox after the last. may_meet(node) returns the
/// children of a node that the ray may meet, as bits; a ray starts with those of the root. For GPUs, where what next_child()
/// does takes registers.
template <class MayMeet>
NIF_HOST_DEVICE inline uint32_t next_instance(const TopNode* nodes, Cursor& cursor, const MayMeet& may_meet) {
  uint64_t trail = cursor.trail;
  uint32_t at = cursor.node;
  while (trail != 0) {
    if ((trail & 15) == 0) {
      trail >>= 4;
      at = nodes[at].parent / kTopWidth;
      continue;
    }
    const uint32_t child = nodes[at].child[lowest_bit(trail)];
    trail &= trail - 1;
    if (child & kTopLeaf) {
      cursor = {trail, at};
      return child & ~kTopLeaf;
    }
    at = child;
    trail = trail << 4 | may_meet(nodes[at]);
  }
  cursor = {0, at};
  return kNoBox;
}

/// The box of a node's child.
NIF_HOST_DEVICE inline WorldBox box_of_child(const TopNode& node, uint32_t lane) {
  return {{node.min[0][lane], node.min[1][lane], node.min[2][lane]},
          {node.max[0][lane], node.max[1][lane], node.max[2][lane]}};
}

/// The children of a node that the ray may meet, as bits.
NIF_HOST_DEVICE inline uint32_t children_met(const TopNode& node, const Segment& ray,
                                             const BoxRay& prepared) {
  uint32_t met = 0;
  NIF_UNROLL
  for (uint32_t lane = 0; lane < kTopWidth; ++lane)
    met |= uint32_t(may_meet(box_of_child(node, lane), ray, prepared)) << lane;
  return met & node.lanes;
}

}  // namespace nif::kernels
