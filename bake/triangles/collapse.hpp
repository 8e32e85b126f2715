// Turns a binary tree into one with eight slots per node.
#pragma once

#include <deque>

#include "bake/triangles/binary_tree.hpp"
#include "formats/nif/triangles/pack.hpp"

namespace nif::bake {

/// Of all trees with up to eight slots per node and kBvhLeafTriangles triangles per leaf that keep together what the binary tree
/// does, one in which rays test the fewest nodes and leaves, counted alike; but no branch has more than kMostLevels levels of
/// nodes. The first is the root. The others are reached from it by pointers, which stay valid when the deque is moved.
std::deque<format::BvhBranch> collapse(const BinaryTree& tree);

}  // namespace nif::bake
