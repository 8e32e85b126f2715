// Reads a whole file into memory, into a buffer that grows without copying.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <string_view>
#include <utility>

#include "formats/base/status.hpp"

namespace nif::mesh::detail {

/// Grows by realloc, which remaps large blocks instead of copying them, and never initialises memory that is
/// overwritten anyway. A std::vector would do both, and double the peak memory for a large file.
class ByteBuffer {
 public:
  ByteBuffer() = default;
  ByteBuffer(ByteBuffer&& other) noexcept { swap(other); }
  ByteBuffer& operator=(ByteBuffer&& other) noexcept {
    swap(other);
    return *this;
  }
  ByteBuffer(const ByteBuffer&) = delete;
  ByteBuffer& operator=(const ByteBuffer&) = delete;
  ~ByteBuffer() { std::free(data_); }

  char* data() { return data_; }
  size_t size() const { return size_; }
  size_t capacity() const { return capacity_; }
  std::string_view view() const { return {data_, size_}; }

  void reserve(size_t capacity);                ///< throws std::bad_alloc
  void set_size(size_t size) { size_ = size; }  ///< at most capacity()
  void shrink();                                ///< gives unused capacity back

 private:
  void swap(ByteBuffer& other) noexcept {
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
    std::swap(capacity_, other.capacity_);
  }

  char* data_ = nullptr;
  size_t size_ = 0;
  size_t capacity_ = 0;
};

/// Reads a regular file or a pipe. Throws file_not_found, file_unreadable (also if the file changes
/// meanwhile), or too_large beyond `max_bytes`.
ByteBuffer load_file(const std::filesystem::path& file, uint64_t max_bytes);

/// Its name in messages.
inline constexpr const char* kStandardInputName = "standard input";

/// Reads standard input to its end. Throws file_unreadable (also if it is a terminal), or too_large.
ByteBuffer load_standard_input(uint64_t max_bytes);

/// Like load_file(), for a file that another, possibly untrusted file refers to. Reads only regular files,
/// because a pipe can wait for ever, and no more than the file's length, because files that the kernel
/// generates do not state theirs.
ByteBuffer load_named_file(const std::filesystem::path& file, uint64_t max_bytes);

}  // namespace nif::mesh::detail
