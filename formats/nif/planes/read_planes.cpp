// Reads planes. Coded payloads are decoded first, then checked like uncoded ones: a decoder is not trusted.
// Words come before sides. What planes prove is derived again, and a file may claim no more than that.
#include <algorithm>
#include <cmath>

#include "formats/nif/coded_payloads.hpp"
#include "formats/nif/planes/check_planes.hpp"
#include "formats/nif/planes/coded_cells.hpp"
#include "formats/nif/planes/coded_occupancy.hpp"
#include "formats/nif/planes/planes_part.hpp"
#include "formats/nif/reader.hpp"

namespace nif::format {
namespace {

/// Checks the numbers of a grid, and sets those of `field`.
void read_numbers(const PlanesRecord& record, const Place& place, kernels::PlanesField& field) {
  place.require((record.forms & ~uint32_t{kPlanesForms}) == 0, Rule::unknown_forms);
  place.require((record.forms & kCodedCells) != 0 || (record.forms & kStatedKinds) == 0,
                Rule::kinds_not_coded);
  place.require(all_finite(record.origin), Rule::origin_not_finite);
  place.require(std::isfinite(record.voxels_per_unit) && record.voxels_per_unit > 0, Rule::voxels_per_unit);
  std::copy_n(record.origin, 3, field.origin);
  place.within(record.levels, 0, kernels::kMaxLevels, "levels", Rule::levels_range);
  kernels::set_scales(record.voxels_per_unit, record.levels, field);
  place.require(std::isfinite(field.cells_per_unit), Rule::voxels_per_unit_large);
  for (int a = 0; a < 3; ++a) {
    place.within(record.voxels[a], 1, std::min(kernels::kMaxVoxels, kernels::kMaxCells >> record.levels),
                 "voxels", Rule::voxels_range);
    field.voxels[a] = record.voxels[a];
    field.bricks[a] = bricks_for(record.voxels[a]);
  }
  // The table's entries have 16 bits, which limits the mixed bricks and so the corners.
  place.within(record.mixed_bricks, 0, 0xffff - kernels::kFirstMixedBrick + 1, "mixed_bricks",
               Rule::mixed_bricks_range);
  place.within(record.child_count, 0, kernels::kMaxChildren, "child_count", Rule::child_count_range);
  field.mixed_bricks = record.mixed_bricks;
  field.surface_voxels = record.surface_voxels;
  field.child_count = record.child_count;
}

/// Reads only voxels, bricks and mixed_bricks of the field.
bool decode_occupancy(Bytes coded, const kernels::PlanesField& field, std::byte* to) {
  RangeDecoder decoder(coded);
  const OccupancyArrays<std::byte> arrays(to, field.mixed_bricks);
  return OccupancyCoder(decoder, field, arrays).code(nullptr) && decoder.complete();
}

/// Reads only the occupancy, levels, surface_voxels and child_count of the field. If kinds are not stated,
/// they only tell which cells separate: see proven_kind().
bool decode_cells(Bytes coded, bool kinds_stated, const kernels::PlanesField& field, uint32_t* to) {
  RangeDecoder decoder(coded);
  return CellCoder(decoder, field, to).code(nullptr, kinds_stated) && decoder.complete();
}

/// Gives decoded words the kinds that say all that is proven.
void complete_kinds(const SideRegions& sides, std::span<uint32_t> words) {
  for (uint32_t i = 0; i < words.size(); ++i) {
    const uint32_t kind = kernels::word_kind(words[i]);
    if (kind != kernels::kLink) words[i] = (words[i] & ~15u) | proven_kind(sides, i, separates(kind));
  }
}

}  // namespace

PlanesView read_record(const PlanesRecord& record, const ObjectView&, const Reading& reading) {
  const auto& [place, payloads, asset] = reading;
  PlanesView view;
  kernels::PlanesField& field = view.field;
  read_numbers(record, place, field);
  view.coded = record.forms & kCodedPlanes;
  const bool coded_occupancy = (record.forms & kCodedOccupancy) != 0,
             coded_cells = (record.forms & kCodedCells) != 0, stated = (record.forms & kStatedKinds) != 0;

  // Take both payloads before allocating memory for what they decode to.
  const UncodedPlanes uncoded(record);
  const Bytes occupancy =
      take_payload(payloads, record.occupancy, coded_occupancy, uncoded.occupancy, "occupancy", place);
  const Bytes cells = take_payload(payloads, record.cells, coded_cells, uncoded.cells, "cells", place);
  place.require(view.coded == 0 || uncoded.may_take(occupancy.size() + cells.size()), Rule::decoded_size);

  const OccupancyArrays<const std::byte> arrays(
      usable(occupancy, coded_occupancy, uncoded.occupancy, "occupancy", place, asset.decoded, view.occupancy,
             [&](std::byte* to) { return decode_occupancy(occupancy, field, to); }),
      field.mixed_bricks);
  field.brick_states = arrays.brick_states;
  field.voxel_base = arrays.voxel_base;
  field.brick_table = arrays.brick_table;
  if (const auto fault = fault_of_bricks(field)) place.damaged(*fault);

  uint32_t* words = nullptr;  // where they are decoded
  field.voxel_records = reinterpret_cast<const uint32_t*>(usable(
      cells, coded_cells, uncoded.cells, "cells", place, asset.decoded, view.cells, [&](std::byte* to) {
        words = reinterpret_cast<uint32_t*>(to);
        return decode_cells(cells, stated, field, words);
      }));
  field.children = field.voxel_records + field.surface_voxels;
  if (const auto fault = fault_of_words(field)) place.damaged(*fault);
  const SideRegions sides(field);
  if (coded_cells && !stated)
    complete_kinds(sides, {words, size_t{field.surface_voxels} + field.child_count});
  if (const auto fault = fault_of_sides(field, sides)) place.damaged(*fault);
  return view;
}

void PlanesView::drop_bytes() {
  occupancy = cells = {};
  field.brick_table = nullptr;
  field.brick_states = nullptr;
  field.voxel_base = nullptr;
  field.voxel_records = nullptr;
  field.children = nullptr;
}

}  // namespace nif::format
