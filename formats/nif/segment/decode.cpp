#include "formats/nif/segment/decode.hpp"

#include "formats/nif/segment/coded_cells.hpp"
#include "formats/nif/segment/coded_features.hpp"
#include "formats/nif/segment/coded_occupancy.hpp"

namespace nif::format {

bool decode_occupancy(std::span<const std::byte> coded, bool corners_stated,
                      const kernels::SegmentField& field, std::byte* to) {
  RangeDecoder decoder(coded);
  OccupancyCoder occupancy(decoder, field, OccupancyArrays(to, field.mixed_bricks));
  return occupancy.code(nullptr, corners_stated) && decoder.complete();
}

bool decode_cells(std::span<const std::byte> coded, bool kinds_stated, const kernels::SegmentField& field,
                  std::byte* to) {
  RangeDecoder decoder(coded);
  CellCoder cells(decoder, field, reinterpret_cast<uint32_t*>(to));
  return cells.code(nullptr, kinds_stated) && decoder.complete();
}

bool decode_features(std::span<const std::byte> coded, const kernels::SegmentField& field, std::byte* to) {
  RangeDecoder decoder(coded);
  auto* const features = reinterpret_cast<int8_t*>(to);
  code_features(decoder, uint64_t{field.corners} * field.features_per_corner, field.features_per_corner,
                features, features);
  return decoder.complete();
}

}  // namespace nif::format
