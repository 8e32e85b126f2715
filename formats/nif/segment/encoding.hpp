// The `segment` encoding in a .nif file: an occupancy grid, features and a network for each object.
#pragma once

#include <array>
#include <cstdint>
#include <memory_resource>
#include <vector>

#include "formats/nif/encoding_of.hpp"
#include "formats/nif/records.hpp"
#include "formats/nif/sections.hpp"
#include "formats/nif/segment/layout.hpp"
#include "kernels/reference/segment/field.hpp"

namespace nif::format {

struct Layer {
  uint32_t inputs = 0, outputs = 0, shift = 0;
  std::vector<int32_t> biases;  ///< [outputs]
  std::vector<int8_t> weights;  ///< [outputs][inputs]
};

struct Network {
  std::vector<Layer> layers;
  float logit_scale = 1;
};

/// What the `segment` objects of an asset share.
struct SegmentShared {
  std::vector<Network> networks;
};

/// One object; members as in kernels::SegmentField.
struct SegmentData {
  uint32_t network = 0;  ///< index into SegmentShared::networks
  std::array<float, 3> origin{};
  float voxels_per_unit = 0;
  uint32_t levels = 0;
  std::array<uint32_t, 3> voxels{};
  std::vector<uint16_t> brick_table;
  std::vector<kernels::BrickStates> brick_states;
  std::vector<uint64_t> brick_corners;
  std::vector<uint32_t> corner_base;
  std::vector<uint32_t> voxel_base;
  std::vector<uint32_t> voxel_records;
  std::vector<uint32_t> parts;
  std::vector<int8_t> features;
  uint32_t corners = 0;
  uint32_t features_per_corner = 0;
  uint32_t samples = 0;
  float length_scale = 0;
};

/// Bricks along one axis that hold voxels + 1 corners.
constexpr uint32_t bricks_for(uint32_t voxels) { return voxels / kernels::kBrickSide + 1; }

/// Sets what belongs to a scale of a field: `length_scale` is in input units per voxel, as a file has it.
inline void set_scales(float voxels_per_unit, float length_scale, uint32_t levels,
                       kernels::SegmentField& field) {
  const float cells = static_cast<float>(1u << levels);
  field.levels = levels;
  field.voxels_per_unit = voxels_per_unit;
  field.cells_per_unit = voxels_per_unit * cells;
  field.voxels_per_cell = 1 / cells;
  field.length_scale = length_scale * field.voxels_per_cell;
}

/// Puts planes that prove nothing into every surface voxel: voxel_base and voxel_records by brick_states.
void leave_bare(SegmentData& data);

/// The kernels' view of an object; valid while both live and are not changed.
kernels::SegmentField field_of(const SegmentData& data, const Network& network);

struct NetworkView {
  kernels::Network network;
  uint64_t bytes = 0;
};

/// As SegmentShared, in a file.
struct SegmentSharedView {
  explicit SegmentSharedView(std::pmr::memory_resource* memory) : networks(memory) {}

  uint32_t network_count() const { return uint32_t(networks.size()); }
  uint64_t network_bytes() const {
    uint64_t sum = 0;
    for (const NetworkView& network : networks) sum += network.bytes;
    return sum;
  }
  uint64_t view_bytes() const { return networks.capacity() * sizeof(NetworkView); }
  /// After this nothing points into the file.
  void drop_bytes() {
    for (NetworkView& network : networks) network = {};
  }

  std::pmr::vector<NetworkView> networks;
};

struct SegmentView {
  uint32_t network = 0;         ///< index into SegmentSharedView::networks
  kernels::SegmentField field;  ///< ready to be queried
  uint64_t occupancy_bytes = 0, cell_bytes = 0, feature_bytes = 0;

  std::array<PartBytes, 3> parts() const {
    return {{{"occupancy", occupancy_bytes}, {"planes", cell_bytes}, {"features", feature_bytes}}};
  }
  /// After this nothing points into the file, and the field cannot be queried; its numbers stay.
  void drop_bytes();
};

/// Throws nif::Error (Status::damaged_nif) with the place, as all readers here do.
class SegmentReader {
 public:
  /// Reads what objects share; `shared` must outlive this.
  SegmentReader(const SectionTable& sections, std::string_view file, SegmentSharedView& shared);
  uint32_t count() const { return records_.count(); }
  /// Each object once, in order.
  SegmentView read(uint32_t index, const Bounds& bounds);
  /// After the last one.
  void finish() const;

 private:
  void read_occupancy(const SegmentRecord& record, SegmentView& view, const Place& place);
  void read_cells(const SegmentRecord& record, SegmentView& view, const Place& place);

  std::string_view file_;
  SegmentSharedView& shared_;
  Records<SegmentRecord> records_;
  Payloads occupancy_, features_, cells_;
};

class SegmentWriter {
 public:
  SegmentWriter(Sections& sections, const SegmentShared& shared);
  void add(const SegmentData& data);

 private:
  Section *records_, *features_, *occupancy_, *cells_;
};

template <>
struct EncodingOf<kernels::SegmentField> {
  static constexpr uint32_t kNumber = 1;
  static constexpr const char* kName = "segment";
  static constexpr uint32_t kSections[] = {kSegments, kNetworks, kWeights, kFeatures, kOccupancy, kCells};
  using Data = SegmentData;
  using Shared = SegmentShared;
  using View = SegmentView;
  using SharedView = SegmentSharedView;
  using Reader = SegmentReader;
  using Writer = SegmentWriter;

  static kernels::SegmentField field(const SegmentData& data, const SegmentShared& shared, const Bounds&) {
    return field_of(data, shared.networks.at(data.network));
  }
  static SegmentData to_data(const SegmentView& view);
  static SegmentShared to_shared(const SegmentSharedView& view);
};

}  // namespace nif::format
