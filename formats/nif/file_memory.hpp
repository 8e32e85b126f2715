// The bytes of an asset in memory: read from a file, mapped, copied or borrowed, always aligned as the reader
// and the kernels need it.
#pragma once

#include <cstddef>
#include <memory_resource>
#include <span>
#include <string>
#include <utility>

#include "formats/nif/layout.hpp"

namespace nif::format {

class FileMemory {
 public:
  enum class Mode {
    read,  ///< into memory of our own
    map,   ///< from the system's page cache; the file must not change meanwhile
  };

  /// Opens a file and checks its header before allocating memory for the rest. The path is UTF-8. Throws
  /// nif::Error.
  static FileMemory load(const std::string& path, Mode mode,
                         std::pmr::memory_resource* memory = std::pmr::get_default_resource());
  static FileMemory copy(std::span<const std::byte> bytes, std::pmr::memory_resource* memory);
  /// Memory of `size` bytes, filled by fill(span).
  template <class Fill>
  static FileMemory filled(size_t size, std::pmr::memory_resource* memory, const Fill& fill) {
    if (size == 0) return borrow({});
    const std::span<std::byte> to(static_cast<std::byte*>(memory->allocate(size, kAlignment)), size);
    FileMemory result(Kind::owned, to, memory);
    fill(to);
    return result;
  }
  /// The caller keeps the bytes in place and unchanged for as long as this lives.
  static FileMemory borrow(std::span<const std::byte> bytes);

  FileMemory(FileMemory&& other) noexcept
      : kind_(std::exchange(other.kind_, Kind::borrowed)),
        bytes_(std::exchange(other.bytes_, {})),
        memory_(other.memory_) {}
  FileMemory& operator=(FileMemory&& other) noexcept {
    std::swap(kind_, other.kind_);
    std::swap(bytes_, other.bytes_);
    std::swap(memory_, other.memory_);
    return *this;
  }
  ~FileMemory();

  std::span<const std::byte> bytes() const { return bytes_; }

 private:
  enum class Kind { owned, mapped, borrowed };
  FileMemory(Kind kind, std::span<const std::byte> bytes, std::pmr::memory_resource* memory)
      : kind_(kind), bytes_(bytes), memory_(memory) {}

  Kind kind_;
  std::span<const std::byte> bytes_;
  std::pmr::memory_resource* memory_;
};

}  // namespace nif::format
