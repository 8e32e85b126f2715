// The memory of one object in the `bvh` encoding: a compressed wide BVH over exact triangles.
//
// After Ylitie, Karras and Laine, "Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs"
// (HPG 2017): eight children a node, their boxes with eight bits per plane relative to the node's frame. Here
// a frame is a multiple of its scale, so that planes are exact in single precision. docs/format.md describes
// the layout.
#pragma once

#include <cstdint>

#include "kernels/reference/arithmetic.hpp"

namespace nif::kernels {

inline constexpr uint32_t kBvhWidth = 8;          ///< slots of a node
inline constexpr uint32_t kBvhLeafTriangles = 4;  ///< in one slot, at most
inline constexpr uint32_t kBvhWindow = 256;       ///< vertices that the triangles of one node can name
/// Maximum number of nodes on a path from the root, both ends counted; bounds a traversal's stack.
inline constexpr uint32_t kMaxBvhDepth = 40;
inline constexpr uint32_t kBvhStack = (kBvhWidth - 1) * kMaxBvhDepth + 1;
/// Limit of the coordinates of nodes' planes and of ray origins.
inline constexpr float kMaxBvhCoordinate = 0x1p61f;
/// A frame's scale is a power of two from 2^-100 to 2^60; these are the exponent fields of those floats.
inline constexpr uint32_t kMinBvhScale = 27, kMaxBvhScale = 187;

/// Contents of a node's slot: 0 if empty; else the number of its triangles (1 to 4), or kInnerSlot for a
/// node, times 32, plus its rank: the number of triangles, or of nodes, in the slots before.
inline constexpr uint32_t kInnerSlot = 7;
NIF_HOST_DEVICE constexpr uint32_t slot_kind(uint8_t slot) { return slot >> 5; }
NIF_HOST_DEVICE constexpr uint32_t slot_rank(uint8_t slot) { return slot & 31; }
NIF_HOST_DEVICE constexpr uint8_t make_slot(uint32_t kind, uint32_t rank) {
  return uint8_t(kind << 5 | rank);
}

struct BvhNode {              // 80 bytes
  uint32_t frame[3];          ///< by axis: exponent field of the scale + 256 * base, a 24-bit signed integer
  uint32_t first_node;        ///< of the inner slots, in order; 0 if there are none
  uint32_t first_triangle;    ///< of the leaf slots, in order
  uint32_t first_vertex;      ///< base of the indices of the node's own triangles
  uint8_t slots[kBvhWidth];   ///< used ones first
  uint8_t low[3][kBvhWidth];  ///< the slot's box: (base + low) * scale to (base + high) * scale
  uint8_t high[3][kBvhWidth];
};
static_assert(sizeof(BvhNode) == 80);

NIF_HOST_DEVICE constexpr int32_t frame_base(uint32_t frame) { return int32_t(frame) >> 8; }
NIF_HOST_DEVICE constexpr float frame_scale(uint32_t frame) { return bits_as<float>((frame & 255) << 23); }
/// A plane of a slot's box. Exact, because base + step has at most 24 bits.
NIF_HOST_DEVICE constexpr float frame_plane(uint32_t frame, uint8_t step) {
  return static_cast<float>(frame_base(frame) + int32_t(step)) * frame_scale(frame);
}

/// One object in the `bvh` encoding (docs/encodings/bvh.md).
struct TrianglesField {
  const BvhNode* nodes = nullptr;           ///< [node_count], the first is the root
  const float (*vertices)[3] = nullptr;     ///< [vertex_count]; a node lies before them in memory
  const uint8_t (*triangles)[3] = nullptr;  ///< [triangle_count]: vertices, from the node's first on
  uint32_t node_count = 0, vertex_count = 0, triangle_count = 0;
  float extent = 0;  ///< largest coordinate of the root's frame, see bvh_extent()
};

/// No plane of a box lies farther than this from the origin of object space, along any axis.
NIF_HOST_DEVICE inline float bvh_extent(const BvhNode& root) {
  float extent = 0;
  for (const uint32_t frame : root.frame) {
    const float low = frame_plane(frame, 0), high = frame_plane(frame, 255);
    if (-low > extent) extent = -low;
    if (low > extent) extent = low;
    if (high > extent) extent = high;
  }
  return extent;
}

}  // namespace nif::kernels
