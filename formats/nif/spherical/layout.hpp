// The sections of `spherical` objects in a .nif file, and of fields for primary rays.
#pragma once

#include "formats/nif/layout.hpp"

namespace nif::format {

enum SphericalSection : uint32_t {
  kSphericalRecords = fourcc("SPHR"),   ///< SphericalRecord[]
  kSphericalNetworks = fourcc("SNET"),  ///< SphericalNetworksRecord[]
};

/// Optional, for objects of any encoding: readers that do not know them still answer visibility. A file has
/// both or neither.
enum PrimarySection : uint32_t {
  kPrimaries = fourcc("PRIM"),      ///< PrimaryRecord[]
  kPrimaryValues = fourcc("PVAL"),  ///< each record's payload
};

/// Latent vectors along an axis of the grids, and the number of floats in each.
struct SphericalRecord {  // 40 bytes
  uint32_t network;       ///< index into kSphericalNetworks; objects may share one
  uint16_t outer_resolution, inner_resolution, distance_resolution;
  uint8_t outer_features, inner_features, distance_features;
  uint8_t half_grids;  ///< 1: in half precision, 0: in single
  uint16_t reserved;   ///< 0
  Payload
      grids;  ///< outer position, outer direction, inner position, inner direction, distance, without gaps
};
static_assert(sizeof(SphericalRecord) == 40);

/// The shape of a network of `spherical`: hidden layers of equal width, then its outputs.
struct SphericalShapeRecord {  // 12 bytes
  uint32_t inputs, width, hidden_layers;
};

/// The two networks of a `spherical` object.
struct SphericalNetworksRecord {  // 72 bytes
  uint32_t half;                  ///< 1: weights in half precision, 0: in single
  float slope;                    ///< of the leaky ReLU below 0
  SphericalShapeRecord outer, inner;
  uint32_t reserved[4];  ///< 0
  Payload weights;       ///< of outer, then of inner, layer by layer, [inputs][outputs] each, without gaps
};
static_assert(sizeof(SphericalNetworksRecord) == 72);

/// Answers primary rays of an object with any encoding.
struct PrimaryRecord {  // 72 bytes
  uint32_t object;      ///< index into kObjects; records are in the order of their objects
  uint16_t resolution;  ///< latent vectors along an axis of both grids
  uint8_t features;     ///< floats of each
  uint8_t half_grids;   ///< 1: in half precision, 0: in single
  uint32_t half_network;
  float slope;  ///< of the leaky ReLU below 0
  SphericalShapeRecord network;
  float margin;          ///< fraction of the AABB's diagonal, 0 to 1
  uint32_t reserved[4];  ///< 0
  Payload values;  ///< position, direction, then the network's layers, [inputs][outputs] each, without gaps
};
static_assert(sizeof(PrimaryRecord) == 72);

}  // namespace nif::format
