// Pictures in memory, and how they are read and written.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace nif::render {

/// RGB, row by row from the top; linear light unless said otherwise.
struct Image {
  uint32_t width = 0, height = 0;
  std::vector<float> values;  ///< [height][width][3]

  Image() = default;
  Image(uint32_t w, uint32_t h) : width(w), height(h), values(size_t(w) * h * 3) {}
  float* at(uint32_t x, uint32_t y) { return &values[3 * (size_t(y) * width + x)]; }
  const float* at(uint32_t x, uint32_t y) const { return &values[3 * (size_t(y) * width + x)]; }
};

/// IEC 61966-2-1, clamped to 0..1.
float srgb_encode(float linear);
float srgb_decode(float encoded);
Image srgb_encoded(const Image& linear);

/// A PNG file with 8 bits per channel; the values are already encoded.
std::vector<std::byte> encode_png(const Image& encoded);
/// The same as a file, replaced whole or not at all; throws as write_output() does.
void write_png(const std::string& path, const Image& encoded);
/// Single precision; the values are linear.
void write_exr(const std::string& path, const Image& linear);

/// Reads an environment map, .exr or .hdr (Radiance), of at most 16,384 x 16,384 pixels. Throws
/// Error(not_an_image) if it is not one, or has values that are negative or not finite.
Image read_environment(const std::string& path);

}  // namespace nif::render
