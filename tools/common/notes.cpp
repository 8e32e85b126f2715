#include "tools/common/notes.hpp"

#include <fmt/format.h>

namespace nif::tools {

void print_notes(const std::vector<std::string>& notes, bool quiet) {
  if (quiet) return;
  for (const std::string& note : notes) fmt::print(stderr, "nif: note: {}\n", note);
}

}  // namespace nif::tools
