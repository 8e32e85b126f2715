// Writing a result so that it is either there as a whole or not at all.
#pragma once

#include <cstddef>
#include <span>
#include <string>

namespace nif {

/// Can a file be written at this path? Call it before a long bake. Throws nif::Error with
/// Status::output_folder_missing or Status::output_not_writable and one sentence; leaves nothing behind.
void check_output(const std::string& path);

/// Writes the bytes to a temporary file beside the target, sees to it that they have reached the disk, and
/// renames it. A file that was there before stays whole until then; where anything fails, the temporary is
/// removed and nif::Error thrown. Devices and pipes are written to directly.
void write_output(const std::string& path, std::span<const std::byte> bytes);

}  // namespace nif
