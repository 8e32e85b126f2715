// A file opened for reading, with POSIX calls (input_file_posix.cpp) or those of Windows
// (input_file_windows.cpp). Both report why a file cannot be opened, which streams do not.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace nif::format {

/// Every call throws nif::Error with one sentence that names the path: Status::file_not_found only from the
/// constructor, Status::file_unreadable from any.
class InputFile {
 public:
  /// The path is UTF-8. Folders, devices and pipes are refused, without waiting for a writer.
  explicit InputFile(const std::string& path);
  ~InputFile();
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;

  /// In bytes, at the time it was opened.
  uint64_t size() const { return size_; }
  /// Reads up to `count` bytes at `offset`; returns how many, which is fewer only at the end of the file.
  size_t read_at(std::byte* to, size_t count, uint64_t offset) const;
  /// Maps the whole file, which must not be empty, for reading. The bytes outlive this; unmap() releases
  /// them.
  std::span<const std::byte> map() const;
  static void unmap(std::span<const std::byte> bytes);

 private:
  std::string path_;  ///< for errors
  intptr_t handle_;   ///< the system's
  uint64_t size_ = 0;
};

}  // namespace nif::format
