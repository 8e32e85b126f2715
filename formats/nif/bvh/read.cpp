// The reader of `bvh` objects: a record and a payload each. How a tree is read and checked is in the
// header, because `exact` objects have one, too.
#include "formats/nif/bvh/read.hpp"

#include "formats/nif/bvh/encoding.hpp"

namespace nif::format {

BvhReader::BvhReader(const SectionTable& sections, std::string_view file, BvhSharedView&)
    : file_(file), records_(sections[kBvhRecords], "BVHR", file), trees_(sections[kBvhs]) {}

BvhView BvhReader::read(uint32_t index, const Bounds&) {
  const BvhRecord record = records_[index];
  const Place place{file_, "BVHR", index};
  place.require(record.reserved == 0, Rule::reserved_not_zero);
  BvhView view;
  view.field = take_bvh(record, trees_, place, view.tree_bytes);
  return view;
}

void BvhReader::finish() const { trees_.finish("BVHS", file_); }

}  // namespace nif::format
