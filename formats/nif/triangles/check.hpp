// Checks the tree of a `bvh` object, so that traversing it needs no checks.
#pragma once

#include <optional>

#include "formats/nif/rules.hpp"
#include "kernels/reference/triangles/field.hpp"

namespace nif::format {

/// The rule that the tree breaks, if it does. Its arrays must be there in
/// their lengths. What passes is a tree in preorder that names each node and triangle once, no deeper than
/// kMaxBvhDepth, with all vertices in range and finite; and each box holds what is below it, so the answer is
/// that of a loop over all triangles.
std::optional<Rule> fault_of(const kernels::TrianglesField& field);

}  // namespace nif::format
