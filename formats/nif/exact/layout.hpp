// The sections of `exact` objects in a .nif file.
#pragma once

#include "formats/nif/layout.hpp"

namespace nif::format {

enum ExactSection : uint32_t {
  kExactRecords = fourcc("EXCT"),    ///< ExactRecord[]
  kExactOccupancy = fourcc("EOCC"),  ///< each object's payload
  kExactCells = fourcc("ECEL"),      ///< each object's payload
  kExactTrees = fourcc("EBVH"),      ///< each object's payload
};

struct ExactRecord {  // 112 bytes: the members of kernels::ProofField and BvhField of the same names
  float origin[3];
  float voxels_per_unit;
  uint32_t voxels[3];
  uint32_t levels;
  uint32_t mixed_bricks;
  uint32_t surface_voxels;
  uint32_t part_count;
  uint32_t forms;  ///< PayloadForm: kProofForms
  uint32_t nodes, vertices, triangles;
  uint32_t reserved;  ///< 0
  Payload occupancy;  ///< brick_states, voxel_base, brick_table, in that order, without gaps
  Payload cells;      ///< voxel_records, parts, in that order, without gaps
  Payload tree;       ///< nodes, vertices, triangles, in that order, without gaps
};
static_assert(sizeof(ExactRecord) == 112);

}  // namespace nif::format
