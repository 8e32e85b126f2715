// The memory behind proofs: where an object's surface may be, and the planes around it.
//
// Nothing here owns anything. The asset reader (formats/nif) fills it from a file, the baker from its own
// arrays; every kernel (reference, CPU, GPU) reads it. docs/format.md describes layout and meaning.
#pragma once

#include <cstdint>

namespace nif::kernels {

inline constexpr uint32_t kMaxVoxels = 256;  ///< along one axis of the occupancy grid
inline constexpr uint32_t kMaxLevels = 4;    ///< how often a voxel is cut in two along each axis, at most
inline constexpr uint32_t kMaxCells = 1024;  ///< finest cells along one axis
inline constexpr uint32_t kMaxChildren = 1 << 20;  ///< children of all voxels that are cut

/// A brick is a cube of 4 voxels along each axis. Bit x + 4 y + 16 z of its masks is one voxel (or the corner
/// at that voxel's low end).
inline constexpr uint32_t kBrickSide = 4;

/// Entries of the brick table below kFirstMixedBrick describe a brick whose voxels are all alike and that has
/// no corner.
enum BrickTableEntry : uint16_t {
  kBrickOutside = 0,
  kBrickInside = 1,
  kBrickUnknown = 2,
  kFirstMixedBrick = 3
};

/// States of the 64 voxels of a mixed brick, two bits each, stored as two words.
struct BrickStates {
  uint64_t surface;  ///< 1: a triangle touches the voxel
  uint64_t aux;      ///< if surface is 0: 0 outside, 1 inside; if surface is 1: 0 surface, 1 unknown
};

/// The planes part of an object: what a traversal reads (docs/encodings/segment.md).
struct PlanesField {
  // Voxel (i,j,k) covers origin + [i, i+1] / voxels_per_unit and so on, in object space. Cutting a voxel in
  // two along each axis `levels` times gives finest cells.
  float origin[3] = {};
  float voxels_per_unit = 0;
  float cells_per_unit = 0;   ///< finest cells: voxels_per_unit * 2^levels, exactly
  float voxels_per_cell = 1;  ///< 2^-levels
  uint32_t levels = 0;
  uint32_t voxels[3] = {};  ///< voxels along x, y, z
  uint32_t bricks[3] = {};  ///< bricks along x, y, z: enough for voxels + 1 corners

  uint32_t mixed_bricks = 0;
  const uint16_t* brick_table = nullptr;      ///< [bricks z][y][x]: BrickTableEntry, or kFirstMixedBrick + i
  const BrickStates* brick_states = nullptr;  ///< [i]
  const uint32_t* voxel_base = nullptr;       ///< [i]: index of the record of the brick's first surface voxel

  // What is known inside surface voxels: planes, or links to children (kernels/reference/planes/cells.hpp).
  const uint32_t* voxel_records = nullptr;  ///< [surface_voxels], in the order of bricks and their bits
  const uint32_t* children = nullptr;       ///< [child_count]
  uint32_t surface_voxels = 0;
  uint32_t child_count = 0;
};

/// Also sets the scales that follow from these.
inline void set_scales(float voxels_per_unit, uint32_t levels, PlanesField& field) {
  const float cells = static_cast<float>(1u << levels);
  field.levels = levels;
  field.voxels_per_unit = voxels_per_unit;
  field.cells_per_unit = voxels_per_unit * cells;
  field.voxels_per_cell = 1 / cells;
}

}  // namespace nif::kernels
