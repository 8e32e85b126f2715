// The sections of `proof` objects in a .nif file.
#pragma once

#include "formats/nif/layout.hpp"

namespace nif::format {

enum ProofSection : uint32_t {
  kProofRecords = fourcc("PROF"),    ///< ProofRecord[]
  kProofOccupancy = fourcc("POCC"),  ///< each object's payload
  kProofCells = fourcc("PCEL"),      ///< each object's payload
};

struct ProofRecord {  // 80 bytes: the members of kernels::ProofField of the same names
  float origin[3];
  float voxels_per_unit;
  uint32_t voxels[3];
  uint32_t levels;
  uint32_t mixed_bricks;
  uint32_t surface_voxels;
  uint32_t part_count;
  uint32_t forms;     ///< PayloadForm: kProofForms
  Payload occupancy;  ///< brick_states, voxel_base, brick_table, in that order, without gaps
  Payload cells;      ///< voxel_records, parts, in that order, without gaps
};
static_assert(sizeof(ProofRecord) == 80);

}  // namespace nif::format
