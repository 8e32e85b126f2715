// Corners cost nothing if they follow from the surface voxels, so that form is tried first; if decoding
// would not give the same corners back, they are stated.
#include "formats/nif/segment/write_coded.hpp"

#include "formats/nif/proof/write.hpp"
#include "formats/nif/segment/coded_features.hpp"

namespace nif::format {
namespace {

Coded encode_occupancy(const kernels::SegmentField& field, const SegmentData& data, Corners corners) {
  return encode_occupancy(data, field, corners, data.brick_corners.data(), UncodedBytes(field).occupancy,
                          [&](const OccupancyArrays<std::byte>& to) {
                            return equal(to.brick_corners, data.brick_corners) &&
                                   equal(to.corner_base, data.corner_base);
                          });
}

Coded encode_features(const SegmentData& data) {
  std::vector<int8_t> same(data.features.size());
  RangeEncoder encoder;
  code_features(encoder, same.size(), data.features_per_corner, data.features.data(), same.data());
  return if_smaller(encoder.finish(), same.size());
}

}  // namespace

CodedPayloads encode_payloads(const SegmentData& data) {
  if (data.coded == 0) return {};
  const kernels::SegmentField field = field_of(data, {});
  CodedPayloads coded;
  const auto keep = [&](std::vector<std::byte>& to, uint32_t forms, Coded from) {
    if (!from.empty()) coded.forms |= forms;
    to = std::move(from);
    return !to.empty();
  };
  const size_t mixed = data.brick_states.size();
  const bool good =
      data.brick_corners.size() == mixed && data.corner_base.size() == mixed && grid_in_order(data, field);
  if ((data.coded & kCodedOccupancy) && good &&
      !keep(coded.occupancy, kCodedOccupancy, encode_occupancy(field, data, Corners::around)))
    keep(coded.occupancy, kCodedOccupancy | kStatedCorners, encode_occupancy(field, data, Corners::stated));
  if ((data.coded & kCodedCells) && good) {
    uint32_t forms;
    Coded cells = encode_cells(field, forms);
    keep(coded.cells, forms, std::move(cells));
  }
  const UncodedBytes uncoded(field);
  if ((data.coded & kCodedFeatures) && data.features_per_corner >= 1 &&
      data.features_per_corner <= kernels::kMaxFeatures && data.features.size() == uncoded.features)
    keep(coded.features, kCodedFeatures, encode_features(data));

  const uint64_t bytes = (coded.forms & kCodedOccupancy ? coded.occupancy.size() : uncoded.occupancy) +
                         (coded.forms & kCodedCells ? coded.cells.size() : uncoded.cells) +
                         (coded.forms & kCodedFeatures ? coded.features.size() : uncoded.features);
  return uncoded.may_take(bytes) ? coded : CodedPayloads();
}

}  // namespace nif::format
