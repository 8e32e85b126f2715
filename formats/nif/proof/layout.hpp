// The sections of `proof` objects in a .nif file, and what objects with a grid of any encoding may have.
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

/// Optional, both or none.
enum ColorSection : uint32_t {
  kColorRecords = fourcc("COLR"),  ///< ColorsRecord[]
  kColorValues = fourcc("CVAL"),   ///< each record's payload
};

/// The mean base colours of an object's surface, voxel by voxel.
struct ColorsRecord {       // 32 bytes
  uint32_t object;          ///< index into kObjects; records lie in the order of their objects
  uint32_t surface_voxels;  ///< of the object
  uint32_t reserved[2];     ///< 0
  Payload values;           ///< 16 bits for each surface voxel: kernels::VoxelColors
};
static_assert(sizeof(ColorsRecord) == 32);

}  // namespace nif::format
