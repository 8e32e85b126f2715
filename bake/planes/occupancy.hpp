// Makes the occupancy grid of an object: surface voxels, and what is proven about all others.
#pragma once

#include <string_view>

#include "bake/ground_truth/closure.hpp"
#include "bake/planes/voxelize.hpp"
#include "formats/nif/planes/planes_part.hpp"

namespace nif::bake {

struct Occupancy {
  Grid grid;
  std::vector<uint8_t> states;  ///< kernels::VoxelState, one byte per voxel, in the order of Grid::index
  size_t surface_voxels = 0, inside_voxels = 0, unknown_voxels = 0;
};

/// Classifies every voxel. Voxels without surface that share a face can be joined by a path that meets no
/// triangle, so each connected region has one state: outside if it reaches the border of the grid; else
/// inside if it has a non-zero winding number about a closed component, outside if all of them are zero, and
/// unknown if the numbers cannot be trusted or finding out would take too long.
Occupancy classify(const Grid& grid, const mesh::CleanMesh& mesh, std::vector<uint8_t> surface,
                   const ClosedComponents& closed);

/// Fills the grid and the bricks of `data`. `corners`, if features need some: receives the corners of each
/// mixed brick that a surface voxel touches; a brick with any is mixed. Throws Error(too_large) if the grid
/// needs more mixed bricks than the format can number; `name` is what the message calls the object.
void store_occupancy(const Occupancy& occupancy, std::string_view name, format::PlanesData& data,
                     std::vector<uint64_t>* corners = nullptr);

}  // namespace nif::bake
