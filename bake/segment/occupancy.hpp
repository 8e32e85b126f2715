// The occupancy grid of an object: surface voxels, and what is proven of all others.
#pragma once

#include <string_view>

#include "bake/oracle/closure.hpp"
#include "bake/segment/voxelize.hpp"
#include "formats/nif/segment/encoding.hpp"

namespace nif::bake {

struct Occupancy {
  Grid grid;
  std::vector<uint8_t> states;  ///< kernels::VoxelState, one byte a voxel, in the order of Grid::index
  size_t surface_voxels = 0, inside_voxels = 0, unknown_voxels = 0;
};

/// Classifies every voxel. Voxels that share a face and are no surface can be joined by a path that meets no
/// triangle, so each connected region has one state: outside where it reaches the border of the grid; else
/// inside where it has a non-zero winding number about a closed component, outside where all of them are
/// zero, and unknown where numbers cannot be trusted or finding out would take too long.
Occupancy classify(const Grid& grid, const mesh::CleanMesh& mesh, std::vector<uint8_t> surface,
                   const ClosedComponents& closed);

/// Fills the grid, the bricks and the corner ranks of `data`, and zero features for every corner.
/// Throws Error(too_large) where the grid needs more mixed bricks than the format can number; `name` is what
/// the message calls the object.
void store_occupancy(const Occupancy& occupancy, uint32_t features_per_corner, std::string_view name,
                     format::SegmentData& data);

}  // namespace nif::bake
