// Writes `exact` objects: the grid as `proof` objects have it, the BVH as `bvh` objects do, and one
// record that names both payloads.
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
  ExactRecord record{};
  add_grid(data.proof, *occupancy_, *cells_, record);
  add_bvh(data.bvh, *trees_, record);
  records_->append(&record, 1);
}

ExactData EncodingOf<kernels::ExactField>::to_data(const ExactView& view) {
  ExactData data{proof_data(view.field.proof), bvh_data(view.field.bvh)};
  data.proof.coded = view.coded;
  return data;
}

}  // namespace nif::format
