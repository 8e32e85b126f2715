// Writes a file completely or not at all.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>

namespace nif {

/// Checks that a file can be written at this path; to be called before a long bake. Throws nif::Error with
/// Status::output_folder_missing or Status::output_not_writable and one sentence; leaves nothing behind.
void check_output(const std::string& path);

/// Throws nif::Error(usage) if both are the same file.
void refuse_overwriting(const std::string& input, const std::string& output);

/// Whether the path is a device or a pipe, to which bytes go at once. Throws Error(output_not_writable) if it
/// cannot be written to.
bool is_written_in_place(const std::string& path);

/// Writes a result in pieces to a temporary file beside the target. An existing file stays intact until
/// commit(); an OutputFile that is destroyed without it leaves nothing behind. Devices and pipes are written
/// directly, and keep what they got. A new version has the permissions of the old one. Not thread-safe.
///
/// A killed process cannot remove its temporary file. It has the target's name followed by ".tmp-" and eight
/// hexadecimal digits, and the next OutputFile for this target removes it. Temporaries of living processes
/// are locked (flock), and stay.
///
/// Every call throws nif::Error with one sentence that names the path: Status::output_folder_missing only
/// from the constructor, Status::output_not_writable from all.
class OutputFile {
 public:
  explicit OutputFile(const std::string& path);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  /// Appends the bytes. Must not be called after commit().
  void write(std::span<const std::byte> bytes);
  /// Ensures that all bytes have reached the disk, and moves the file to the target. May be called once.
  void commit();

 private:
  /// Closes the file, and removes it if it is still temporary.
  void discard();

  std::string path_;           ///< as given, for messages
  std::string target_;         ///< after following links
  std::string temporary_;      ///< empty: the target itself is written, or commit() is done
  std::optional<int> number_;  ///< of the temporary (formats/base/temporaries.hpp), if there is one
  int fd_ = -1;
};

/// Writes a whole result with an OutputFile in one call.
void write_output(const std::string& path, std::span<const std::byte> bytes);

}  // namespace nif
