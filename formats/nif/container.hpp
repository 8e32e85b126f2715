// The outer shell of a .nif file: identifier, header, section table, checksums. reader.cpp reads the contents
// of the sections.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory_resource>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "formats/nif/layout.hpp"
#include "formats/nif/rules.hpp"

namespace nif::format {

/// One section of a file whose shell has been checked.
struct SectionView {
  uint32_t type = 0;
  uint32_t flags = 0;
  uint32_t record_size = 0;
  uint64_t offset = 0;  ///< from the start of the file
  std::span<const std::byte> bytes;
};

/// Throws a Refusal: "<file>: <place>: <what>". Without `what`, the text of the rule is used.
[[noreturn]] void refuse(Rule rule, std::string_view file, const std::string& place,
                         const std::string& what = {});

/// A section's type as text: "OBJS", or hexadecimal if it is not printable.
std::string section_name(uint32_t type);

/// Checks the first 64 bytes of a file (fewer if it is shorter) against the file's true length. A loader
/// calls this before it allocates memory for the rest.
Header check_header(std::span<const std::byte> start, uint64_t file_bytes, std::string_view file);

/// Checks identifier, version, lengths, order, padding and checksums of a whole file. Every byte of it is then
/// known to be in the header, in the table, in exactly one section, or a padding zero. Checksums of payloads
/// are left to whoever reads them.
std::pmr::vector<SectionView> open_container(std::span<const std::byte> bytes, std::string_view file,
                                             std::pmr::memory_resource* memory);

/// The next multiple of the alignment of sections and payloads. For values below 2^63.
constexpr uint64_t aligned(uint64_t offset) { return (offset + kAlignment - 1) / kAlignment * kAlignment; }

}  // namespace nif::format
