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

namespace nif::format {

using Bytes = std::span<const std::byte>;

/// The sections of a file, by type.
class SectionTable {
 public:
  explicit SectionTable(std::span<const SectionView> sections) : sections_(sections) {}
  /// Empty if the file has no such section.
  Bytes operator[](uint32_t type) const {
    for (const SectionView& section : sections_)
      if (section.type == type) return section.bytes;
    return {};
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
  const char* section;
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
    return std::string("section ") + section + ", record " + std::to_string(record);
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

/// Hands out the payloads of a section in the order of their records, and makes sure that they fill it.
class Payloads {
 public:
  explicit Payloads(Bytes section) : section_(section) {}

  Bytes next(const Payload& payload, uint64_t expected, const char* name, const Place& place) {
    const std::string what = std::string(name) + " payload";
    if (payload.offset != aligned(end_))
      place.damaged(Rule::payload_place, what + " is not where the one before it ends");
    if (payload.bytes != expected)
      place.damaged(Rule::payload_size, what + " has " + std::to_string(payload.bytes) + " bytes, not " +
                                            std::to_string(expected));
    if (payload.offset > section_.size() || payload.bytes > section_.size() - payload.offset)
      place.damaged(Rule::payload_past_end, what + " reaches past the end of its section");
    // Both fit in memory, because the section does.
    const auto offset = size_t(payload.offset), bytes = size_t(payload.bytes);
    for (size_t at = end_; at < offset; ++at)
      if (section_[at] != std::byte{0})
        place.damaged(Rule::payload_padding, "padding before the " + what + " is not zero");
    end_ = offset + bytes;
    return section_.subspan(offset, bytes);
  }
  /// Checks that all of the section belongs to payloads.
  void finish(const char* section, std::string_view file) const {
    if (end_ != section_.size()) refuse(Rule::bytes_of_no_record, file, std::string("section ") + section);
  }

 private:
  Bytes section_;
  size_t end_ = 0;
};

/// Records of one section, copied out one at a time.
template <class Record>
class Records {
 public:
  Records(Bytes section, const char* name, std::string_view file) : section_(section) {
    if (section.size() % sizeof(Record) != 0 || section.size() / sizeof(Record) > 0xffffffffu)
      refuse(Rule::record_size, file, std::string("section ") + name,
             std::to_string(section.size()) + " bytes are no whole number of records of " +
                 std::to_string(sizeof(Record)));
  }
  uint32_t count() const { return uint32_t(section_.size() / sizeof(Record)); }
  Record operator[](uint32_t i) const {
    Record record;
    std::memcpy(&record, section_.data() + uint64_t(i) * sizeof(Record), sizeof(Record));
    return record;
  }

 private:
  Bytes section_;
};

}  // namespace nif::format
