// Reads one 16-bit colour for each surface voxel. The writer is in write_colors.cpp, because the runtime does
// not need it.
#include "formats/nif/planes/colors_section.hpp"

#include "formats/nif/reader.hpp"

namespace nif::format {

std::optional<ColorsView> read_record(const ColorsRecord& record, const ObjectView& object,
                                      const Reading& reading) {
  const Place& place = reading.place;
  place.require(object.planes != nullptr, Rule::no_voxels);
  place.require(record.surface_voxels == object.planes->field.surface_voxels, Rule::color_count);
  place.require(all_zero(record.reserved), Rule::reserved_not_zero);
  ColorsView view{record.object, record.surface_voxels, nullptr};
  const Bytes payload = reading.payloads.next(record.values, view.bytes(), "colours", place);
  view.values = reinterpret_cast<const uint16_t*>(payload.data());
  return view;
}

}  // namespace nif::format
