// How much memory is free, so that work that cannot fit is refused before it starts.
#pragma once

#include <cstdint>
#include <string>

namespace nif {

/// Bytes that the process may still take without the machine swapping or the kernel killing it, as Linux
/// estimates it, within the limit of its control group and of `ulimit -v`. The largest number where nobody
/// says.
uint64_t available_memory();

/// Throws Error(too_large) where `bytes`, an estimate, are more than there are: "<what> takes about 12.0 GiB
/// of memory, and 3.1 GiB are free".
void require_memory(uint64_t bytes, const std::string& what);

}  // namespace nif
