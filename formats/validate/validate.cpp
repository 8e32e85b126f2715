// Validates a file. The reader comes first; if it refuses the file, that is the finding. Then metadata and
// the model are checked. Last, the asset is written again: different bytes mean that another program wrote
// the file.
#include "formats/validate/validate.hpp"

#include <cstring>
#include <optional>

#include "formats/nif/crc32c.hpp"
#include "formats/nif/writer.hpp"

namespace nif::validate {
namespace {

/// Reports sections with wrong checksums. The header and the table must be right, as they are if the reader
/// complains about a section.
void check_checksums(std::span<const std::byte> bytes, Findings& findings) {
  format::Header header;
  std::memcpy(&header, bytes.data(), sizeof(header));
  for (uint32_t i = 0; i < header.section_count; ++i) {
    format::SectionEntry entry;
    std::memcpy(&entry, bytes.data() + sizeof(header) + i * sizeof(entry), sizeof(entry));
    if (entry.offset > bytes.size() || entry.bytes > bytes.size() - entry.offset) continue;
    if (format::crc32c(bytes.subspan(entry.offset, entry.bytes)) == entry.crc) continue;
    findings.add(uint16_t(format::Rule::section_checksum),
                 "section " + format::section_name(entry.type) + " (entry " + std::to_string(i) + ")");
  }
}

/// Any content has one layout of ours. Other writers may order sections or code payloads otherwise, or add
/// sections of later versions.
bool written_by_us(const format::AssetView& asset) {
  const std::vector<std::byte> again = format::encode(format::to_asset(asset));
  return again.size() == asset.bytes.size() &&
         std::memcmp(again.data(), asset.bytes.data(), again.size()) == 0;
}

}  // namespace

Findings validate(std::span<const std::byte> bytes, std::string_view file_name) {
  Findings findings;
  std::optional<format::AssetView> asset;
  try {
    asset.emplace(format::read_asset(bytes, file_name));
  } catch (const format::Refusal& refusal) {
    if (refusal.rule() == format::Rule::section_checksum)
      check_checksums(bytes, findings);
    else
      findings.add(uint16_t(refusal.rule()), refusal.place(), refusal.what_is_wrong());
    return findings;
  }
  check_metadata(*asset, findings);
  check_model(*asset, findings);
  if (findings.count_of(uint16_t(Advice::section_skipped)) == 0 && !written_by_us(*asset))
    findings.add(Advice::other_writer, "");
  return findings;
}

}  // namespace nif::validate
