// What all fuzzers share: a check that stops them, choices made by the input, rays, and files without a disk.
#pragma once

#include <sys/mman.h>
#include <unistd.h>

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <new>
#include <string>
#include <string_view>

#include "formats/base/status.hpp"

namespace nif::test {

/// What must hold for any input; otherwise the fuzzer has found a defect.
inline void must(bool condition, const char* file = __builtin_FILE(), int line = __builtin_LINE()) {
  if (condition) return;
  std::fprintf(stderr, "%s:%d: what must hold does not\n", file, line);
  std::abort();
}

/// Checks a reader's refusal: a specific status, and a sentence that names the file.
inline void must_refuse_well(const Error& error, std::string_view file) {
  if (error.status() == Status::internal || error.status() == Status::ok ||
      std::string_view(error.what()).find(file) == std::string_view::npos) {
    std::fprintf(stderr, "refused by status %d: %s\n", int(error.status()), error.what());
    std::abort();
  }
}

/// Counts the library's memory, and stops it if that is out of proportion to the input.
struct Budget {
  uint64_t held = 0, limit = ~uint64_t{0};

  static void* allocate(void* user, uint64_t bytes, uint64_t alignment) {
    auto& self = *static_cast<Budget*>(user);
    self.held += bytes;
    must(self.held <= self.limit);
    return ::operator new(bytes, std::align_val_t(alignment));
  }
  static void deallocate(void* user, void* memory, uint64_t bytes, uint64_t alignment) {
    static_cast<Budget*>(user)->held -= bytes;
    ::operator delete(memory, std::align_val_t(alignment));
  }
};

/// The most memory that an asset of this many bytes may take while it is loaded (docs/format.md). Uniform
/// bricks take most: a word for each of 64 voxels, and slightly more than that again while boxes are
/// computed. Each brick takes at least two bytes in the file, coded or not. Coded payloads decode to at most
/// 16 times their size, plus one cache line for each of three.
constexpr uint64_t most_memory(uint64_t file_bytes) { return 282 * file_bytes + (64 << 10); }

/// Numbers from the front of the input; zeros when it is used up.
class Choices {
 public:
  Choices(const uint8_t* data, size_t size) : data_(data), size_(size) {}

  uint8_t byte() {
    if (size_ == 0) return 0;
    --size_;
    return *data_++;
  }
  uint32_t below(uint32_t n) { return n <= 256 ? byte() % n : (uint32_t(byte()) << 8 | byte()) % n; }
  uint32_t word() {
    uint32_t value = 0;
    for (int i = 0; i < 4; ++i) value = value << 8 | byte();
    return value;
  }
  /// Usually a small number, sometimes any bits.
  float number() {
    const uint8_t kind = byte();
    if (kind < 200) return static_cast<float>(int8_t(byte())) / 16;
    float value;
    const uint32_t bits = word();
    std::memcpy(&value, &bits, sizeof value);
    return value;
  }
  bool empty() const { return size_ == 0; }
  /// The rest.
  std::string_view rest() const { return {reinterpret_cast<const char*>(data_), size_}; }

 private:
  const uint8_t* data_;
  size_t size_;
};

/// The input's text with repetitions: the byte 0x1e, a byte n, some text and 0x1f stand for that text 2^(n
/// mod 17) times. So a short input can describe a deep or long file.
inline std::string spelled_out(std::string_view text) {
  const size_t most = text.size() + (64 << 10);
  std::string out;
  while (true) {
    const size_t open = text.find('\x1e'), close = open == text.npos ? open : text.find('\x1f', open);
    out += text.substr(0, open);
    if (open == text.npos) return out;
    if (close == text.npos || close < open + 2) return out += text.substr(open);
    std::string many(text.substr(open + 2, close - open - 2));
    for (uint32_t n = uint8_t(text[open + 1]) % 17; n > 0 && out.size() + 2 * many.size() <= most; --n)
      many += many;
    if (out.size() + many.size() <= most) out += many;
    text.remove_prefix(close + 1);
  }
}

/// The input as a file that lies in memory.
class MemoryFile {
 public:
  explicit MemoryFile(std::string_view bytes) : file_(memfd_create("fuzz", 0)) {
    must(file_ >= 0);
    while (!bytes.empty()) {
      const ssize_t written = ::write(file_, bytes.data(), bytes.size());
      must(written > 0);
      bytes.remove_prefix(size_t(written));
    }
    path_ = "/proc/self/fd/" + std::to_string(file_);
  }
  ~MemoryFile() { ::close(file_); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;
  const std::string& path() const { return path_; }

 private:
  int file_;
  std::string path_;
};

}  // namespace nif::test
