// Separate from the rest of a report, for programs that read metadata but do not bake.
#include <fmt/format.h>

#include "bake/report.hpp"

namespace nif::bake {

std::string source_hash_text(uint64_t hash) { return fmt::format("xxh3-64:{:016x}", hash); }

}  // namespace nif::bake
