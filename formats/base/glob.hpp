// Name patterns: our own, because fnmatch() goes a stack frame deeper for each * of a pattern, and patterns
// may come from files of others.
#pragma once

#include <string_view>

namespace nif {

/// Whether a name is, or fits, a pattern. * stands for any number of characters, ? for one, [a-z_] for one of
/// a set, [!a-z] for one that is not in it; a backslash takes the character that follows as it is. A [
/// without its ] stands for itself. Characters are those of UTF-8; what is none counts byte by byte. Takes no
/// memory; the time is at most that of the pattern's length times the name's.
bool fits(std::string_view name, std::string_view pattern);

}  // namespace nif
