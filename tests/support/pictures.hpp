// Makes PNG, JPEG and WebP pictures for tests of textures.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace nif::test {

/// The bytes of a file; pixels row by row from the top, red, green and blue.
std::string png(uint32_t width, uint32_t height, const std::vector<std::array<uint8_t, 3>>& pixels);
/// The same with alpha.
std::string png(uint32_t width, uint32_t height, const std::vector<std::array<uint8_t, 4>>& pixels);
/// As a WebP without loss.
std::string webp(uint32_t width, uint32_t height, const std::vector<std::array<uint8_t, 4>>& pixels);
/// Without alpha, and with loss.
std::string jpeg(uint32_t width, uint32_t height, const std::vector<std::array<uint8_t, 3>>& pixels);
/// In cyan, magenta, yellow and black, as Adobe's programs store them: 255 means no ink.
std::string cmyk_jpeg(uint32_t width, uint32_t height, const std::vector<std::array<uint8_t, 4>>& inks);
/// A grey square as a progressive JPEG with this many scans: 1 to 1,000.
std::string jpeg_of_scans(uint32_t side, int scans);

/// A chunk of a PNG, with its length and its checksum. The name has four letters.
std::string png_chunk(std::string_view name, std::string_view content);
/// A PNG of 8 bits of red, green and blue that claims this size, whatever its zlib data contains.
std::string png_that_claims(uint32_t width, uint32_t height, std::string_view data);

/// A JPEG of 256 x 8 pixels in 32 grey blocks, each brighter than the one before by the largest codable step,
/// with the largest factors: their products take more than 32 bits.
std::string jpeg_with_large_factors();

}  // namespace nif::test
