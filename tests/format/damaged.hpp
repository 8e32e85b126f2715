// Ways to break a .nif file in tests, to make its checksums right again afterwards, and to see what the
// reader says.
#pragma once

#include <algorithm>
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

/// Recomputes every checksum, as far as the file's lengths allow.
inline void fix_checksums(Bytes& file) {
  if (file.size() < sizeof(format::Header)) return;
  auto header = load<format::Header>(file, 0);
  const uint64_t room = (file.size() - sizeof(header)) / sizeof(format::SectionEntry);
  const auto count = uint32_t(std::min<uint64_t>(header.section_count, room));
  for (uint32_t i = 0; i < count; ++i) {
    auto entry = section_entry(file, i);
    if (entry.offset > file.size() || entry.bytes > file.size() - entry.offset) continue;
    entry.crc = format::crc32c(std::span(file).subspan(entry.offset, entry.bytes));
    store_entry(file, i, entry);
  }
  header.table_crc = format::crc32c(
      std::span<const std::byte>(file).subspan(sizeof(header), count * sizeof(format::SectionEntry)));
  header.header_crc = 0;
  header.header_crc = format::crc32c(std::as_bytes(std::span(&header, 1)));
  store(file, 0, header);
}

/// One section of a file, with any content.
struct Part {
  uint32_t type, flags;
  Bytes content;
};

/// The sections in the table; empty if one of them lies outside of the file.
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
    parts.push_back({entry.type, entry.flags, {content.begin(), content.end()}});
  }
  return parts;
}

/// A file with these sections and the header of `before`; lengths, offsets and checksums are correct.
inline Bytes file_of(const Bytes& before, const std::vector<Part>& parts) {
  Bytes file(sizeof(format::Header) + parts.size() * sizeof(format::SectionEntry));
  for (uint32_t i = 0; i < parts.size(); ++i) {
    file.resize(format::aligned(file.size()));
    const Bytes& content = parts[i].content;
    store_entry(file, i, {parts[i].type, parts[i].flags, file.size(), content.size(), 0, 0});
    file.insert(file.end(), content.begin(), content.end());
  }
  auto header = load<format::Header>(before, 0);
  header.section_count = uint32_t(parts.size());
  header.file_bytes = file.size();
  store(file, 0, header);
  fix_checksums(file);
  return file;
}

/// Changes one record in place and corrects the checksums.
template <class Record>
Bytes with_record(Bytes file, uint32_t section, uint32_t index, const std::function<void(Record&)>& change) {
  const auto entry = section_entry(file, find_section(file, section));
  const size_t at = entry.offset + index * sizeof(Record);
  auto record = load<Record>(file, at);
  change(record);
  store(file, at, record);
  fix_checksums(file);
  return file;
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
