// Notes: sentences on standard error about what was changed or left out; no errors.
#pragma once

#include <string>
#include <vector>

namespace nif::tools {

/// One line each; nothing where `quiet`.
void print_notes(const std::vector<std::string>& notes, bool quiet);

}  // namespace nif::tools
