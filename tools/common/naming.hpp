// Makes errors name the file that they are about.
#pragma once

#include <string>

#include "formats/base/status.hpp"

namespace nif::tools {

/// The name of an input file in messages.
inline std::string shown_name(const std::string& file) { return file == "-" ? "standard input" : file; }

/// Runs `work`. If it throws a nif::Error that does not name its file, puts the file's name in front. Errors
/// about outputs already name theirs.
template <class Work>
auto naming(const std::string& path, Work&& work) {
  const std::string file = shown_name(path);
  try {
    return work();
  } catch (const Error& error) {
    const std::string sentence = error.what();
    const bool output =
        error.status() == Status::output_not_writable || error.status() == Status::output_folder_missing;
    if (output || sentence.find(file) != std::string::npos) throw;
    throw Error(error.status(), file + ": " + sentence);
  }
}

}  // namespace nif::tools
