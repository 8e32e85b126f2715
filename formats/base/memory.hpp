// Finds how much memory is free, so that work that cannot fit is refused before it starts.
#pragma once

#include <cstdint>
#include <string>

namespace nif {

/// Bytes that the process may still allocate before the machine swaps or the kernel kills it, as Linux
/// estimates it, within the limits of its control group and of `ulimit -v`. The largest number if nothing
/// reports a limit.
uint64_t available_memory();

/// Throws Error(too_large) if `bytes`, an estimate, are more than available: "<what> takes about 12.0 GiB of
/// memory, but only 3.1 GiB are free".
void require_memory(uint64_t bytes, const std::string& what);

}  // namespace nif
