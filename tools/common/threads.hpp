// Limits the number of threads of the process.
#pragma once

#include <cstdint>

namespace nif::tools {

/// Applies to everything that follows in the process; 0: all cores.
void limit_threads(uint32_t threads);

}  // namespace nif::tools
