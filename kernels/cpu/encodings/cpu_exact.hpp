// The `exact` encoding in SIMD: many rays at a time traverse the grid, and those that stay open traverse the
// BVH.
#pragma once

#include "kernels/cpu/kernel_options.hpp"
#include "kernels/cpu/triangles/tree.hpp"
#include "kernels/packed/traversal_grid.hpp"
#include "kernels/reference/encodings/reference_exact.hpp"

namespace nif::kernels::cpu {

/// A field in the layout of the SIMD kernels: what they build from it, and the asset's own arrays.
struct PackedExactField {
  ExactField field;
  TraversalGrid grid;
  BvhTree tree;
  /// First hits of rays that start outside the triangles' box do without the grid.
  bool tree_alone = false;

  BuiltBytes built_bytes() const {
    return {.traversal_words = grid.resident_bytes(), .decoded_triangles = tree.decoded.bytes()};
  }
};

/// The field's memory must outlive the kernel.
KernelPointer make_kernel(const ExactField& field, const KernelOptions& options);

}  // namespace nif::kernels::cpu
