// Chooses which parts of a file are read, by the names in the file. An asset records the choice, so that a
// comparison with the file reads the same parts.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace nif::mesh {

/// For each list, because every pattern is compared with every name.
inline constexpr size_t kMostPatterns = 10'000;

/// Name patterns (formats/base/glob.hpp). Names are those of nodes, meshes and materials of glTF, of objects,
/// groups and materials of OBJ, and of solids of STL; a node's name applies to everything below it.
struct Choice {
  std::vector<std::string> only;    ///< read only what has such a name; empty: everything
  std::vector<std::string> except;  ///< skip what has such a name

  bool empty() const { return only.empty() && except.empty(); }
  bool operator==(const Choice&) const = default;
};

}  // namespace nif::mesh
