// A note may quote a name from a file, so control characters are written out before they reach a
// terminal.
#include "tools/common/notes.hpp"

#include <fmt/format.h>

#include "formats/base/printable.hpp"

namespace nif::tools {

void print_notes(const std::vector<std::string>& notes, bool quiet) {
  if (quiet) return;
  for (const std::string& note : notes) fmt::print(stderr, "nif: note: {}\n", printable(note));
}

}  // namespace nif::tools
