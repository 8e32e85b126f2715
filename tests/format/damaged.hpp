// Ways to break a .nif file in tests, to make its checksums right again afterwards, and to see what the
// reader says.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "formats/base/status.hpp"
#include "formats/nif/container.hpp"
#include "formats/nif/crc32c.hpp"
#include "formats/nif/reader.hpp"

namespace nif::test {

using Bytes = std::vector<std::byte>;

/// Result of reading an asset's bytes as "x.nif".
struct ReadOutcome {
  Status status = Status::ok;
  std::string sentence;
};

inline ReadOutcome outcome_of(std::span<const std::byte> bytes) {
  try {
    format::read_asset(bytes, "x.nif");
    return {};
  } catch (const Error& error) {
    return {error.status(), error.what()};
  }
}

inline Status status_of(const Bytes& file) { return outcome_of(file).status; }

template <class T>
T load(const Bytes& file, size_t offset) {
  T value;
  std::memcpy(&value, file.data() + offset, sizeof(value));
  return value;
}
template <class T>
void store(Bytes& file, size_t offset, const T& value) {
  std::memcpy(file.data() + offset, &value, sizeof(value));
}

inline format::SectionEntry section_entry(const Bytes& file, uint32_t index) {
  return load<format::SectionEntry>(file, sizeof(format::Header) + index * sizeof(format::SectionEntry));
}
inline void store_entry(Bytes& file, uint32_t index, const format::SectionEntry& entry) {
  store(file, sizeof(format::Header) + index * sizeof(format::SectionEntry), entry);
}

/// The index of a section in the table; the file must have it.
inline uint32_t find_section(const Bytes& file, uint32_t type) {
  uint32_t i = 0;
  while (section_entry(file, i).type != type) ++i;
  return i;
}

/// A payload that records of one type have.
struct PayloadKind {
  uint32_t records, values;  ///< types of the sections with the records and with their payloads
  size_t at;                 ///< of the Payload in a record
};
namespace payload {
inline constexpr PayloadKind kWeights{format::kMlps, format::kData, offsetof(format::MlpRecord, weights)},
    kPairWeights{format::kSphericalNetworks, format::kData,
                 offsetof(format::SphericalNetworksRecord, weights)},
    kOccupancy{format::kPlanes, format::kData, offsetof(format::PlanesRecord, occupancy)},
    kCells{format::kPlanes, format::kData, offsetof(format::PlanesRecord, cells)},
    kTree{format::kTriangles, format::kData, offsetof(format::TrianglesRecord, tree)},
    kCorners{format::kNetworks, format::kData, offsetof(format::NetworkRecord, brick_corners)},
    kFeatures{format::kNetworks, format::kData, offsetof(format::NetworkRecord, features)},
    kAlphaTiles{format::kAlphaMaps, format::kData, offsetof(format::AlphaMapRecord, tiles)},
    kHoles{format::kHoles, format::kData, offsetof(format::HolesRecord, holes)},
    kGrids{format::kSphericalRecords, format::kData, offsetof(format::SphericalRecord, grids)},
    kPrimaryValues{format::kPrimaries, format::kPrimaryValues, offsetof(format::PrimaryRecord, values)},
    kNumbers{format::kNumbersRecords, format::kNumbersValues, offsetof(format::NumbersRecord, numbers)},
    kColors{format::kColorRecords, format::kColorValues, offsetof(format::ColorsRecord, values)},
    kSkin{format::kSkinRecords, format::kSkinValues, offsetof(format::SkinRecord, values)};
inline constexpr PayloadKind kPayloadKinds[] = {kWeights, kPairWeights, kOccupancy, kCells,         kTree,
                                                kCorners, kFeatures,    kGrids,     kPrimaryValues, kNumbers,
                                                kColors,  kAlphaTiles,  kHoles,     kSkin};
}  // namespace payload

/// One section of a file, with any content.
struct Part {
  uint32_t type, flags;
  Bytes content;
  uint32_t record_size = 0;

  size_t count() const { return record_size ? content.size() / record_size : 0; }
};

/// Null if there is none.
inline Part* find_part(std::vector<Part>& parts, uint32_t type) {
  const auto at = std::ranges::find(parts, type, &Part::type);
  return at == parts.end() ? nullptr : &*at;
}
/// The parts have it.
inline Part& section_of(std::vector<Part>& parts, uint32_t type) { return *find_part(parts, type); }

/// Calls each(records, place of the Payload in their content, section with the payloads) for those whose
/// sections and records are there.
template <class Each>
void for_each_payload(std::vector<Part>& parts, const Each& each) {
  for (const PayloadKind& kind : payload::kPayloadKinds) {
    Part *records = find_part(parts, kind.records), *values = find_part(parts, kind.values);
    if (!records || !values || records->record_size < kind.at + sizeof(format::Payload)) continue;
    for (size_t i = 0; i < records->count(); ++i) each(*records, i * records->record_size + kind.at, *values);
  }
}

inline bool is_within(const format::Payload& payload, const Bytes& values) {
  return payload.offset <= values.size() && payload.bytes <= values.size() - payload.offset;
}

/// Adds so many bytes to each record, as later versions may.
inline void lengthen_records(Part& part, uint32_t more, std::byte fill) {
  Bytes longer;
  for (size_t i = 0; i < part.count(); ++i) {
    const auto at = part.content.begin() + ptrdiff_t(i * part.record_size);
    longer.insert(longer.end(), at, at + part.record_size);
    longer.resize(longer.size() + more, fill);
  }
  if (part.record_size == 0) return;
  part.content = std::move(longer);
  part.record_size += more;
}

inline Bytes payload_of(std::vector<Part>& parts, const PayloadKind& kind, size_t index) {
  const Part& records = section_of(parts, kind.records);
  const auto payload = load<format::Payload>(records.content, index * records.record_size + kind.at);
  const auto from = std::span(section_of(parts, kind.values).content).subspan(payload.offset, payload.bytes);
  return {from.begin(), from.end()};
}

/// Replaces a payload. Those after it move, and records say so; checksums are left to file_of().
inline void set_payload(std::vector<Part>& parts, const PayloadKind& kind, size_t index,
                        const Bytes& content) {
  Part &own = section_of(parts, kind.records), &values = section_of(parts, kind.values);
  const size_t own_at = index * own.record_size + kind.at;
  const auto before = load<format::Payload>(own.content, own_at);
  const uint64_t end = before.offset + before.bytes,
                 room = std::min<uint64_t>(format::aligned(end), values.content.size()),
                 start = format::aligned(before.offset + content.size());
  Bytes rest(values.content.begin() + ptrdiff_t(room), values.content.end());
  values.content.resize(before.offset);
  values.content.insert(values.content.end(), content.begin(), content.end());
  if (!rest.empty()) values.content.resize(start);
  values.content.insert(values.content.end(), rest.begin(), rest.end());
  for_each_payload(parts, [&](Part& records, size_t at, Part& in) {
    if (&in != &values) return;
    auto payload = load<format::Payload>(records.content, at);
    if (&records == &own && at == own_at)
      payload.bytes = content.size();
    else if (payload.offset > before.offset || (payload.offset == before.offset && before.bytes == 0))
      payload.offset += start - format::aligned(end);
    if (payload.bytes == 0 && payload.offset > in.content.size() && payload.offset <= start)
      in.content.resize(payload.offset);
    store(records.content, at, payload);
  });
}

/// The sections that the table names; none where one of them lies outside of the file.
inline std::vector<Part> parts_of(const Bytes& file) {
  std::vector<Part> parts;
  if (file.size() < sizeof(format::Header)) return parts;
  const auto header = load<format::Header>(file, 0);
  const uint64_t room = (file.size() - sizeof(header)) / sizeof(format::SectionEntry);
  const auto count = uint32_t(std::min<uint64_t>(std::min(header.section_count, format::kMaxSections), room));
  for (uint32_t i = 0; i < count; ++i) {
    const auto entry = section_entry(file, i);
    if (entry.offset > file.size() || entry.bytes > file.size() - entry.offset) return {};
    const auto content = std::span(file).subspan(entry.offset, entry.bytes);
    parts.push_back({entry.type, entry.flags, {content.begin(), content.end()}, entry.record_size});
  }
  return parts;
}

/// Computes every checksum anew, as far as the file's lengths allow: of payloads, of sections, of the shell.
inline void fix_checksums(Bytes& file) {
  if (file.size() < sizeof(format::Header)) return;
  auto header = load<format::Header>(file, 0);
  const uint64_t room = (file.size() - sizeof(header)) / sizeof(format::SectionEntry);
  const auto count = uint32_t(std::min<uint64_t>(header.section_count, room));
  const auto within = [](uint64_t offset, uint64_t bytes, uint64_t size) {
    return offset <= size && bytes <= size - offset;
  };
  const auto entry_of = [&](uint32_t type) {
    for (uint32_t i = 0; i < count; ++i)
      if (const auto entry = section_entry(file, i);
          entry.type == type && within(entry.offset, entry.bytes, file.size()))
        return entry;
    return format::SectionEntry{};
  };
  for (const PayloadKind& kind : payload::kPayloadKinds) {
    const auto records = entry_of(kind.records), values = entry_of(kind.values);
    if (records.record_size < kind.at + sizeof(format::Payload) || values.offset == 0) continue;
    for (uint64_t i = 0; i < records.bytes / records.record_size; ++i) {
      const uint64_t at = records.offset + i * records.record_size + kind.at;
      auto payload = load<format::Payload>(file, at);
      if (!within(payload.offset, payload.bytes, values.bytes)) continue;
      payload.crc = format::crc32c(std::span(file).subspan(values.offset + payload.offset, payload.bytes));
      store(file, at, payload);
    }
  }
  for (uint32_t i = 0; i < count; ++i) {
    auto entry = section_entry(file, i);
    if (!within(entry.offset, entry.bytes, file.size())) continue;
    entry.crc = entry.flags & format::kPayloads
                    ? 0
                    : format::crc32c(std::span(file).subspan(entry.offset, entry.bytes));
    store_entry(file, i, entry);
  }
  header.table_crc = format::crc32c(
      std::span<const std::byte>(file).subspan(sizeof(header), count * sizeof(format::SectionEntry)));
  header.header_crc = 0;
  header.header_crc = format::crc32c(std::as_bytes(std::span(&header, 1)));
  store(file, 0, header);
}

/// A file of these sections with the header of `before`; lengths, offsets and checksums are right.
inline Bytes file_of(const Bytes& before, const std::vector<Part>& parts) {
  Bytes file(sizeof(format::Header) + parts.size() * sizeof(format::SectionEntry));
  for (uint32_t i = 0; i < parts.size(); ++i) {
    file.resize(format::aligned(file.size()));
    const Bytes& content = parts[i].content;
    store_entry(file, i,
                {parts[i].type, parts[i].flags, file.size(), content.size(), 0, parts[i].record_size});
    file.insert(file.end(), content.begin(), content.end());
  }
  auto header = load<format::Header>(before, 0);
  header.section_count = uint32_t(parts.size());
  header.file_bytes = file.size();
  store(file, 0, header);
  fix_checksums(file);
  return file;
}

/// Where a payload's bytes begin in a file.
inline size_t payload_at(const Bytes& file, const PayloadKind& kind, size_t index) {
  const auto records = section_entry(file, find_section(file, kind.records));
  const auto payload = load<format::Payload>(file, records.offset + index * records.record_size + kind.at);
  return section_entry(file, find_section(file, kind.values)).offset + payload.offset;
}

/// Changes one record in place and makes the checksums right.
template <class Record>
Bytes with_record(Bytes file, uint32_t section, uint32_t index, const std::function<void(Record&)>& change) {
  const auto entry = section_entry(file, find_section(file, section));
  const size_t at = entry.offset + uint64_t{index} * entry.record_size;
  auto record = load<Record>(file, at);
  change(record);
  store(file, at, record);
  fix_checksums(file);
  return file;
}

/// A file whose record of holes `index` has these, which need not be right.
inline Bytes with_holes(const Bytes& file, size_t index, const format::HolesData& holes) {
  std::vector<Part> parts = parts_of(file);
  Part& records = section_of(parts, format::kHoles);
  auto record = load<format::HolesRecord>(records.content, index * records.record_size);
  record.patches = uint32_t(holes.patches.size());
  store(records.content, index * records.record_size, record);
  const auto patches = std::as_bytes(std::span(holes.patches)),
             numbers = std::as_bytes(std::span(holes.numbers));
  Bytes content(patches.begin(), patches.end());
  content.insert(content.end(), numbers.begin(), numbers.end());
  set_payload(parts, payload::kHoles, index, content);
  return file_of(file, parts);
}

/// The same of a skin, of which only the values change.
inline Bytes with_skin(const Bytes& file, size_t index, const format::Skin& skin) {
  std::vector<Part> parts = parts_of(file);
  Bytes content;
  for (const auto bytes : {std::as_bytes(std::span(skin.weights)), std::as_bytes(std::span(skin.targets)),
                           std::as_bytes(std::span(skin.joints))})
    content.insert(content.end(), bytes.begin(), bytes.end());
  set_payload(parts, payload::kSkin, index, content);
  return file_of(file, parts);
}

/// Types of the sections of a part.
template <class Part>
std::vector<uint32_t> sections_of(Part) {
  std::vector<uint32_t> types{Part::kRecords};
  if constexpr (requires { typename Part::Shared; }) types.push_back(Part::Shared::kRecords);
  return types;
}

/// The bytes in a heap block of exactly their length, so that the address sanitizer sees every overread.
class ExactBuffer {
 public:
  explicit ExactBuffer(std::span<const std::byte> bytes)
      : data_(static_cast<std::byte*>(::operator new(bytes.size()))), size_(bytes.size()) {
    if (size_ > 0) std::memcpy(data_, bytes.data(), size_);
  }
  ExactBuffer(const ExactBuffer&) = delete;
  ExactBuffer& operator=(const ExactBuffer&) = delete;
  ~ExactBuffer() { ::operator delete(data_); }
  std::span<const std::byte> bytes() const { return {data_, size_}; }

 private:
  std::byte* data_;
  size_t size_;
};

}  // namespace nif::test
