// Builds a binary tree, improves it, makes wide nodes of it (binary_tree.cpp, reinsert.cpp, collapse.cpp), and sorts their children
// (order.cpp); formats/nif packs the result.
#include "bake/triangles/builder.hpp"

#include <algorithm>
#include <cmath>
#include <deque>

#include "bake/triangles/binary_tree.hpp"
#include "bake/triangles/collapse.hpp"
#include "bake/triangles/order.hpp"
#include "bake/triangles/reinsert.hpp"
#include "formats/nif/triangles/pack.hpp"
#include "kernels/reference/triangles/refit.hpp"

namespace nif::bake {

bool fits_bvh(std::span<const mesh::Float3> positions) {
  return std::all_of(positions.begin(), positions.end(), [](const mesh::Float3& p) {
    return std::all_of(p.begin(), p.end(),
                       [](float x) { return std::abs(x) <= kernels::kMaxVertexCoordinate; });
  });
}

format::TrianglesData build_bvh(std::span<const mesh::Float3> positions,
                                std::span<const mesh::Triangle> triangles, std::vector<uint32_t>* order,
                                std::vector<uint32_t>* sources) {
  BinaryTree binary = build_binary_tree(positions, triangles);
  reinsert_nodes(binary);
  std::deque<format::BvhBranch> branches = collapse(binary);
  format::BvhBranch& root = branches.front();
  order_children(root, positions, triangles);
  return format::pack_bvh(root, positions, triangles, order, sources);
}

}  // namespace nif::bake
