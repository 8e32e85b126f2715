// Pictures as PNG and JPEG, for textures.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace nif::test {

/// The bytes of a file; pixels row by row from the top, red, green and blue.
std::string png(int width, int height, const std::vector<std::array<uint8_t, 3>>& pixels);
/// The same with loss.
std::string jpeg(int width, int height, const std::vector<std::array<uint8_t, 3>>& pixels);

/// A JPEG of 256 x 8 pixels, of 32 grey blocks, each brighter than the one before by as much as can be said,
/// with the largest factors: their products take more than 32 bits.
std::string jpeg_with_large_factors();

}  // namespace nif::test
