// Lists folders. std::filesystem::directory_iterator of GCC 12 ends the process where memory runs out, because
// its advance() is noexcept.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <system_error>

namespace nif {

/// Calls visit(name) for each entry of a folder, in the file system's order, without "." and ".."; an empty
/// path is the working folder. Entries may be removed meanwhile. Returns why the folder could not be listed to
/// its end, or no error. Throws std::bad_alloc, and what visit throws.
std::error_code for_each_name(const std::filesystem::path& folder,
                              const std::function<void(const std::string&)>& visit);

}  // namespace nif
