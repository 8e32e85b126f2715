// Writes the colours of surface voxels. The reader is in colors_section.cpp; they are separate because the
// runtime only reads.
#include "formats/nif/asset.hpp"

namespace nif::format {

bool ColorsRecords::has(const Object& object) { return object.colors.has_value(); }

std::vector<ColorsRecord> ColorsRecords::write(const Object& object, uint32_t number, Section& payloads) {
  ColorsRecord record{};
  record.object = number;
  record.surface_voxels = uint32_t(object.colors->size());
  record.values = payloads.add_payload(*object.colors);
  return {record};
}

}  // namespace nif::format
