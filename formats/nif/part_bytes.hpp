// Counts the bytes of a part's payloads: in a file, and in memory if they are coded there.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory_resource>
#include <vector>

#include "formats/base/size.hpp"
#include "formats/nif/container.hpp"

namespace nif::format {

/// Bytes of a payload of a part in the file, and in memory beside it if it is coded. Names are those of the
/// tools' JSON.
struct PartBytes {
  const char* name;
  uint64_t bytes;
  uint64_t decoded = 0;
};

/// If a part has coded payloads, all of its payloads together decode to at most this many times their bytes
/// in the file. So the size of a file bounds the memory that it needs.
inline constexpr uint64_t kMostExpansion = 16;

/// Bytes of a payload.
struct PayloadBytes {
  uint64_t file = 0;
  uint64_t decoded = 0;  ///< in memory; 0 if it is used in place
};

/// Memory of payloads that are coded in a file.
class DecodedPayloads {
 public:
  explicit DecodedPayloads(std::pmr::memory_resource* memory) : payloads_(memory) {}
  /// Not copyable, because fields point to decoded data.
  DecodedPayloads(DecodedPayloads&&) = default;

  /// Zeros, one cache line more than `bytes`, because kernels load beyond the end. They do not move; their
  /// count is added to `taken`.
  std::byte* add(uint64_t bytes, PayloadBytes& taken) {
    const size_t lines = memory_size(aligned(bytes) / kAlignment + 1);
    taken.decoded += uint64_t{lines} * kAlignment;
    return payloads_.emplace_back(lines).front().bytes;
  }
  /// Without the decoded data.
  uint64_t view_bytes() const { return payloads_.capacity() * sizeof(payloads_[0]); }
  void drop() { payloads_ = std::pmr::vector<std::pmr::vector<Line>>(payloads_.get_allocator()); }

 private:
  struct alignas(kAlignment) Line {
    std::byte bytes[kAlignment];
  };
  std::pmr::vector<std::pmr::vector<Line>> payloads_;
};

}  // namespace nif::format
