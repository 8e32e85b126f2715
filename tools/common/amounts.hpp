// Parses rates, sizes and counts given on the command line.
#pragma once

#include <cstdint>
#include <string>

namespace nif::tools {

/// "0.002" or "0.2%". Throws nif::Error(usage) naming `option`.
double parse_rate(const std::string& text, const std::string& option);

/// A number of bytes: "200000", "200k" (1000), "1M", "256KiB", "1MiB". Throws nif::Error(usage) naming
/// `option`.
uint64_t parse_bytes(const std::string& text, const std::string& option);

/// "500000", "500k" or "2M". Throws nif::Error(usage) naming `option`.
uint64_t parse_count(const std::string& text, const std::string& option);

}  // namespace nif::tools
