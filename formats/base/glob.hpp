// Matches name patterns. This is our own code, because fnmatch() recurses for each * of a pattern, and
// patterns may come from untrusted files.
#pragma once

#include <string_view>

namespace nif {

/// Whether a name matches a pattern. * matches any number of characters, ? matches one, [a-z_] one of a set,
/// [!a-z] one that is not in the set; a backslash makes the next character literal. A [ without its ] is
/// literal. Characters are UTF-8; invalid UTF-8 counts byte by byte. Needs no memory, and time of at most the
/// pattern's length times the name's.
bool fits(std::string_view name, std::string_view pattern);

}  // namespace nif
