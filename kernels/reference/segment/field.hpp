// The memory that answers a query: one object's field as plain pointers into a loaded asset.
//
// Nothing here owns anything. The asset reader (formats/nif) fills these from a file, the baker from its
// own arrays; every kernel (reference, CPU, GPU) reads them. Layout and meaning: docs/format.md.
#pragma once

#include <cstdint>

#include "kernels/reference/ray.hpp"

namespace nif::kernels {

inline constexpr uint32_t kMaxVoxels = 256;     ///< along one axis of the occupancy grid
inline constexpr uint32_t kMaxLevels = 4;       ///< how often a voxel is cut in two along each axis, at most
inline constexpr uint32_t kMaxCells = 1024;     ///< finest cells along one axis
inline constexpr uint32_t kMaxParts = 1 << 20;  ///< parts of all voxels that are cut
inline constexpr uint32_t kMaxFeatures = 8;     ///< features per corner
inline constexpr uint32_t kMaxSamples = 32;     ///< points placed along one segment
inline constexpr uint32_t kMaxLayers = 4;       ///< hidden layers + the output layer
inline constexpr uint32_t kMaxWidth = 128;      ///< neurons of a hidden layer
inline constexpr uint32_t kGlobalInputs = 8;    ///< inputs that are not features: direction, lengths, flags
/// Features of each point, heights of the points, and the others.
inline constexpr uint32_t kMaxInputs = (kMaxFeatures + 1) * kMaxSamples + kGlobalInputs;
constexpr uint32_t input_count(uint32_t samples, uint32_t features_per_corner) {
  return samples * (features_per_corner + 1) + kGlobalInputs;
}
inline constexpr int32_t kMaxBias = 1 << 26;  ///< |bias|; leaves room for 32-bit sums of the largest layer
inline constexpr int32_t kMaxThreshold = 2 * kMaxBias;  ///< |threshold|: more than any output can need
inline constexpr uint32_t kMaxShift = 24;

/// A brick is a cube of 4 voxels along each axis; bit x + 4 y + 16 z of its masks is one voxel (or the corner
/// at that voxel's low end).
inline constexpr uint32_t kBrickSide = 4;

/// Entries of the brick table below kFirstMixedBrick say that the whole brick is alike and has no corner.
enum BrickTableEntry : uint16_t {
  kBrickOutside = 0,
  kBrickInside = 1,
  kBrickUnknown = 2,
  kFirstMixedBrick = 3
};

/// States of the 64 voxels of a mixed brick, two bits each, kept as two words.
struct BrickStates {
  uint64_t surface;  ///< 1: a triangle touches the voxel
  uint64_t aux;      ///< where surface is 0: 0 outside, 1 inside; where surface is 1: 0 surface, 1 unknown
};

/// A multilayer perceptron in integers: activations 0..127, weights -127..127, 32-bit sums.
/// Layer l: y = clamp((W x + b + round) >> shift, 0, 127); the last layer's single sum is the logit.
struct Network {
  struct Layer {
    uint32_t inputs;        ///< columns of W, a multiple of 4
    uint32_t outputs;       ///< rows of W
    uint32_t shift;         ///< rescaling of the sums; unused in the last layer
    const int8_t* weights;  ///< row-major [outputs][inputs]
    const int32_t* biases;  ///< [outputs]
  };
  uint32_t layer_count = 0;
  Layer layers[kMaxLayers] = {};
  Calibration calibration;  ///< its threshold is taken off the last layer's bias already
};

/// One object in the `segment` encoding (docs/encodings/segment.md).
struct SegmentField {
  // Voxel (i,j,k) covers origin + [i, i+1] / voxels_per_unit and so on, in object space. A finest cell is
  // what cutting a voxel in two along each axis `levels` times leaves.
  float origin[3] = {};
  float voxels_per_unit = 0;
  float cells_per_unit = 0;   ///< finest cells: voxels_per_unit * 2^levels, exactly
  float voxels_per_cell = 1;  ///< 2^-levels
  uint32_t levels = 0;
  uint32_t voxels[3] = {};  ///< voxels along x, y, z
  uint32_t bricks[3] = {};  ///< bricks along x, y, z: enough for voxels + 1 corners

  const uint16_t* brick_table = nullptr;      ///< [bricks z][y][x]: BrickTableEntry, or kFirstMixedBrick + i
  const BrickStates* brick_states = nullptr;  ///< [i]
  const uint64_t* brick_corners = nullptr;    ///< [i]: which corners have features
  const uint32_t* corner_base = nullptr;      ///< [i]: index of the brick's first corner
  const uint32_t* voxel_base = nullptr;       ///< [i]: index of the record of the brick's first surface voxel
  uint32_t mixed_bricks = 0;

  // What is known within surface voxels: planes, or links to parts (kernels/reference/segment/cells.hpp).
  const uint32_t* voxel_records = nullptr;  ///< [surface_voxels], in the order of bricks and their bits
  const uint32_t* parts = nullptr;          ///< [part_count]
  uint32_t surface_voxels = 0;
  uint32_t part_count = 0;

  const int8_t* features = nullptr;  ///< [corners][features_per_corner], -127..127
  uint32_t corners = 0;
  uint32_t features_per_corner = 0;  ///< F
  uint32_t samples = 0;              ///< K, a multiple of 4
  float length_scale = 0;            ///< input units per finest cell of open length

  Network network;
};

}  // namespace nif::kernels
