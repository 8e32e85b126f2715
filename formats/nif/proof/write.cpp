// Grids are coded with a range coder, but only if a reader would take them and they get smaller; else
// they stay as they are. Also the ways between an owned grid and the kernels' plain pointers.
#include "formats/nif/proof/write.hpp"

#include <algorithm>
#include <bit>

#include "formats/nif/proof/check.hpp"
#include "formats/nif/proof/coded_cells.hpp"
#include "formats/nif/proof/encoding.hpp"

namespace nif::format {
namespace {

/// Whether all kinds are what the planes prove.
bool kinds_follow(const kernels::ProofField& field) {
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

}  // namespace

void leave_bare(ProofData& data) {
  data.voxel_base.clear();
  uint32_t voxels = 0;
  for (const kernels::BrickStates& states : data.brick_states) {
    data.voxel_base.push_back(voxels);
    voxels += uint32_t(std::popcount(states.surface & ~states.aux));
  }
  data.voxel_records.assign(voxels, kernels::kBareCell);
  data.parts.clear();
}

kernels::ProofField proof_of(const ProofData& data) {
  kernels::ProofField field;
  for (size_t a = 0; a < 3; ++a) {
    field.origin[a] = data.origin[a];
    field.voxels[a] = data.voxels[a];
    field.bricks[a] = bricks_for(data.voxels[a]);
  }
  set_scales(data.voxels_per_unit, data.levels, field);
  field.brick_table = data.brick_table.data();
  field.brick_states = data.brick_states.data();
  field.voxel_base = data.voxel_base.data();
  field.voxel_records = data.voxel_records.data();
  field.parts = data.parts.data();
  field.surface_voxels = uint32_t(data.voxel_records.size());
  field.part_count = uint32_t(data.parts.size());
  field.mixed_bricks = uint32_t(data.brick_states.size());
  return field;
}

ProofData proof_data(const kernels::ProofField& field) {
  ProofData data;
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
  data.parts.assign(field.parts, field.parts + field.part_count);
  return data;
}

bool grid_in_order(const ProofData& data, const kernels::ProofField& field) {
  const size_t mixed = data.brick_states.size();
  bool good = mixed <= 0xffff - kernels::kFirstMixedBrick + 1 && data.levels <= kernels::kMaxLevels;
  for (const uint32_t voxels : data.voxels)
    good = good && voxels >= 1 && voxels <= std::min(kernels::kMaxVoxels, kernels::kMaxCells >> data.levels);
  return good && data.voxel_base.size() == mixed &&
         data.brick_table.size() == size_t{field.bricks[0]} * field.bricks[1] * field.bricks[2] &&
         !fault_of_bricks(field);
}

CodedGrid::CodedGrid(const ProofData& data) {
  if (data.coded == 0) return;
  const kernels::ProofField field = proof_of(data);
  if (!grid_in_order(data, field)) return;
  const UncodedGrid uncoded(field);
  uint64_t bytes = uncoded.occupancy + uncoded.cells;
  if (data.coded & kCodedOccupancy) {
    occupancy = encode_occupancy(data, field, Corners::none, nullptr, uncoded.occupancy,
                                 [](const auto&) { return true; });
    if (!occupancy.empty()) forms |= kCodedOccupancy, bytes -= uncoded.occupancy - occupancy.size();
  }
  if (data.coded & kCodedCells) {
    uint32_t cell_forms;
    cells = encode_cells(field, cell_forms);
    if (!cells.empty()) forms |= cell_forms, bytes -= uncoded.cells - cells.size();
  }
  if (!uncoded.may_take(bytes)) forms = 0;
}

Coded encode_cells(const kernels::ProofField& field, uint32_t& forms) {
  forms = 0;
  if (fault_of_words(field)) return {};
  const bool stated = !kinds_follow(field);
  std::vector<uint32_t> words(size_t{field.surface_voxels} + field.part_count);
  RangeEncoder encoder;
  if (!CellCoder(encoder, field, words.data()).code(&field, stated)) return {};
  Coded coded = if_smaller(encoder.finish(), words.size() * sizeof(uint32_t));
  if (!coded.empty()) forms = kCodedCells | (stated ? uint32_t{kStatedKinds} : 0u);
  return coded;
}

ProofWriter::ProofWriter(Sections& sections, const ProofShared&)
    : records_(&sections.add(kProofRecords)),
      occupancy_(&sections.add(kProofOccupancy)),
      cells_(&sections.add(kProofCells)) {}

void ProofWriter::add(const ProofData& data) {
  ProofRecord record{};
  add_grid(data, *occupancy_, *cells_, record);
  records_->append(&record, 1);
}

ProofData EncodingOf<kernels::ProofField>::to_data(const ProofView& view) {
  ProofData data = proof_data(view.field);
  data.coded = view.coded;
  return data;
}

}  // namespace nif::format
