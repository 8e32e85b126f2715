// Improves a binary tree.
#pragma once

#include "bake/triangles/binary_tree.hpp"

namespace nif::bake {

/// Takes nodes out of the tree and puts them back where rays meet fewer boxes, in rounds, until a round gains little. Leaves stay
/// together. No move lets the sum of the inner nodes' surfaces grow, or a node get higher than kMostHeight. Uses all threads of the
/// calling arena; the result does not depend on their number.
void reinsert_nodes(BinaryTree& tree);

}  // namespace nif::bake
