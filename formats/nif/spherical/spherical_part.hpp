// The paper's fields as files store them: grids of latent vectors for each object, and pairs of networks,
// which objects may share.
#pragma once

#include <array>
#include <cstdint>
#include <memory_resource>
#include <vector>

#include "formats/nif/layout.hpp"
#include "formats/nif/part_bytes.hpp"
#include "formats/nif/records.hpp"
#include "formats/nif/sections.hpp"
#include "kernels/reference/spherical/spherical_field.hpp"

namespace nif::format {

/// The sections of `spherical` objects in a .nif file, and of fields for primary rays.
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

struct Asset;
struct AssetView;
struct Object;
struct ObjectView;

/// Latent vectors of a `spherical` object; each array is [resolution][resolution][features], theta before
/// phi, `distance` is [resolution][features]. If `half` is set, all values are exact in half precision.
struct SphericalGrids {
  bool half = false;
  uint32_t outer_resolution = 0, outer_features = 0;
  uint32_t inner_resolution = 0, inner_features = 0;
  uint32_t distance_resolution = 0, distance_features = 0;
  std::vector<float> outer_position, outer_direction, inner_position, inner_direction, distance;

  /// Size of the payload in a file.
  uint64_t bytes() const {
    return (half ? 2 : 4) * (outer_position.size() + outer_direction.size() + inner_position.size() +
                             inner_direction.size() + distance.size());
  }
};

struct SphericalLayers {
  uint32_t inputs = 0, width = 0, hidden_layers = 0;
  std::vector<float> weights;  ///< layer by layer, [inputs][outputs] each
};

/// Both networks of one or several `spherical` objects.
struct SphericalNetworks {
  bool half = false;  ///< as for grids
  float slope = 0.01f;
  SphericalLayers outer, inner;

  uint64_t bytes() const { return (half ? 2 : 4) * (outer.weights.size() + inner.weights.size()); }
};

struct SphericalData {
  uint32_t network = 0;  ///< index into Asset::spherical_networks
  SphericalGrids grids;
};

/// The kernels' view of an object; valid while both live and do not change. kernels::set_bounds() must accept
/// the bounds.
kernels::SphericalField field_of(const SphericalGrids& grids, const SphericalNetworks& networks,
                                 const Bounds& bounds);

/// Both networks of `spherical` objects.
struct SphericalNetworksView {
  kernels::SphericalNetwork outer, inner;
  float slope = 0;
  uint64_t bytes = 0;
};

struct SphericalView {
  uint32_t network = 0;           ///< index into AssetView::spherical_networks
  kernels::SphericalField field;  ///< ready to be queried
  uint64_t grid_bytes = 0;

  std::array<PartBytes, 1> parts() const { return {{{"grids", grid_bytes}}}; }
  void drop_bytes() { *this = {}; }
};

/// As formats/nif/parts.hpp requires.
struct PairsOfNetworks {
  static constexpr uint32_t kRecords = kSphericalNetworks;
  using Record = SphericalNetworksRecord;

  template <class Asset>
  static auto& of(Asset& asset) {
    return asset.spherical_networks;
  }
};

struct SphericalPart {
  static constexpr const char* kName = "spherical";
  static constexpr uint32_t kRecords = kSphericalRecords;
  using Record = SphericalRecord;
  using Data = SphericalData;
  using View = SphericalView;
  using Shared = PairsOfNetworks;

  template <class Held>
  struct Member {
    Held spherical{};
  };

  template <class Object>
  static auto& of(Object& object) {
    return object.spherical;
  }
};

SphericalNetworksView read_record(const SphericalNetworksRecord& record, const Reading& reading);
SphericalNetworksRecord write_record(const SphericalNetworks& networks, Section& payloads);
SphericalView read_record(const SphericalRecord& record, const ObjectView& object, const Reading& reading);
SphericalRecord write_record(const SphericalData& data, const Object& object, Section& payloads);
SphericalData to_data(const SphericalView& view);
SphericalNetworks to_networks(const SphericalNetworksView& view);

}  // namespace nif::format
