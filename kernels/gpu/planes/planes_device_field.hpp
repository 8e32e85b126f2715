// A grid with planes in device memory.
#pragma once

#include "kernels/packed/traversal_words.hpp"
#include "kernels/reference/planes/planes_field.hpp"

namespace nif::kernels::gpu {

/// The members of a PlanesField that cross from the runtime to the GPU module.
template <class Hash>
constexpr void describe_planes(Hash& hash) {
  using F = PlanesField;
  hash.template structure<BrickStates>({&BrickStates::surface, &BrickStates::aux});
  hash.template structure<F>({&F::origin, &F::voxels_per_unit, &F::cells_per_unit, &F::voxels_per_cell,
                              &F::levels, &F::voxels, &F::bricks, &F::mixed_bricks, &F::brick_table,
                              &F::brick_states, &F::voxel_base, &F::voxel_records, &F::children,
                              &F::surface_voxels, &F::child_count});
}

/// The grid's own arrays stay on the host: TraversalWords replace them.
inline void leave_arrays(PlanesField& field) {
  field.brick_table = nullptr;
  field.brick_states = nullptr;
  field.voxel_base = nullptr;
  field.voxel_records = nullptr;
  field.children = nullptr;
}

}  // namespace nif::kernels::gpu
