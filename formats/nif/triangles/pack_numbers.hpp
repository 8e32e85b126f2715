// Packs numbers into as few bits as the largest one may need: the layout of kernels::SourceTriangles.
#pragma once

#include <cstdint>
#include <vector>

namespace nif::format {

/// All must fit into `bits` bits, 1 to 32.
std::vector<uint32_t> packed(const std::vector<uint32_t>& numbers, uint32_t bits);

}  // namespace nif::format
