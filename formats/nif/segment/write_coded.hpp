// Codes the payloads of `segment` objects.
#pragma once

#include <cstddef>
#include <vector>

#include "formats/nif/segment/encoding.hpp"

namespace nif::format {

/// Of one object.
struct CodedPayloads {
  uint32_t forms = 0;  ///< PayloadForm: which there are, and how
  std::vector<std::byte> occupancy, cells, features;
};

/// Codes what data.coded names, where the reader would take it and it becomes smaller; nothing where an
/// object would become smaller than UncodedBytes::may_take() says. All else a file has uncoded, so that data
/// which a reader refuses is still refused.
CodedPayloads encode_payloads(const SegmentData& data);

}  // namespace nif::format
