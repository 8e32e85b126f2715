// The `proof` encoding in SIMD: many rays at a time traverse the grid.
#pragma once

#include "kernels/cpu/kernel_options.hpp"
#include "kernels/packed/traversal_grid.hpp"
#include "kernels/reference/planes/planes_field.hpp"

namespace nif::kernels::cpu {

/// A grid in the layout of the SIMD kernels.
struct PackedPlanesField {
  PlanesField field;
  TraversalGrid grid;

  BuiltBytes built_bytes() const { return {.traversal_words = grid.resident_bytes()}; }
};

/// The field's memory must outlive the kernel.
KernelPointer make_kernel(const PlanesField& field, const KernelOptions& options);

}  // namespace nif::kernels::cpu
