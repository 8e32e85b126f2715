// Packs a tree over triangles into the nodes, vertices and triangles of a `bvh` object.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "formats/nif/asset.hpp"

namespace nif::format {

/// A tree with up to eight branches per node, as a builder makes it: inner nodes have children, leaves
/// triangles.
struct BvhBranch {
  uint32_t child_count = 0;  ///< 0: a leaf
  uint32_t triangle_count = 0;
  BvhBranch* children[kernels::kBvhWidth] = {};
  uint32_t triangles[kernels::kBvhLeafTriangles] = {};  ///< indices
  float low[3] = {}, high[3] = {};                      ///< filled in by pack_bvh()
};

/// Packs the tree as a file stores it: nodes and triangles in preorder, boxes rounded outwards, vertices in
/// the order of use. Coordinates must be at most kMaxBvhCoordinate / 4. `order`, if not null, receives the
/// index of each triangle of the object among `triangles`, and `sources` that of each vertex among `positions`.
/// Throws Error(internal) if the tree is deeper than kMaxBvhDepth.
TrianglesData pack_bvh(BvhBranch& root, std::span<const std::array<float, 3>> positions,
                       std::span<const std::array<uint32_t, 3>> triangles,
                       std::vector<uint32_t>* order = nullptr, std::vector<uint32_t>* sources = nullptr);

}  // namespace nif::format
