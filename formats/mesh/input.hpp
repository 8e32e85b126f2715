// The input of every format reader: the bytes of one file, its name for messages, and a way to refuse it.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "formats/mesh/read.hpp"

namespace nif::mesh::detail {

/// The number of things that notes list individually for each kind, because a damaged file may have millions.
/// The rest are counted.
inline constexpr size_t kMostNotes = 20;

struct Input {
  std::filesystem::path file;  ///< as the caller wrote it
  std::string stem;            ///< the file's name without folder, .gz/.zst and extension
  std::string extension;       ///< in lower case with its dot, without .gz/.zst; may be empty
  std::string_view bytes;      ///< the whole file, decompressed
  ReadLimits limits;
  bool exact = false;  ///< readers also fill Mesh::exact (far_from_origin.hpp)

  /// Throws an Error whose sentence is "<file>: <reason>"
  [[noreturn]] void fail(Status status, const std::string& reason) const {
    throw Error(status, file.string() + ": " + reason);
  }
};

/// A file that another one refers to.
struct ExternalFile {
  std::filesystem::path path;
  std::string bytes;
};

}  // namespace nif::mesh::detail
