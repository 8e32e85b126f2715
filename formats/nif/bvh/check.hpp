// Checks the tree of a `bvh` object, so that traversing it needs no checks.
#pragma once

#include "kernels/reference/bvh/field.hpp"

namespace nif::format {

/// What is wrong with the tree, as part of a sentence; null where nothing is. Its arrays must be there in
/// their lengths. What passes is a tree in preorder that names each node and triangle once, no deeper than
/// kMaxBvhDepth, with all vertices in range and finite; and each box holds what is below it, so the answer is
/// that of a loop over all triangles.
const char* fault_of(const kernels::BvhField& field);

}  // namespace nif::format
