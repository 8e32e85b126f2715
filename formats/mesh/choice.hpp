// Which parts of a file are read, by the names that the file gives them. An asset records it, so that whoever
// compares the asset with its file reads the same parts.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace nif::mesh {

/// Of each list: every pattern is compared with every name.
inline constexpr size_t kMostPatterns = 10'000;

/// Patterns of names (formats/base/glob.hpp). Names are those of nodes, meshes and materials of glTF, of
/// objects, groups and materials of OBJ, and of solids of STL; a node's name counts for all that is below it.
struct Choice {
  std::vector<std::string> only;    ///< what has such a name is read, and nothing else; empty: all
  std::vector<std::string> except;  ///< what has such a name is not read

  bool empty() const { return only.empty() && except.empty(); }
  bool operator==(const Choice&) const = default;
};

}  // namespace nif::mesh
