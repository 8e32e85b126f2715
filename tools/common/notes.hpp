// Prints notes: sentences on standard error about what was changed or left out. They are not errors.
#pragma once

#include <string>
#include <vector>

namespace nif::tools {

/// One line for each note; nothing if `quiet`.
void print_notes(const std::vector<std::string>& notes, bool quiet);

}  // namespace nif::tools
