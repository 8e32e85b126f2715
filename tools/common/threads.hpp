// How many threads the process may use.
#pragma once

#include <cstdint>

namespace nif::tools {

/// Limits the threads of everything that follows in the process; 0: all of them.
void limit_threads(uint32_t threads);

}  // namespace nif::tools
