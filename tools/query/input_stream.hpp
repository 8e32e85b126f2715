// Reads bytes of a file or of standard input in chunks, because rays may not fit into memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace nif::tools {

/// A file without a name in the folder for temporary files; it disappears when it is closed.
class TemporaryFile {
 public:
  TemporaryFile();
  ~TemporaryFile();
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  void write(std::span<const std::byte> bytes);
  /// Fills `to` with bytes that were written earlier.
  void read_at(uint64_t offset, std::span<std::byte> to) const;
  uint64_t size() const { return size_; }

 private:
  int fd_ = -1;
  uint64_t size_ = 0;
  std::string folder_;  ///< for error messages
};

/// Every call throws nif::Error (file_not_found or file_unreadable) with a sentence that names the file.
class InputStream {
 public:
  /// "-" means standard input.
  explicit InputStream(const std::string& path);
  ~InputStream();
  InputStream(const InputStream&) = delete;
  InputStream& operator=(const InputStream&) = delete;

  /// The name in messages.
  const std::string& name() const { return name_; }
  /// Returns the next bytes without consuming them; fewer than `count` only at the end.
  std::span<const std::byte> peek(size_t count);
  /// Reads what is available, and waits for the first byte. Returns 0 only at the end.
  size_t read(std::span<std::byte> to);
  /// Reads until `to` is full or the end is reached.
  size_t read_fully(std::span<std::byte> to);
  /// Whether read() would not wait.
  bool ready() const;

  /// Number of bytes read.
  uint64_t position() const { return position_; }
  /// Number of bytes left; nothing if it is unknown, as for pipes and devices.
  std::optional<uint64_t> rest() const;
  /// Reads `to` at `offset` behind position(). Only for regular files.
  size_t read_at(uint64_t offset, std::span<std::byte> to) const;

 private:
  std::string name_;
  int fd_;
  bool regular_;
  uint64_t size_ = 0, start_ = 0, position_ = 0;
  std::vector<std::byte> peeked_;  ///< bytes that are not consumed yet
};

}  // namespace nif::tools
