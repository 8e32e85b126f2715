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

}  // namespace nif::test
