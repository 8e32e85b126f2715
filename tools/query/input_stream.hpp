// Bytes of a file or of standard input, read piece by piece: rays may be more than there is memory for.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace nif::tools {

/// A file without a name, which is gone when it is closed; in the folder for temporary files.
class TemporaryFile {
 public:
  TemporaryFile();
  ~TemporaryFile();
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  void write(std::span<const std::byte> bytes);
  /// Reads all of these bytes, which were written before.
  void read_at(uint64_t offset, std::span<std::byte> to) const;
  uint64_t size() const { return size_; }

 private:
  int fd_ = -1;
  uint64_t size_ = 0;
  std::string folder_;  ///< for errors
};

/// Every call throws nif::Error, file_not_found or file_unreadable, with a sentence that names the file.
class InputStream {
 public:
  /// "-": standard input.
  explicit InputStream(const std::string& path);
  ~InputStream();
  InputStream(const InputStream&) = delete;
  InputStream& operator=(const InputStream&) = delete;

  /// What messages call it.
  const std::string& name() const { return name_; }
  /// The next bytes, which stay to be read: fewer than `count` only at the end.
  std::span<const std::byte> peek(size_t count);
  /// Reads what is there, and waits for the first byte. Returns 0 at the end alone.
  size_t read(std::span<std::byte> to);
  /// Reads until `to` is full or the end is reached.
  size_t read_fully(std::span<std::byte> to);
  /// Whether read() would not wait.
  bool ready() const;

  /// Bytes that were read.
  uint64_t position() const { return position_; }
  /// Bytes that are left; nothing where nobody knows: a pipe, a device.
  std::optional<uint64_t> rest() const;
  /// Reads `to` at `offset` behind position(). For a regular file alone.
  size_t read_at(uint64_t offset, std::span<std::byte> to) const;

 private:
  std::string name_;
  int fd_;
  bool regular_;
  uint64_t size_ = 0, start_ = 0, position_ = 0;
  std::vector<std::byte> peeked_;  ///< bytes that are not read yet
};

}  // namespace nif::tools
