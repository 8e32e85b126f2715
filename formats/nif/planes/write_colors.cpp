// Writes the colours of surface voxels. The reader is in colors.cpp; they are separate because the runtime
// only reads.
#include "formats/nif/planes/colors.hpp"

namespace nif::format {

ColorsWriter::ColorsWriter(Sections& sections)
    : records_(&sections.add(kColorRecords, 0)), values_(&sections.add(kColorValues, 0)) {}

void ColorsWriter::add(const Colors& colors, uint32_t object) {
  ColorsRecord record{};
  record.object = object;
  record.surface_voxels = uint32_t(colors.size());
  record.values = values_->begin_payload();
  values_->append(colors);
  values_->end_payload(record.values);
  records_->append(&record, 1);
}

}  // namespace nif::format
