// The sections of `segment` objects in a .nif file.
#pragma once

#include "formats/nif/layout.hpp"

namespace nif::format {

enum SegmentSection : uint32_t {
  kSegments = fourcc("SEGM"),   ///< SegmentRecord[]
  kNetworks = fourcc("NETS"),   ///< NetworkRecord[]
  kWeights = fourcc("WGTS"),    ///< each network's payload
  kFeatures = fourcc("FEAT"),   ///< each object's payload
  kOccupancy = fourcc("OCCU"),  ///< each object's payload
  kCells = fourcc("CELL"),      ///< each object's payload
};

struct SegmentRecord {  // 120 bytes: the members of kernels::SegmentField of the same names
  uint32_t network;     ///< index into kNetworks; objects may share one
  float origin[3];
  float voxels_per_unit;
  uint32_t voxels[3];
  uint32_t mixed_bricks;
  uint32_t corners;
  uint32_t features_per_corner;
  uint32_t samples;
  float length_scale;
  uint32_t levels;
  uint32_t surface_voxels;
  uint32_t part_count;
  uint32_t forms;     ///< PayloadForm
  uint32_t reserved;  ///< 0
  Payload occupancy;  ///< brick_states, brick_corners, corner_base, voxel_base, brick_table, in that order,
                      ///< without gaps
  Payload features;   ///< [corners][features_per_corner] int8
  Payload cells;      ///< voxel_records, parts, in that order, without gaps
};
static_assert(sizeof(SegmentRecord) == 120);

struct LayerRecord {  // 12 bytes
  uint32_t inputs, outputs, shift;
};

struct NetworkRecord {  // 80 bytes
  uint32_t layer_count;
  float logit_scale;
  LayerRecord layers[4];  ///< those beyond layer_count are 0
  int32_t threshold;      ///< what the last layer's bias already lacks
  uint32_t reserved;      ///< 0
  Payload weights;        ///< for each layer in turn, without gaps (inputs is a multiple of 4):
                          ///< int32 biases [outputs], int8 weights [outputs][inputs]
};
static_assert(sizeof(NetworkRecord) == 80);

}  // namespace nif::format
