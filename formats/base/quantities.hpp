// Formats quantities for messages and reports.
#pragma once

#include <cstdint>
#include <string>

namespace nif {

/// "152.3 kB", in powers of 1000.
std::string format_bytes(double bytes);

/// "1 object", "2 objects".
std::string count_of(uint64_t count, const std::string& noun);

}  // namespace nif
