// The start of most tests of the baker: a mesh with its ground truth, its occupancy and its planes, with
// features that are still zero.
#pragma once

#include <memory>

#include "bake/ground_truth/prepare.hpp"
#include "bake/network/corner_features.hpp"
#include "bake/planes/fit_cells.hpp"
#include "tests/support/cell_flaws.hpp"

namespace nif::test {

/// How cells are made.
struct CellOptions {
  uint32_t levels = 0;
  double thickness = 1.5;                     ///< times the bias
  double padding = kernels::kSurfacePadding;  ///< of voxels
  CellFlaw flaw = nullptr;
  bool bare = false;  ///< no planes that prove anything, so that many rays are open
};

struct OccupiedObject {
  mesh::Mesh mesh;
  bake::Prepared prepared;
  bake::Occupancy occupancy;
  bake::CellCounts cells;
  format::Object object;        ///< its planes and its network, whose features are zero
  kernels::SegmentField field;  ///< without layers
  std::unique_ptr<bake::GroundTruth> truth;

  OccupiedObject(mesh::Mesh source, uint32_t resolution, const CellOptions& options = {})
      : mesh(std::move(source)), prepared(bake::prepare(mesh)) {
    const bake::Grid grid = bake::make_grid(prepared.box, resolution, options.levels);
    const bake::SurfaceVoxels surface = bake::voxelize(grid, prepared.surface, options.padding);
    occupancy = bake::classify(grid, prepared.surface, surface.marks, prepared.closed);
    object.name = mesh.name;
    object.planes.emplace();
    object.network.emplace();
    object.network->samples = 8;
    object.network->length_scale = 8;
    bake::store_occupancy(occupancy, 2, object);
    const double thickness = options.thickness * prepared.bias * grid.voxels_per_unit * grid.cells();
    cells = bake::fit_cells(grid, prepared.surface, surface, thickness, mesh.name, *object.planes);
    if (options.flaw) options.flaw(*object.planes);
    if (options.bare) format::leave_bare(*object.planes);
    field = format::field_of(object, {});
    truth = std::make_unique<bake::GroundTruth>(prepared);
  }
  OccupiedObject(const OccupiedObject&) = delete;
  OccupiedObject& operator=(const OccupiedObject&) = delete;
};

}  // namespace nif::test
