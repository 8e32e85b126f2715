// Shared by the readers of a .nif file's sections: records copied out one at a time, payloads handed out in
// order, and refusals that name the place.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <span>
#include <string>

#include "formats/nif/container.hpp"
#include "formats/nif/crc32c.hpp"

namespace nif::format {

using Bytes = std::span<const std::byte>;
struct AssetView;

/// The sections of a file, by type.
class SectionTable {
 public:
  explicit SectionTable(std::span<const SectionView> sections) : sections_(sections) {}
  /// Empty if the file has no such section.
  SectionView operator[](uint32_t type) const {
    for (const SectionView& section : sections_)
      if (section.type == type) return section;
    return {type, 0, 0, 0, {}};
  }
  bool has(uint32_t type) const {
    return std::any_of(sections_.begin(), sections_.end(),
                       [&](const SectionView& section) { return section.type == type; });
  }

 private:
  std::span<const SectionView> sections_;
};

/// The bounds of an object, as in its record.
struct Bounds {
  std::array<float, 3> min{}, max{};
};

/// One place in the file, for messages; built only if something is wrong.
struct Place {
  std::string_view file;
  uint32_t section;  ///< its type
  uint64_t record;

  [[noreturn]] void damaged(Rule rule, const std::string& what = {}) const {
    refuse(rule, file, text(), what);
  }
  void require(bool good, Rule rule) const {
    if (!good) damaged(rule);
  }
  void within(uint64_t value, uint64_t low, uint64_t high, const char* name, Rule rule) const {
    if (value < low || value > high)
      damaged(rule, std::string(name) + " is " + std::to_string(value) + ", not " + std::to_string(low) +
                        " to " + std::to_string(high));
  }
  std::string text() const {
    return "section " + section_name(section) + ", record " + std::to_string(record);
  }
};

template <class T>
bool all_finite(const T& values) {
  return std::all_of(std::begin(values), std::end(values), [](float v) { return std::isfinite(v); });
}

template <class T>
bool all_zero(const T& values) {
  return std::all_of(std::begin(values), std::end(values), [](auto value) { return value == 0; });
}

/// Hands out the payloads of a section in the order of their records. What lies between payloads, or follows
/// the last one, belongs to something that this build does not know.
class Payloads {
 public:
  explicit Payloads(Bytes section) : section_(section) {}

  Bytes next(const Payload& payload, uint64_t expected, const char* name, const Place& place) {
    const auto what = [&] { return std::string(name) + " payload"; };
    const uint64_t first = aligned(end_);
    if (payload.offset % kAlignment != 0 || payload.offset < first)
      place.damaged(Rule::payload_place,
                    what() + " does not start at a multiple of 64 after the one before it");
    place.require(payload.reserved == 0, Rule::reserved_not_zero);
    if (payload.bytes != expected)
      place.damaged(Rule::payload_size, what() + " has " + std::to_string(payload.bytes) + " bytes, not " +
                                            std::to_string(expected));
    if (payload.offset > section_.size() || payload.bytes > section_.size() - payload.offset)
      place.damaged(Rule::payload_past_end, what() + " reaches past the end of its section");
    // Both fit in memory, because the section does.
    const auto offset = size_t(payload.offset), bytes = size_t(payload.bytes);
    if (offset == first)
      for (size_t at = end_; at < offset; ++at)
        if (section_[at] != std::byte{0})
          place.damaged(Rule::payload_padding, "padding before the " + what() + " is not zero");
    end_ = offset + bytes;
    const Bytes content = section_.subspan(offset, bytes);
    if (crc32c(content) != payload.crc)
      place.damaged(Rule::payload_checksum, what() + " has a wrong checksum");
    return content;
  }

 private:
  Bytes section_;
  size_t end_ = 0;
};

/// Records of one section, copied out one at a time. They may be longer than this build knows: what follows is
/// ignored. Those of a first version may be shorter: what is missing has its initial value.
template <class Record>
class Records {
 public:
  static_assert(sizeof(Record) % 8 == 0);
  static constexpr size_t kLeast = [] {
    if constexpr (requires { Record::kFirstBytes; }) return size_t{Record::kFirstBytes};
    return sizeof(Record);
  }();

  Records(const SectionView& section, std::string_view file)
      : section_(section), file_(file), size_(std::max<size_t>(section.record_size, kLeast)) {
    const bool there = section.bytes.data() != nullptr;  // otherwise there is no such section
    if ((there && section.record_size < kLeast) || section.bytes.size() % size_ != 0 ||
        section.bytes.size() / size_ > 0xffffffffu)
      refuse(Rule::record_size, file, "section " + section_name(section.type),
             std::to_string(section.bytes.size()) + " bytes are not a multiple of the record size " +
                 std::to_string(section.record_size) + ", which is at least " + std::to_string(kLeast));
  }
  uint32_t count() const { return uint32_t(section_.bytes.size() / size_); }
  Record operator[](uint32_t i) const {
    Record record{};
    std::memcpy(&record, section_.bytes.data() + uint64_t(i) * size_, std::min(size_, sizeof(Record)));
    return record;
  }
  Place place(uint32_t i) const { return {file_, section_.type, i}; }

 private:
  SectionView section_;
  std::string_view file_;
  size_t size_;
};

/// What the reader of one record is given besides.
struct Reading {
  Place place;
  Payloads& payloads;  ///< to take those of the record from, in their order
  AssetView& asset;    ///< what was read before: of parts, what objects share
};

}  // namespace nif::format
