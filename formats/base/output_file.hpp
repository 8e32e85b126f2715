// Writes a file completely or not at all.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>

namespace nif {

/// Can a file be written at this path? Call it before a long bake. Throws nif::Error with
/// Status::output_folder_missing or Status::output_not_writable and one sentence; leaves nothing behind.
void check_output(const std::string& path);

/// Throws nif::Error(usage) where both are the same file.
void refuse_overwriting(const std::string& input, const std::string& output);

/// Is there a device or a pipe at the path, which takes what it is given at once? Throws
/// Error(output_not_writable) where it takes nothing.
bool is_written_in_place(const std::string& path);

/// A result that is written piece by piece, to a temporary file beside the target. A file that was there
/// before stays whole until commit(); an OutputFile that ends without it leaves nothing behind. Devices and
/// pipes are written to directly, and keep what they were given. A new version has the permissions of the old
/// one. Not thread-safe.
///
/// A process that is killed cannot remove its temporary file. It has the target's name with ".tmp-" and eight
/// hexadecimal digits behind it, and the next OutputFile for this target removes it. Those that a living
/// process writes are locked (flock), and stay.
///
/// Every call throws nif::Error with one sentence that names the path: Status::output_folder_missing from the
/// constructor alone, Status::output_not_writable from all.
class OutputFile {
 public:
  explicit OutputFile(const std::string& path);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  /// Appends the bytes. Not after commit().
  void write(std::span<const std::byte> bytes);
  /// Sees to it that all bytes have reached the disk, and moves them to the target. Once.
  void commit();

 private:
  /// Closes the file; removes the temporary where it still has that name.
  void discard();

  std::string path_;           ///< as given, for errors
  std::string target_;         ///< where links lead
  std::string temporary_;      ///< empty: written to the target itself, or committed
  std::optional<int> number_;  ///< of the temporary (formats/base/temporaries.hpp), while there is one
  int fd_ = -1;
};

/// Writes all bytes of a result: an OutputFile in one call.
void write_output(const std::string& path, std::span<const std::byte> bytes);

}  // namespace nif
