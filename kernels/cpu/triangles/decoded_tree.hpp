// The tree and the triangles of a `bvh` object, decoded at load for traversals that stay in the cache: planes of
// boxes as floats, corners of triangles in columns. A step reads them without any arithmetic to unpack them, for
// some five times the bytes.
//
// The largest triangles are not in the tree: every ray would come to them one by one. They are tested before it, a vector
// of rays at a time, and without them the boxes are smaller.
//
// Nodes are also filled up. A leaf of four triangles costs as much as a leaf of one, so leaves of a node are joined
// where rays meet their common box less often than both of theirs; and a node takes the place of its parent's slot
// where there is room for its children.
#pragma once

#include <cstdint>
#include <memory_resource>

#include "kernels/cpu/holes/blocking_boxes.hpp"
#include "kernels/reference/triangles/triangles_field.hpp"

namespace nif::kernels::cpu {

/// An object is decoded if that takes at most this many bytes: some 85,000 triangles. Larger ones, out of a core's
/// cache, are faster with few bytes (docs/results/cpu-kernels.md, "Decoded triangles").
inline constexpr size_t kMostDecoded = size_t{8} << 20;
/// Objects that are asked together, as those of an asset are, share the cache. If they have more triangles in all, not
/// counting objects that are too large by themselves, none is decoded: some 16 MiB (docs/results/cpu-kernels.md, "Cities").
inline constexpr size_t kMostTrianglesDecoded = 200'000;
/// Defined if any is. On a web page the code is too much to download, and Highway lacks doubles there.
#ifndef __wasm__
#define NIF_DECODES
#endif

/// What a slot of a node leads to: the number of a node; or that of a leaf times kBvhLeafTriangles, plus the number
/// of its triangles less one.
using Child = uint32_t;

/// A node. The slots in use come first, and of these the one to visit first is the last.
struct alignas(64) DecodedNode {
  float low[3][kBvhWidth], high[3][kBvhWidth];  ///< by axis; of an empty slot infinity and minus infinity
  Child children[kBvhWidth];
  /// By the signs of a ray's direction, bit `axis` if negative: slots from far to near, three bits each from bit
  /// 0 on; and from bit 24 on the inner slots, in the order of `children`.
  uint32_t order[8];
};
static_assert(sizeof(DecodedNode) == 256);

/// The triangles of a slot. Lanes that are not used repeat the last triangle.
struct alignas(16) DecodedLeaf {
  float corners[3][3][kBvhLeafTriangles];  ///< by corner and axis
  uint32_t triangles[kBvhLeafTriangles];   ///< of the object
};
static_assert(sizeof(DecodedLeaf) == 160);

/// At most this many triangles are large. Each is a bit of a word.
inline constexpr uint32_t kMostLarge = 16;
/// So many share a box.
inline constexpr uint32_t kLargeInBox = 4;
/// A triangle is large if at least this share of the rays that meet the object's box meet the triangle's; see
/// docs/results/cpu-kernels.md, "Large triangles".
inline constexpr double kLargeBox = 0.15;

/// A triangle that is tested before the tree (docs/encodings/bvh.md, "Large triangles").
struct alignas(16) LargeTriangle {
  float corners[3][4];  ///< by corner and axis; the last is 0
  float normal[4];      ///< of a plane, at most 1 along any axis; the last is 0
  float offset;         ///< the plane's: for its points, normal times point is this
  float flatness;       ///< for the triangle's points, it is off by at most this
  /// Rays whose slope is at most this times their padding squared must not use the plane. Infinity: no ray may.
  float steepness;
};

/// A box around at most kLargeInBox large triangles that lie close together.
struct LargeBox {
  float low[3], high[3];
  uint32_t triangles;  ///< as bits; 0: not in use, as those after it
};

struct DecodedTree {
  std::pmr::vector<DecodedNode> nodes;  ///< the first is the root; empty if the object is not decoded
  /// The large triangles are in the first ones, in their order; no node leads to these leaves.
  std::pmr::vector<DecodedLeaf> leaves;
  std::pmr::vector<LargeTriangle> large;
  LargeBox large_boxes[kMostLarge / kLargeInBox];
  /// No corner of a triangle and no plane of a box lies farther than this from the origin along any axis.
  float reach = 0;

  size_t bytes() const {
    return nodes.capacity() * sizeof(DecodedNode) + leaves.capacity() * sizeof(DecodedLeaf) +
           large.capacity() * sizeof(LargeTriangle);
  }
};

/// How many boxes a line meets that goes through the root's box anywhere and in any direction, on the mean; 0 if there
/// is no tree. By their surfaces.
double boxes_met(const DecodedTree& tree);

/// At best each triangle is stored with three others.
inline constexpr uint64_t least_decoded_bytes(uint64_t triangles) {
  return triangles * sizeof(DecodedLeaf) / kBvhLeafTriangles;
}

/// Decodes an object if that takes at most `most_bytes`, else returns an empty tree. `holes`: null if there are none.
/// Triangles with holes are not large. `moves`: no triangle is large, because any may become so.
DecodedTree decode(const TrianglesField& field, size_t most_bytes, std::pmr::memory_resource* memory,
                   const BlockingBoxes* holes = nullptr, bool moves = false);

}  // namespace nif::kernels::cpu
