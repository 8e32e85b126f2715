// A mesh with its ground truth and its occupancy, and features still zero: what most tests of the baker start
// from.
#pragma once

#include <memory>

#include "bake/oracle/prepare.hpp"
#include "bake/segment/occupancy.hpp"

namespace nif::test {

struct OccupiedObject {
  mesh::Mesh mesh;
  bake::Prepared prepared;
  bake::Occupancy occupancy;
  format::SegmentData data;
  format::Network network;  // without layers
  kernels::SegmentField field;
  std::unique_ptr<bake::GroundTruth> truth;

  OccupiedObject(mesh::Mesh source, uint32_t resolution)
      : mesh(std::move(source)), prepared(bake::prepare(mesh)) {
    const bake::Grid grid = bake::make_grid(prepared.box, resolution);
    const auto& surface = prepared.surface;
    occupancy = bake::classify(grid, surface, bake::voxelize(grid, surface.positions, surface.triangles),
                               prepared.closed);
    data.samples = 8;
    data.length_scale = 8;
    bake::store_occupancy(occupancy, 2, mesh.name, data);
    field = format::field_of(data, network);
    truth = std::make_unique<bake::GroundTruth>(prepared);
  }
  OccupiedObject(const OccupiedObject&) = delete;
  OccupiedObject& operator=(const OccupiedObject&) = delete;
};

}  // namespace nif::test
