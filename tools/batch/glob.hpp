// File name patterns for the meshes of manifests.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace nif::tools {

/// The files that match `pattern`, sorted, as paths below `folder` (or absolute, where the pattern is). *, ?
/// and [...] match within a name (fnmatch), a name that is ** matches any number of folders, none included.
/// Names that begin with a full stop are matched by patterns that do. ** does not follow links to folders,
/// which may lead in a circle. Throws nif::Error(file_unreadable) where a folder cannot be listed.
std::vector<std::filesystem::path> files_matching(const std::filesystem::path& folder,
                                                  const std::string& pattern);

/// Whether it is a pattern, and not the name of one file.
bool is_pattern(const std::string& text);

}  // namespace nif::tools
