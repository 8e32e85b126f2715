// Encodes pictures as PNG by our own code: libraries that compress give other bytes in other versions.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace nif::generate {

/// A complete PNG of 8 bits for each of red, green, blue and alpha; `texels` are rows from the top,
/// [width * height].
std::vector<std::byte> encode_png(uint32_t width, uint32_t height,
                                  std::span<const std::array<uint8_t, 4>> texels);

}  // namespace nif::generate
