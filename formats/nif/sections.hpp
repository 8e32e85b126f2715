// The sections of a .nif file while it is written, or while only its size is computed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "formats/base/size.hpp"
#include "formats/nif/container.hpp"
#include "formats/nif/crc32c.hpp"
#include "formats/nif/layout.hpp"

namespace nif::format {

/// Values of `spherical` objects to be written.
struct Values {
  const std::vector<float>& values;
  bool half;
};

/// The growing bytes of one section.
class Section {
 public:
  /// `counting`: only adds up sizes, and stores nothing.
  explicit Section(bool counting) : counting_(counting) {}

  template <class T>
  void append(const T* values, size_t count) {
    static_assert(std::is_trivially_copyable_v<T>);
    size_ += count * sizeof(T);
    if (counting_) return;
    const auto bytes = std::as_bytes(std::span(values, count));
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
  }
  template <class T>
  void append(const std::vector<T>& values) {
    append(values.data(), values.size());
  }
  /// In half precision or as they are.
  void append(const Values& values);
  /// The next payload: arrays without gaps.
  template <class... Array>
  Payload add_payload(const Array&... arrays) {
    has_payloads_ = true;
    size_ = aligned(size_);
    if (!counting_) bytes_.resize(memory_size(size_));
    const uint64_t start = size_;
    (append(arrays), ...);
    return {start, size_ - start, crc32c(std::span(bytes_).subspan(counting_ ? 0 : size_t(start))), 0};
  }
  Name append_name(const std::string& name) {
    const Name place{uint32_t(size_), uint32_t(name.size())};
    append(name.c_str(), name.size() + 1);
    return place;
  }
  uint64_t size() const { return size_; }
  /// Including the padding before the next payload, if the section holds payloads.
  uint64_t padded_size() const { return has_payloads_ ? aligned(size_) : size_; }
  const std::vector<std::byte>& bytes() const { return bytes_; }

 private:
  bool counting_, has_payloads_ = false;
  uint64_t size_ = 0;
  std::vector<std::byte> bytes_;
};

/// All sections of a file, in their order.
class Sections {
 public:
  struct Entry {
    uint32_t type, flags, record_size;
    Section section;
  };
  explicit Sections(bool counting) : counting_(counting) {}
  /// Adds a section, which does not move.
  Section& add(uint32_t type, uint32_t flags, uint32_t record_size = 0) {
    return entries_.emplace_back(Entry{type, flags, record_size, Section(counting_)}).section;
  }
  const std::deque<Entry>& entries() const { return entries_; }

 private:
  bool counting_;
  std::deque<Entry> entries_;
};

}  // namespace nif::format
