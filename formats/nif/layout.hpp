// Every byte of a .nif file, version 1. docs/format.md says why; the two must agree.
//
// Little-endian; structures below are stored as they stand (all members are naturally aligned, no padding).
#pragma once

#include <cstdint>

namespace nif::format {

/// As in PNG and KTX2: a byte over 127 exposes a 7-bit transfer, CR LF and LF expose text-mode conversion,
/// and Ctrl-Z stops a careless `type`. Also tells our files from NetImmerse/Gamebryo's, which start with
/// plain text.
inline constexpr uint8_t kIdentifier[12] = {0xAB, 'N', 'I', 'F', ' ', '1', '0', 0xBB, '\r', '\n', 0x1A, '\n'};
inline constexpr uint32_t kVersion = 1;
inline constexpr uint64_t kAlignment = 64;  ///< of every section and of every block within a section
inline constexpr uint32_t kMaxSections = 64;

struct Header {  // 64 bytes, at offset 0; the section table follows at once
  uint8_t identifier[12];
  uint32_t version;
  uint64_t file_bytes;
  uint32_t section_count;
  uint32_t table_crc;    ///< CRC-32C of the section table
  uint32_t header_crc;   ///< CRC-32C of this header with header_crc as 0
  uint32_t reserved[7];  ///< 0
};
static_assert(sizeof(Header) == 64);

constexpr uint32_t fourcc(const char (&text)[5]) {
  return uint32_t(uint8_t(text[0])) | uint32_t(uint8_t(text[1])) << 8 | uint32_t(uint8_t(text[2])) << 16 |
         uint32_t(uint8_t(text[3])) << 24;
}

enum SectionType : uint32_t {
  kMetadata = fourcc("META"),   ///< JSON, UTF-8; optional
  kObjects = fourcc("OBJS"),    ///< ObjectRecord[]
  kInstances = fourcc("INST"),  ///< InstanceRecord[]
  kNames = fourcc("NAME"),      ///< names in UTF-8, of all objects, then of all instances, each ended by a 0
  kNetworks = fourcc("NETS"),   ///< NetworkRecord[]
  kWeights = fourcc("WGTS"),    ///< each network's block
  kOccupancy = fourcc("OCCU"),  ///< each object's block
  kFeatures = fourcc("FEAT"),   ///< each object's block
  kBvhs = fourcc("BVHS"),       ///< each `bvh` object's block; there only where there is such an object
  // There only where there is a `spherical` object.
  kSphericalNetworks = fourcc("SNET"),  ///< SphericalNetworksRecord[]
  kSphericalWeights = fourcc("SWGT"),   ///< each record's block
  kGrids = fourcc("GRID"),              ///< each `spherical` object's block
  // Optional: readers that do not know them answer visibility all the same. Either both are there or neither.
  kPrimaries = fourcc("PRIM"),      ///< PrimaryRecord[]
  kPrimaryValues = fourcc("PVAL"),  ///< each record's block
};

enum SectionFlags : uint32_t {
  kRequired = 1
};  ///< a reader that does not know a required section must refuse

struct SectionEntry {  // 32 bytes, sorted by offset
  uint32_t type;
  uint32_t flags;
  uint64_t offset;    ///< from the start of the file, a multiple of kAlignment
  uint64_t bytes;     ///< without the zeros up to the next section
  uint32_t crc;       ///< CRC-32C of those bytes
  uint32_t reserved;  ///< 0
};
static_assert(sizeof(SectionEntry) == 32);

/// A block within a section. Blocks stand in the order of their records, each at the next multiple of
/// kAlignment.
struct Block {
  uint64_t offset;  ///< from the start of the section
  uint64_t bytes;
};

struct Name {
  uint32_t offset, bytes;  ///< in kNames; bytes without the 0 that follows
};

enum Encoding : uint32_t { kSegment = 1, kSpherical = 2, kBvh = 3 };

struct ObjectRecord {  // 192 bytes
  uint32_t encoding;
  uint32_t network;  ///< index into kNetworks, of `spherical` into kSphericalNetworks; objects may share one;
                     ///< 0 for `bvh`
  Name name;
  float aabb_min[3], aabb_max[3];
  float bias;          ///< distance from the surface at which shadow rays start, object units
  uint32_t triangles;  ///< of the source mesh, after cleaning (saturated at 2^32 - 1)

  // `segment`: the members of kernels::SegmentField of the same names. 0 for others, as what is below for it.
  float origin[3];
  float voxels_per_unit;
  uint32_t voxels[3];
  uint32_t mixed_bricks;
  uint32_t corners;
  uint32_t features_per_corner;
  uint32_t samples;
  float length_scale;
  Block occupancy;  ///< brick_states, brick_corners, corner_base, brick_table, in that order, without gaps
  Block features;   ///< [corners][features_per_corner] int8

  // `bvh`: those of kernels::BvhField.
  Block bvh;  ///< nodes, vertices, triangles, in that order, without gaps
  uint32_t bvh_nodes, bvh_vertices, bvh_triangles;

  // `spherical`: latent vectors along an axis of the grids, and floats of each.
  uint16_t outer_resolution, inner_resolution;
  Block grids;  ///< outer position, outer direction, inner position, inner direction, distance, without gaps
  uint16_t distance_resolution;
  uint8_t outer_features, inner_features, distance_features;
  uint8_t half_grids;      ///< 1: in half precision, 0: in single
  uint16_t reserved_half;  ///< 0
  uint32_t reserved[2];    ///< 0
};
static_assert(sizeof(ObjectRecord) == 192);

struct InstanceRecord {  // 64 bytes
  float transform[12];   ///< object to world, row-major 3x4
  uint32_t object;
  Name name;
  uint32_t reserved;  ///< 0
};
static_assert(sizeof(InstanceRecord) == 64);

struct LayerRecord {  // 12 bytes
  uint32_t inputs, outputs, shift;
};

struct NetworkRecord {  // 80 bytes
  uint32_t layer_count;
  float logit_scale;
  LayerRecord layers[4];  ///< those beyond layer_count are 0
  uint64_t reserved;      ///< 0
  Block weights;          ///< for each layer in turn, without gaps (inputs is a multiple of 4):
                          ///< int32 biases [outputs], int8 weights [outputs][inputs]
};
static_assert(sizeof(NetworkRecord) == 80);

/// The shape of a network of `spherical`: hidden layers of one width, then its outputs.
struct SphericalShapeRecord {  // 12 bytes
  uint32_t inputs, width, hidden_layers;
};

/// The two networks of a `spherical` object.
struct SphericalNetworksRecord {  // 64 bytes
  uint32_t half;                  ///< 1: weights in half precision, 0: in single
  float slope;                    ///< of the leaky ReLU below 0
  SphericalShapeRecord outer, inner;
  uint32_t reserved[4];  ///< 0
  Block weights;         ///< of outer, then of inner, layer by layer, [inputs][outputs] each, without gaps
};
static_assert(sizeof(SphericalNetworksRecord) == 64);

/// What answers primary rays of an object, of whatever encoding.
struct PrimaryRecord {  // 64 bytes
  uint32_t object;      ///< index into kObjects; records stand in the order of their objects
  uint16_t resolution;  ///< latent vectors along an axis of both grids
  uint8_t features;     ///< floats of each
  uint8_t half_grids;   ///< 1: in half precision, 0: in single
  uint32_t half_network;
  float slope;  ///< of the leaky ReLU below 0
  SphericalShapeRecord network;
  float margin;          ///< part of the AABB's diagonal, 0 to 1
  uint32_t reserved[4];  ///< 0
  Block values;  ///< position, direction, then the network's layers, [inputs][outputs] each, without gaps
};
static_assert(sizeof(PrimaryRecord) == 64);

}  // namespace nif::format
