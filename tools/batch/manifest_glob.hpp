// Expands file name patterns, so that one entry of a manifest can cover many meshes.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace nif::tools {

/// Returns the files that match `pattern`, sorted, as paths below `folder` (or absolute, if the pattern is).
/// *, ? and [...] match within a name (fnmatch); a ** in place of a name matches any number of folders,
/// including none. Names that begin with a full stop only match patterns that do. ** does not follow links to
/// folders, which may form a cycle. Throws nif::Error(file_unreadable) if a folder cannot be listed.
std::vector<std::filesystem::path> files_matching(const std::filesystem::path& folder,
                                                  const std::string& pattern);

/// Whether the text is a pattern rather than the name of one file.
bool is_pattern(const std::string& text);

}  // namespace nif::tools
