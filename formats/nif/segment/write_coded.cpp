#include "formats/nif/segment/write_coded.hpp"

#include <algorithm>
#include <cstring>

#include "formats/nif/segment/check.hpp"
#include "formats/nif/segment/coded_cells.hpp"
#include "formats/nif/segment/coded_features.hpp"
#include "formats/nif/segment/coded_occupancy.hpp"

namespace nif::format {
namespace {

/// A coded payload; without bytes where it has to be uncoded.
using Coded = std::vector<std::byte>;

Coded if_smaller(Coded coded, uint64_t bytes) { return coded.size() < bytes ? std::move(coded) : Coded(); }

bool in_order(const SegmentData& data, const kernels::SegmentField& field) {
  const size_t mixed = data.brick_states.size();
  bool good = mixed <= 0xffff - kernels::kFirstMixedBrick + 1 && data.levels <= kernels::kMaxLevels;
  for (const uint32_t voxels : data.voxels)
    good = good && voxels >= 1 && voxels <= std::min(kernels::kMaxVoxels, kernels::kMaxCells >> data.levels);
  return good && data.brick_corners.size() == mixed && data.corner_base.size() == mixed &&
         data.voxel_base.size() == mixed &&
         data.brick_table.size() == size_t{field.bricks[0]} * field.bricks[1] * field.bricks[2] &&
         fault_of_bricks(field) == nullptr;
}

template <class T>
bool equal(const T* coded, const std::vector<T>& data) {
  return data.empty() || std::memcmp(coded, data.data(), data.size() * sizeof(T)) == 0;
}

Coded encode_occupancy(const kernels::SegmentField& field, const SegmentData& data, bool stated) {
  const uint64_t bytes = UncodedBytes(field).occupancy;
  std::vector<uint64_t> memory((bytes + 7) / 8);
  const OccupancyArrays to(reinterpret_cast<std::byte*>(memory.data()), field.mixed_bricks);
  RangeEncoder encoder;
  if (!OccupancyCoder(encoder, field, to).code(&field, stated) ||
      !equal(to.brick_states, data.brick_states) || !equal(to.brick_corners, data.brick_corners) ||
      !equal(to.corner_base, data.corner_base) || !equal(to.voxel_base, data.voxel_base) ||
      !equal(to.brick_table, data.brick_table))
    return {};
  return if_smaller(encoder.finish(), bytes);
}

/// Whether all kinds are what the planes prove.
bool kinds_follow(const kernels::SegmentField& field) {
  const SideRegions sides(field);
  uint32_t record = 0;
  const auto follow = [&](const uint32_t* words, uint32_t count) {
    for (uint32_t i = 0; i < count; ++i, ++record) {
      const uint32_t kind = kernels::word_kind(words[i]);
      if (kind != kernels::kLink && proven_kind(sides, record, separates(kind)) != kind) return false;
    }
    return true;
  };
  return follow(field.voxel_records, field.surface_voxels) && follow(field.parts, field.part_count);
}

Coded encode_cells(const kernels::SegmentField& field, bool stated) {
  std::vector<uint32_t> words(size_t{field.surface_voxels} + field.part_count);
  RangeEncoder encoder;
  if (!CellCoder(encoder, field, words.data()).code(&field, stated)) return {};
  return if_smaller(encoder.finish(), words.size() * sizeof(uint32_t));
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
  const bool good = in_order(data, field);
  if ((data.coded & kCodedOccupancy) && good &&
      !keep(coded.occupancy, kCodedOccupancy, encode_occupancy(field, data, false)))
    keep(coded.occupancy, kCodedOccupancy | kStatedCorners, encode_occupancy(field, data, true));
  if ((data.coded & kCodedCells) && good && fault_of_words(field) == nullptr) {
    const bool stated = !kinds_follow(field);
    keep(coded.cells, kCodedCells | (stated ? kStatedKinds : 0u), encode_cells(field, stated));
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
