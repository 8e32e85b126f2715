// The `segment` encoding in a .nif file: an occupancy grid, features and a network for each object.
#pragma once

#include <array>
#include <cstdint>
#include <memory_resource>
#include <vector>

#include "formats/nif/encoding_of.hpp"
#include "formats/nif/proof/data.hpp"
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

/// Logits are less by `threshold` than what was trained, because the last bias is: see lean().
struct Network {
  std::vector<Layer> layers;
  float logit_scale = 1;
  int32_t threshold = 0;

  kernels::Calibration calibration() const { return {logit_scale, threshold}; }
};

/// The least and the largest output of a network, for any inputs. int64: a network need not be valid.
struct OutputRange {
  int64_t least, largest;
};
OutputRange output_range(const Network& network);

/// Raises the threshold, and lowers every output, by `by`: answers lean to occluded where it is above 0.
/// Probabilities stay.
void lean(Network& network, int32_t by);

/// What the `segment` objects of an asset share.
struct SegmentShared {
  std::vector<Network> networks;
};

/// One object; members as in kernels::SegmentField.
struct SegmentData : ProofData {
  uint32_t network = 0;  ///< index into SegmentShared::networks
  std::vector<uint64_t> brick_corners;
  std::vector<uint32_t> corner_base;
  std::vector<int8_t> features;
  uint32_t corners = 0;
  uint32_t features_per_corner = 0;
  uint32_t samples = 0;
  float length_scale = 0;
};

/// Bytes of the payloads of an object where none is coded.
struct UncodedBytes : UncodedGrid {
  uint64_t features;

  /// As UncodedGrid.
  template <class Record>
  explicit UncodedBytes(const Record& r)
      : UncodedGrid(r), features(uint64_t{r.corners} * r.features_per_corner) {
    occupancy += uint64_t{r.mixed_bricks} * (sizeof(uint64_t) + sizeof(uint32_t));
  }

  /// Whether a file may have them coded, in so many bytes together.
  bool may_take(uint64_t bytes) const {
    return occupancy + cells + features <= kMostExpansion * bytes && kBytesPerBrick * bricks <= bytes;
  }
};

/// The kernels' view of an object; valid while both live and are not changed.
kernels::SegmentField field_of(const SegmentData& data, const Network& network);

struct NetworkView {
  kernels::Network network;
  uint64_t bytes = 0;
};

/// As SegmentShared, in a file; and the memory of what is decoded when it is read.
struct SegmentSharedView {
  explicit SegmentSharedView(std::pmr::memory_resource* memory) : networks(memory), decoded(memory) {}

  uint32_t network_count() const { return uint32_t(networks.size()); }
  uint64_t network_bytes() const {
    uint64_t sum = 0;
    for (const NetworkView& network : networks) sum += network.bytes;
    return sum;
  }
  /// Without what is decoded.
  uint64_t view_bytes() const { return networks.capacity() * sizeof(NetworkView) + decoded.view_bytes(); }
  /// After this nothing points into the file, and nothing decoded is kept.
  void drop_bytes() {
    for (NetworkView& network : networks) network = {};
    decoded.drop();
  }

  std::pmr::vector<NetworkView> networks;
  DecodedPayloads decoded;
};

struct SegmentView {
  uint32_t network = 0;         ///< index into SegmentSharedView::networks
  kernels::SegmentField field;  ///< ready to be queried
  PayloadBytes occupancy, cells, features;
  uint32_t coded = 0;  ///< as in SegmentData

  std::array<PartBytes, 3> parts() const {
    return {{{"occupancy", occupancy.file, occupancy.decoded},
             {"planes", cells.file, cells.decoded},
             {"features", features.file, features.decoded}}};
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
