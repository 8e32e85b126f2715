// The paper's fields as files store them: grids of latent vectors for each object, and pairs of networks,
// which objects may share.
#pragma once

#include <array>
#include <cstdint>
#include <memory_resource>
#include <vector>

#include "formats/nif/part_bytes.hpp"
#include "formats/nif/records.hpp"
#include "formats/nif/sections.hpp"
#include "formats/nif/spherical/layout.hpp"
#include "kernels/reference/spherical/field.hpp"

namespace nif::format {

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
