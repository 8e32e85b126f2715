// Fields for primary rays in a .nif file: optional, for objects of any encoding.
#pragma once

#include <optional>
#include <vector>

#include "formats/nif/spherical/spherical_part.hpp"

namespace nif::format {

/// Answers primary rays of an object: grids like those of SphericalGrids, and a network with
/// kernels::kPrimaryOutputs outputs.
struct Primary {
  bool half_grids = false, half_network = false;  ///< as for SphericalGrids
  float slope = 0.01f;
  float margin = 0;  ///< as in kernels::PrimaryField
  uint32_t resolution = 0, features = 0;
  std::vector<float> position, direction;
  SphericalLayers network;

  /// Size of the payload in a file.
  uint64_t bytes() const {
    return (half_grids ? 2 : 4) * (position.size() + direction.size()) +
           (half_network ? 2 : 4) * network.weights.size();
  }
};

/// The kernels' view of it, for an object with these bounds, which kernels::set_bounds() must accept.
kernels::PrimaryField field_of(const Primary& primary, const Bounds& bounds);

/// Answers primary rays of one object that has such a field.
struct PrimaryView {
  uint32_t object = 0;          ///< index into AssetView::objects
  kernels::PrimaryField field;  ///< ready to be queried
  uint64_t grid_bytes = 0, network_bytes = 0;
};

std::optional<PrimaryView> read_record(const PrimaryRecord& record, const ObjectView& object,
                                       const Reading& reading);
Primary to_primary(const PrimaryView& view);

/// As formats/nif/optional.hpp requires.
struct PrimaryRecords {
  static constexpr uint32_t kRecords = kPrimaries, kValues = kPrimaryValues;
  static constexpr Rule kOrder = Rule::optional_order;
  using Record = PrimaryRecord;

  static uint64_t rank(const Record& record) { return record.object; }
  template <class Asset>
  static auto& of(Asset& asset) {
    return asset.primaries;
  }
  static bool has(const Object& object);
  static std::vector<Record> write(const Object& object, uint32_t number, Section& payloads);
};

}  // namespace nif::format
