#include "formats/nif/bvh/write.hpp"
#include "formats/nif/exact/encoding.hpp"
#include "formats/nif/proof/write.hpp"

namespace nif::format {

ExactWriter::ExactWriter(Sections& sections, const ExactShared&)
    : records_(&sections.add(kExactRecords)),
      occupancy_(&sections.add(kExactOccupancy)),
      cells_(&sections.add(kExactCells)),
      trees_(&sections.add(kExactTrees)) {}

void ExactWriter::add(const ExactData& data) {
  const ProofData& grid = data.proof;
  ExactRecord record{};
  std::copy(grid.origin.begin(), grid.origin.end(), record.origin);
  record.voxels_per_unit = grid.voxels_per_unit;
  std::copy(grid.voxels.begin(), grid.voxels.end(), record.voxels);
  record.levels = grid.levels;
  record.mixed_bricks = uint32_t(grid.brick_states.size());
  record.surface_voxels = uint32_t(grid.voxel_records.size());
  record.part_count = uint32_t(grid.parts.size());

  const CodedGrid coded(grid);
  record.forms = coded.forms;
  record.occupancy = occupancy_->begin_payload();
  if (coded.forms & kCodedOccupancy) {
    occupancy_->append(coded.occupancy);
  } else {
    occupancy_->append(grid.brick_states);
    occupancy_->append(grid.voxel_base);
    occupancy_->append(grid.brick_table);
  }
  occupancy_->end_payload(record.occupancy);
  record.cells = cells_->begin_payload();
  if (coded.forms & kCodedCells) {
    cells_->append(coded.cells);
  } else {
    cells_->append(grid.voxel_records);
    cells_->append(grid.parts);
  }
  cells_->end_payload(record.cells);
  add_bvh(data.bvh, *trees_, record);
  records_->append(&record, 1);
}

ExactData EncodingOf<kernels::ExactField>::to_data(const ExactView& view) {
  ExactData data{proof_data(view.field.proof), bvh_data(view.field.bvh)};
  data.proof.coded = view.coded;
  return data;
}

}  // namespace nif::format
