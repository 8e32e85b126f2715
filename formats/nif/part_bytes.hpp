// What the payloads of a part take: of a file, and of memory where they are coded there.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory_resource>
#include <vector>

#include "formats/base/size.hpp"
#include "formats/nif/container.hpp"

namespace nif::format {

/// How many bytes of a file some payload of a part takes, and of memory beside it where it is coded; names
/// are those of the tools' JSON.
struct PartBytes {
  const char* name;
  uint64_t bytes;
  uint64_t decoded = 0;
};

/// Where a part has coded payloads, all of its payloads decode to at most so many times what they take of the
/// file. So the size of a file bounds the memory that it needs.
inline constexpr uint64_t kMostExpansion = 16;

/// What a payload takes.
struct PayloadBytes {
  uint64_t file = 0;
  uint64_t decoded = 0;  ///< in memory; 0 where it is used in place
};

/// The memory of payloads that were coded in a file.
class DecodedPayloads {
 public:
  explicit DecodedPayloads(std::pmr::memory_resource* memory) : payloads_(memory) {}
  /// Not copied, because fields point to what is decoded.
  DecodedPayloads(DecodedPayloads&&) = default;

  /// Zeros, a line more than `bytes`, because kernels load more than the last few. They stay where
  /// they are; `taken` is told how many there are.
  std::byte* add(uint64_t bytes, PayloadBytes& taken) {
    const size_t lines = memory_size(aligned(bytes) / kAlignment + 1);
    taken.decoded += uint64_t{lines} * kAlignment;
    return payloads_.emplace_back(lines).front().bytes;
  }
  /// Without what is decoded.
  uint64_t view_bytes() const { return payloads_.capacity() * sizeof(payloads_[0]); }
  void drop() { payloads_ = std::pmr::vector<std::pmr::vector<Line>>(payloads_.get_allocator()); }

 private:
  struct alignas(kAlignment) Line {
    std::byte bytes[kAlignment];
  };
  std::pmr::vector<std::pmr::vector<Line>> payloads_;
};

}  // namespace nif::format
