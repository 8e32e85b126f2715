// Checks a .nif file's shell, all in integers: no pointer into the file is formed before its range is known
// to lie inside.
#include "formats/nif/container.hpp"

#include <algorithm>
#include <bit>
#include <cstring>
#include <optional>

#include "formats/nif/crc32c.hpp"

namespace nif::format {
namespace {

static_assert(std::endian::native == std::endian::little, "a .nif file is used in place, and little-endian");

bool starts_with(std::span<const std::byte> bytes, std::string_view text) {
  return bytes.size() >= text.size() && std::memcmp(bytes.data(), text.data(), text.size()) == 0;
}

std::string at_byte(uint64_t offset) { return "byte " + std::to_string(offset); }

/// The two digits of an identifier of ours, if they are others; nothing for all other bytes.
std::optional<std::string> other_version(std::span<const std::byte> start) {
  if (start.size() < sizeof(kIdentifier)) return std::nullopt;
  std::string digits;
  for (size_t i = 0; i < sizeof(kIdentifier); ++i) {
    const char c = static_cast<char>(start[i]);
    if (i == 5 || i == 6) {
      if (c < '0' || c > '9') return std::nullopt;
      digits += c;
    } else if (start[i] != std::byte(kIdentifier[i])) {
      return std::nullopt;
    }
  }
  return digits;
}

/// Reports in which way a file is not a .nif file.
void check_identifier(std::span<const std::byte> start, std::string_view file) {
  if (start.empty()) refuse(Rule::empty_file, file, "");
  const std::string_view ours(reinterpret_cast<const char*>(kIdentifier), sizeof(kIdentifier));
  if (starts_with(start, ours)) return;
  if (const auto digits = other_version(start))
    refuse(Rule::other_version, file, "header",
           *digits == "10"
               ? "format version 1 or an experimental version 2, which are no longer read; bake the "
                 "mesh again"
               : "format version " + digits->substr(0, 1) + "." + digits->substr(1) +
                     "; this build reads version 2.0");
  for (std::string_view engine : {"NetImmerse File Format", "Gamebryo File Format"})
    if (starts_with(start, engine)) refuse(Rule::foreign_file, file, "");
  if (start.size() < ours.size() &&
      ours.starts_with(std::string_view(reinterpret_cast<const char*>(start.data()), start.size())))
    refuse(Rule::cut_header, file, "",
           "ends after " + std::to_string(start.size()) + " bytes, within the identifier");
  if (starts_with(start, ours.substr(0, 4)) || starts_with(start.subspan(1), ours.substr(1, 6)))
    refuse(Rule::changed_identifier, file, "identifier");
  refuse(Rule::other_file, file, "");
}

void check_padding(std::span<const std::byte> bytes, size_t begin, size_t end, std::string_view file) {
  for (size_t at = begin; at < end; ++at)
    if (bytes[at] != std::byte{0}) refuse(Rule::padding_not_zero, file, at_byte(at));
}

}  // namespace

void refuse(Rule rule, std::string_view file, const std::string& place, const std::string& what) {
  const std::string wrong = what.empty() ? text_of(rule).what : what;
  throw Refusal(rule, place, wrong,
                std::string(file) + ": " + (place.empty() ? wrong : place + ": " + wrong));
}

std::string section_name(uint32_t type) {
  std::string name;
  for (int i = 0; i < 4; ++i) {
    const char c = char((type >> (8 * i)) & 0xff);
    if (c < 0x20 || c > 0x7e) {
      constexpr char kDigits[] = "0123456789abcdef";
      name = "0x";
      for (int shift = 28; shift >= 0; shift -= 4) name += kDigits[(type >> shift) & 15];
      return name;
    }
    name += c;
  }
  return name;
}

Header check_header(std::span<const std::byte> start, uint64_t file_bytes, std::string_view file) {
  check_identifier(start, file);
  if (start.size() < sizeof(Header))
    refuse(Rule::cut_header, file, "header",
           "ends after " + std::to_string(start.size()) + " of its 64 bytes");
  Header header;
  std::memcpy(&header, start.data(), sizeof(header));
  Header zeroed = header;
  zeroed.header_crc = 0;
  if (crc32c(std::as_bytes(std::span(&zeroed, 1))) != header.header_crc)
    refuse(Rule::header_checksum, file, "header");
  if (header.version < kVersion)
    refuse(Rule::other_version, file, "header",
           "format version " + std::to_string(header.version) + " is no longer read; bake the mesh again");
  if (header.version > kVersion)
    refuse(Rule::other_version, file, "header",
           "format version " + std::to_string(header.version) + "; this build reads version " +
               std::to_string(kVersion));
  if (header.arithmetic == 0 || header.arithmetic > kArithmetic)
    refuse(Rule::unknown_arithmetic, file, "header",
           "is to be answered by revision " + std::to_string(header.arithmetic) +
               " of the arithmetic; this build knows revisions 1 to " + std::to_string(kArithmetic));
  if (unknown_flags(header.flags, kPlacesNothing) != 0) refuse(Rule::unknown_flags, file, "header");
  if (std::any_of(std::begin(header.reserved), std::end(header.reserved), [](uint32_t r) { return r != 0; }))
    refuse(Rule::reserved_not_zero, file, "header");
  if (header.section_count == 0 || header.section_count > kMaxSections)
    refuse(Rule::section_count, file, "header",
           std::to_string(header.section_count) + " sections, not 1 to " + std::to_string(kMaxSections));
  if (file_bytes < header.file_bytes)
    refuse(Rule::cut_file, file, "",
           "ends after " + std::to_string(file_bytes) + " of the " + std::to_string(header.file_bytes) +
               " bytes that its header states");
  if (file_bytes > header.file_bytes)
    refuse(Rule::bytes_after_end, file, at_byte(header.file_bytes),
           std::to_string(file_bytes - header.file_bytes) + " bytes follow the end that the header states");
  return header;
}

std::pmr::vector<SectionView> open_container(std::span<const std::byte> bytes, std::string_view file,
                                             std::pmr::memory_resource* memory) {
  const Header header = check_header(bytes.first(std::min(bytes.size(), sizeof(Header))), bytes.size(), file);
  const uint64_t table_end = sizeof(Header) + uint64_t(header.section_count) * sizeof(SectionEntry);
  if (table_end > bytes.size()) refuse(Rule::table_past_end, file, "section table");
  const auto table = bytes.subspan(sizeof(Header), header.section_count * sizeof(SectionEntry));
  if (crc32c(table) != header.table_crc) refuse(Rule::table_checksum, file, "section table");

  std::pmr::vector<SectionView> sections(memory);
  sections.reserve(header.section_count);
  auto end = size_t(table_end);
  for (uint32_t i = 0; i < header.section_count; ++i) {
    SectionEntry entry;
    std::memcpy(&entry, table.data() + i * sizeof(entry), sizeof(entry));
    const std::string place = "section " + section_name(entry.type) + " (entry " + std::to_string(i) + ")";
    const auto damaged = [&](Rule rule, const std::string& what = {}) { refuse(rule, file, place, what); };
    if (unknown_flags(entry.flags, kSectionFlags) != 0) damaged(Rule::unknown_flags);
    // `end` is at most the file's size, so aligned() cannot wrap; nor can the sum, once the offset is right.
    if (entry.offset != aligned(end))
      damaged(Rule::section_place,
              "starts at byte " + std::to_string(entry.offset) + ", not at " + std::to_string(aligned(end)));
    if (entry.offset > bytes.size() || entry.bytes > bytes.size() - entry.offset)
      damaged(Rule::section_past_end);
    // Both fit in memory, because the file does.
    const auto offset = size_t(entry.offset), size = size_t(entry.bytes);
    check_padding(bytes, end, offset, file);
    end = offset + size;
    const auto content = bytes.subspan(offset, size);
    if ((entry.flags & kPayloads) == 0) {
      if (crc32c(content) != entry.crc) damaged(Rule::section_checksum);
    } else if (entry.crc != 0) {
      damaged(Rule::payloads_checksum);
    }
    if (entry.record_size != 0 && (entry.record_size % 8 != 0 || size % entry.record_size != 0))
      damaged(Rule::record_size, std::to_string(size) + " bytes are not a multiple of the record size " +
                                     std::to_string(entry.record_size));
    for (const SectionView& other : sections)
      if (other.type == entry.type) damaged(Rule::section_twice);
    sections.push_back({entry.type, entry.flags, entry.record_size, entry.offset, content});
  }
  if (end != bytes.size())
    refuse(Rule::bytes_of_no_section, file, at_byte(end),
           std::to_string(bytes.size() - end) + " bytes belong to no section");
  return sections;
}

}  // namespace nif::format
