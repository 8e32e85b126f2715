// Checks the tree of a `bvh` object, so that its traversal needs no checks.
#pragma once

#include <optional>

#include "formats/nif/rules.hpp"
#include "kernels/reference/triangles/triangles_field.hpp"

namespace nif::format {

/// The rule that the tree breaks, if any. Its arrays must have their full lengths. A tree that passes is in
/// preorder, names each node and triangle once, and is no deeper than kMaxBvhDepth, with all vertices in
/// range and finite; each box contains what is below it, so the answer is that of a loop over all triangles.
std::optional<Rule> fault_of(const kernels::TrianglesField& field);

}  // namespace nif::format
