// Reads one 16-bit colour for each surface voxel. The writer is in write_colors.cpp, because the runtime does
// not need it.
#include "formats/nif/planes/colors.hpp"

namespace nif::format {

void read_colors(const SectionTable& sections, bool present, std::string_view file,
                 std::span<const std::optional<uint32_t>> counts, std::pmr::vector<ColorsView>& views) {
  const Records<ColorsRecord> records(sections[kColorRecords], "COLR", file);
  Payloads payloads(sections[kColorValues]);
  if (present && records.count() == 0) refuse(Rule::section_unused, file, "section COLR");
  views.reserve(records.count());
  for (uint32_t i = 0; i < records.count(); ++i) {
    const ColorsRecord record = records[i];
    const Place place{file, "COLR", i};
    place.require(record.object < counts.size(), Rule::object_range);
    place.require(i == 0 || record.object > views.back().object, Rule::optional_order);
    const std::optional<uint32_t>& count = counts[record.object];
    place.require(count.has_value(), Rule::no_voxels);
    place.require(record.surface_voxels == *count, Rule::color_count);
    place.require(all_zero(record.reserved), Rule::reserved_not_zero);
    ColorsView view{record.object, *count, nullptr};
    const Bytes payload = payloads.next(record.values, view.bytes(), "colours", place);
    view.values = reinterpret_cast<const uint16_t*>(payload.data());
    views.push_back(view);
  }
  payloads.finish("CVAL", file);
}

}  // namespace nif::format
