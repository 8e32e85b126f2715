// Reads and checks alpha maps and the places of triangles in them. What is accepted cannot make a query read outside of
// a map: texels are wrapped into it, and maps are what their size says.
#include <algorithm>

#include "formats/nif/coded_payloads.hpp"
#include "formats/nif/holes/coded_alpha_map.hpp"
#include "formats/nif/holes/holes_part.hpp"
#include "formats/nif/reader.hpp"

namespace nif::format {

kernels::AlphaMap read_record(const AlphaMapRecord& record, const Reading& reading) {
  const auto& [place, payloads, asset] = reading;
  kernels::AlphaMap map;
  place.within(record.width, 1, kernels::kMaxAlphaSide, "width", Rule::alpha_map_size);
  place.within(record.height, 1, kernels::kMaxAlphaSide, "height", Rule::alpha_map_size);
  map.width = record.width;
  map.height = record.height;
  for (int a = 0; a < 2; ++a) {
    place.require(record.wrap[a] < kernels::kAlphaWraps, Rule::alpha_wrap);
    map.wrap[a] = record.wrap[a];
  }
  place.require(all_zero(record.reserved), Rule::reserved_not_zero);
  const uint64_t tiles = kernels::alpha_tiles(map.width, map.height);
  asset.alpha_tiles += tiles;
  place.require(asset.alpha_tiles <= kMostAlphaTiles, Rule::alpha_tiles);
  const Bytes payload = payloads.next(record.tiles, record.tiles.bytes, "tiles", place);
  map.tiles = reinterpret_cast<const uint64_t*>(
      usable(payload, true, tiles * sizeof(uint64_t), "tiles", place, asset.decoded, asset.alpha_map_bytes,
             [&](std::byte* to) {
               RangeDecoder decoder(payload);
               return AlphaMapCoder(decoder, map, nullptr, reinterpret_cast<uint64_t*>(to)).code() &&
                      decoder.complete();
             }));
  return map;
}

HolesView read_record(const HolesRecord& record, const ObjectView& object, const Reading& reading) {
  const auto& [place, payloads, asset] = reading;
  place.require(all_zero(record.reserved), Rule::reserved_not_zero);
  const uint32_t triangles = object.triangles->field.triangle_count;  // every encoding with holes has them
  place.within(record.patches, 1, triangles, "patches", Rule::patch_count);
  HolesView view;
  kernels::HolesField& field = view.field;
  field.maps = asset.alpha_maps.data();
  field.map_count = uint32_t(asset.alpha_maps.size());
  field.patch_count = record.patches;
  field.numbers.count = triangles;
  field.numbers.bits = kernels::source_bits(record.patches + 1);
  const uint64_t patch_bytes = uint64_t{record.patches} * sizeof(kernels::AlphaPatch),
                 words = kernels::source_words(triangles, field.numbers.bits);
  view.bytes = patch_bytes + words * sizeof(uint32_t);
  const std::byte* const at = payloads.next(record.holes, view.bytes, "holes", place).data();
  field.patches = reinterpret_cast<const kernels::AlphaPatch*>(at);
  field.numbers.words = reinterpret_cast<const uint32_t*>(at + patch_bytes);
  for (uint32_t i = 0; i < record.patches; ++i) {
    place.require(field.patches[i].map < field.map_count, Rule::patch_map);
    place.require(field.patches[i].shift <= kernels::kAlphaFraction, Rule::patch_shift);
  }
  for (uint32_t i = 0; i < triangles; ++i)
    place.require(kernels::source_triangle(field.numbers, i) <= record.patches, Rule::patch_number);
  const auto used = uint32_t(uint64_t{triangles} * field.numbers.bits % 32);
  place.require(used == 0 || field.numbers.words[words - 1] >> used == 0, Rule::bits_after_numbers);
  return view;
}

}  // namespace nif::format
