// Writes planes. Grids are coded with a range coder if a reader would accept them and they get smaller; else
// they stay as they are. Also converts between planes that own their memory and the kernels' plain pointers.
#include <algorithm>
#include <bit>

#include "formats/nif/coded_payloads.hpp"
#include "formats/nif/planes/check_planes.hpp"
#include "formats/nif/planes/coded_cells.hpp"
#include "formats/nif/planes/coded_occupancy.hpp"
#include "formats/nif/planes/planes_part.hpp"

namespace nif::format {
namespace {

/// Whether all kinds are what the planes prove.
bool kinds_follow(const kernels::PlanesField& field) {
  const SideRegions sides(field);
  uint32_t record = 0;
  const auto follow = [&](const uint32_t* words, uint32_t count) {
    for (uint32_t i = 0; i < count; ++i, ++record) {
      const uint32_t kind = kernels::word_kind(words[i]);
      if (kind != kernels::kLink && proven_kind(sides, record, separates(kind)) != kind) return false;
    }
    return true;
  };
  return follow(field.voxel_records, field.surface_voxels) && follow(field.children, field.child_count);
}

/// For a grid that is in order.
Coded encode_occupancy(const PlanesData& data, const kernels::PlanesField& field, uint64_t bytes) {
  std::vector<uint64_t> memory(memory_size((bytes + 7) / 8));
  const OccupancyArrays<std::byte> to(reinterpret_cast<std::byte*>(memory.data()), field.mixed_bricks);
  RangeEncoder encoder;
  if (!OccupancyCoder(encoder, field, to).code(&field) || !equal(to.brick_states, data.brick_states) ||
      !equal(to.voxel_base, data.voxel_base) || !equal(to.brick_table, data.brick_table))
    return {};
  return if_smaller(encoder.finish(), bytes);
}

/// For a grid that is in order; empty if its words are not. `forms` receives what a file must say about them.
Coded encode_cells(const kernels::PlanesField& field, uint32_t& forms) {
  if (fault_of_words(field)) return {};
  const bool stated = !kinds_follow(field);
  std::vector<uint32_t> words(size_t{field.surface_voxels} + field.child_count);
  RangeEncoder encoder;
  if (!CellCoder(encoder, field, words.data()).code(&field, stated)) return {};
  Coded coded = if_smaller(encoder.finish(), words.size() * sizeof(uint32_t));
  if (!coded.empty()) forms |= kCodedCells | (stated ? uint32_t{kStatedKinds} : 0u);
  return coded;
}

/// What `data.coded` names, coded if the reader accepts it and it becomes smaller.
struct CodedPlanes {
  uint32_t forms = 0;  ///< PlanesForm: which are coded, and how
  Coded occupancy, cells;

  explicit CodedPlanes(const PlanesData& data) {
    if (data.coded == 0 || !in_order(data)) return;
    const kernels::PlanesField field = field_of(data);
    const UncodedPlanes uncoded(field);
    uint64_t bytes = uncoded.occupancy + uncoded.cells;
    if (data.coded & kCodedOccupancy) {
      occupancy = encode_occupancy(data, field, uncoded.occupancy);
      if (!occupancy.empty()) forms |= kCodedOccupancy, bytes -= uncoded.occupancy - occupancy.size();
    }
    if (data.coded & kCodedCells) {
      cells = encode_cells(field, forms);
      if (!cells.empty()) bytes -= uncoded.cells - cells.size();
    }
    if (!uncoded.may_take(bytes)) forms = 0;
  }
};

}  // namespace

bool in_order(const PlanesData& data) {
  const kernels::PlanesField field = field_of(data);
  const size_t mixed = data.brick_states.size();
  bool good = mixed <= 0xffff - kernels::kFirstMixedBrick + 1 && data.levels <= kernels::kMaxLevels;
  for (const uint32_t voxels : data.voxels)
    good = good && voxels >= 1 && voxels <= std::min(kernels::kMaxVoxels, kernels::kMaxCells >> data.levels);
  return good && data.voxel_base.size() == mixed &&
         data.brick_table.size() == size_t{field.bricks[0]} * field.bricks[1] * field.bricks[2] &&
         !fault_of_bricks(field);
}

void leave_bare(PlanesData& data) {
  data.voxel_base.clear();
  uint32_t voxels = 0;
  for (const kernels::BrickStates& states : data.brick_states) {
    data.voxel_base.push_back(voxels);
    voxels += uint32_t(std::popcount(states.surface & ~states.aux));
  }
  data.voxel_records.assign(voxels, kernels::kBareCell);
  data.children.clear();
}

kernels::PlanesField field_of(const PlanesData& data) {
  kernels::PlanesField field;
  for (size_t a = 0; a < 3; ++a) {
    field.origin[a] = data.origin[a];
    field.voxels[a] = data.voxels[a];
    field.bricks[a] = bricks_for(data.voxels[a]);
  }
  kernels::set_scales(data.voxels_per_unit, data.levels, field);
  field.brick_table = data.brick_table.data();
  field.brick_states = data.brick_states.data();
  field.voxel_base = data.voxel_base.data();
  field.voxel_records = data.voxel_records.data();
  field.children = data.children.data();
  field.surface_voxels = uint32_t(data.voxel_records.size());
  field.child_count = uint32_t(data.children.size());
  field.mixed_bricks = uint32_t(data.brick_states.size());
  return field;
}

PlanesData to_data(const PlanesView& view) {
  const kernels::PlanesField& field = view.field;
  PlanesData data;
  std::copy_n(field.origin, 3, data.origin.begin());
  data.voxels_per_unit = field.voxels_per_unit;
  data.levels = field.levels;
  std::copy_n(field.voxels, 3, data.voxels.begin());
  const size_t mixed = field.mixed_bricks;
  const size_t bricks = size_t(field.bricks[0]) * field.bricks[1] * field.bricks[2];
  data.brick_table.assign(field.brick_table, field.brick_table + bricks);
  data.brick_states.assign(field.brick_states, field.brick_states + mixed);
  data.voxel_base.assign(field.voxel_base, field.voxel_base + mixed);
  data.voxel_records.assign(field.voxel_records, field.voxel_records + field.surface_voxels);
  data.children.assign(field.children, field.children + field.child_count);
  data.coded = view.coded;
  return data;
}

PlanesRecord write_record(const PlanesData& data, const Object&, Section& payloads) {
  PlanesRecord record{};
  std::copy(data.origin.begin(), data.origin.end(), record.origin);
  record.voxels_per_unit = data.voxels_per_unit;
  std::copy(data.voxels.begin(), data.voxels.end(), record.voxels);
  record.levels = data.levels;
  record.mixed_bricks = uint32_t(data.brick_states.size());
  record.surface_voxels = uint32_t(data.voxel_records.size());
  record.child_count = uint32_t(data.children.size());

  const CodedPlanes coded(data);
  record.forms = coded.forms;
  record.occupancy = coded.forms & kCodedOccupancy
                         ? payloads.add_payload(coded.occupancy)
                         : payloads.add_payload(data.brick_states, data.voxel_base, data.brick_table);
  record.cells = coded.forms & kCodedCells ? payloads.add_payload(coded.cells)
                                           : payloads.add_payload(data.voxel_records, data.children);
  return record;
}

}  // namespace nif::format
