// Writes alpha maps and the places of triangles in them. The reader is in read_holes.cpp; they are separate because the
// runtime only reads.
#include <utility>

#include "formats/base/size.hpp"
#include "formats/nif/asset.hpp"
#include "formats/nif/holes/coded_alpha_map.hpp"
#include "formats/nif/holes/holes_part.hpp"
#include "formats/nif/triangles/pack_numbers.hpp"

namespace nif::format {

void AlphaMaps::add(kernels::AlphaMap map, Tiles tiles) {
  map.tiles = tiles->data();
  maps_.push_back(map);
  tiles_.push_back(std::move(tiles));
}

void HolesData::set_numbers(const std::vector<uint32_t>& unpacked) {
  triangles = uint32_t(unpacked.size());
  numbers = packed(unpacked, bits());
}

kernels::HolesField field_of(const HolesData& data, const AlphaMaps& maps) {
  kernels::HolesField field;
  field.maps = maps.data();
  field.map_count = uint32_t(maps.size());
  field.patches = data.patches.data();
  field.patch_count = uint32_t(data.patches.size());
  field.numbers = {data.numbers.data(), data.bits(), data.triangles};
  return field;
}

AlphaMapRecord write_record(const kernels::AlphaMap& map, Section& payloads) {
  AlphaMapRecord record{};
  record.width = map.width;
  record.height = map.height;
  for (int a = 0; a < 2; ++a) record.wrap[a] = uint8_t(map.wrap[a]);
  std::vector<uint64_t> known(memory_size(kernels::alpha_tiles(map.width, map.height)));
  RangeEncoder encoder;
  AlphaMapCoder(encoder, map, map.tiles, known.data()).code();
  record.tiles = payloads.add_payload(encoder.finish());
  return record;
}

HolesRecord write_record(const HolesData& data, const Object&, Section& payloads) {
  HolesRecord record{};
  record.patches = uint32_t(data.patches.size());
  record.holes = payloads.add_payload(data.patches, data.numbers);
  return record;
}

HolesData to_data(const HolesView& view) {
  const kernels::HolesField& field = view.field;
  HolesData data;
  data.patches.assign(field.patches, field.patches + field.patch_count);
  data.numbers.assign(field.numbers.words,
                      field.numbers.words + kernels::source_words(field.numbers.count, field.numbers.bits));
  data.triangles = field.numbers.count;
  return data;
}

void add_copy(const kernels::AlphaMap& map, AlphaMaps& to) {
  const size_t tiles = memory_size(kernels::alpha_tiles(map.width, map.height));
  to.add(map, std::make_shared<const std::vector<uint64_t>>(map.tiles, map.tiles + tiles));
}

}  // namespace nif::format
