// The `spherical` encoding in a .nif file: grids of latent vectors for each object, and pairs of networks.
#pragma once

#include <array>
#include <cstdint>
#include <memory_resource>
#include <vector>

#include "formats/nif/encoding_of.hpp"
#include "formats/nif/records.hpp"
#include "formats/nif/sections.hpp"
#include "formats/nif/spherical/layout.hpp"
#include "kernels/reference/spherical/field.hpp"

namespace nif::format {

/// Latent vectors of a `spherical` object; each array is [resolution][resolution][features], theta before
/// phi, `distance` is [resolution][features]. Where `half` is set, all values are such that half precision
/// holds.
struct SphericalGrids {
  bool half = false;
  uint32_t outer_resolution = 0, outer_features = 0;
  uint32_t inner_resolution = 0, inner_features = 0;
  uint32_t distance_resolution = 0, distance_features = 0;
  std::vector<float> outer_position, outer_direction, inner_position, inner_direction, distance;

  /// Of the payload that holds them in a file.
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
  bool half = false;  ///< as with grids
  float slope = 0.01f;
  SphericalLayers outer, inner;

  uint64_t bytes() const { return (half ? 2 : 4) * (outer.weights.size() + inner.weights.size()); }
};

/// What the `spherical` objects of an asset share.
struct SphericalShared {
  std::vector<SphericalNetworks> spherical_networks;
};

struct SphericalData {
  uint32_t network = 0;  ///< index into SphericalShared::spherical_networks
  SphericalGrids grids;
};

/// The kernels' view of an object; valid while both live and are not changed. The bounds must be such as
/// kernels::set_bounds() takes.
kernels::SphericalField field_of(const SphericalGrids& grids, const SphericalNetworks& networks,
                                 const Bounds& bounds);

/// Both networks of `spherical` objects.
struct SphericalNetworksView {
  kernels::SphericalNetwork outer, inner;
  float slope = 0;
  uint64_t bytes = 0;
};

/// As SphericalShared, in a file.
struct SphericalSharedView {
  explicit SphericalSharedView(std::pmr::memory_resource* memory) : spherical_networks(memory) {}

  uint32_t network_count() const { return uint32_t(spherical_networks.size()); }
  uint64_t network_bytes() const {
    uint64_t sum = 0;
    for (const SphericalNetworksView& pair : spherical_networks) sum += pair.bytes;
    return sum;
  }
  uint64_t view_bytes() const { return spherical_networks.capacity() * sizeof(SphericalNetworksView); }
  void drop_bytes() {
    for (SphericalNetworksView& networks : spherical_networks) networks = {};
  }

  std::pmr::vector<SphericalNetworksView> spherical_networks;
};

struct SphericalView {
  uint32_t network = 0;           ///< index into SphericalSharedView::spherical_networks
  kernels::SphericalField field;  ///< ready to be queried
  uint64_t grid_bytes = 0;

  std::array<PartBytes, 1> parts() const { return {{{"grids", grid_bytes}}}; }
  void drop_bytes() { *this = {}; }
};

/// As SegmentReader.
class SphericalReader {
 public:
  SphericalReader(const SectionTable& sections, std::string_view file, SphericalSharedView& shared);
  uint32_t count() const { return records_.count(); }
  SphericalView read(uint32_t index, const Bounds& bounds);
  void finish() const;

 private:
  std::string_view file_;
  SphericalSharedView& shared_;
  Records<SphericalRecord> records_;
  Payloads grids_;
};

class SphericalWriter {
 public:
  SphericalWriter(Sections& sections, const SphericalShared& shared);
  void add(const SphericalData& data);

 private:
  Section *records_, *grids_;
};

template <>
struct EncodingOf<kernels::SphericalField> {
  static constexpr uint32_t kNumber = 2;
  static constexpr const char* kName = "spherical";
  static constexpr uint32_t kSections[] = {kSphericalRecords, kSphericalNetworks, kSphericalWeights, kGrids};
  using Data = SphericalData;
  using Shared = SphericalShared;
  using View = SphericalView;
  using SharedView = SphericalSharedView;
  using Reader = SphericalReader;
  using Writer = SphericalWriter;

  static kernels::SphericalField field(const SphericalData& data, const SphericalShared& shared,
                                       const Bounds& bounds) {
    return field_of(data.grids, shared.spherical_networks.at(data.network), bounds);
  }
  static SphericalData to_data(const SphericalView& view);
  static SphericalShared to_shared(const SphericalSharedView& view);
};

}  // namespace nif::format
