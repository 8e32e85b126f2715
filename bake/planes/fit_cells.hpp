// Finds what can be proven within surface voxels: planes around the triangles of each cell, walls and sides.
#pragma once

#include <string_view>

#include "bake/planes/voxelize.hpp"
#include "formats/nif/planes/planes_part.hpp"

namespace nif::bake {

struct CellCounts {
  size_t children = 0;  ///< of all voxels that are cut
  size_t planes = 0;    ///< cells with planes
  size_t walls = 0;     ///< of those, with a wall
  size_t bare = 0;      ///< of those, that prove nothing
};

/// Fills voxel_base, voxel_records and children of `data`, in which store_occupancy() has put the rest of the
/// grid. A cell is cut if its planes are more than `thickness` finest cells apart, or half of that if there
/// is no wall. If that makes more than `most_children`, the thickness is doubled, and so on. `thickness` must
/// be above 0; `name` is what messages call the object. Runs on all threads; the result does not depend on
/// their number.
CellCounts fit_cells(const Grid& grid, const mesh::CleanMesh& mesh, const SurfaceVoxels& surface,
                     double thickness, std::string_view name, format::PlanesData& data,
                     size_t most_children = kernels::kMaxChildren);

/// The last step of fit_cells(): finds which sides of planes are outside and inside, and stores that in their
/// kinds, whose walls it keeps. Throws Error(internal) if planes join outside with inside.
CellCounts set_sides(std::string_view name, format::PlanesData& data);

}  // namespace nif::bake
