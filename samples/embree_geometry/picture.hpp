// A picture with 8-bit colours, written as PNG without compression.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

struct Picture {
  Picture(uint32_t w, uint32_t h) : width(w), height(h), colours(size_t(3) * w * h) {}
  uint8_t* at(uint32_t x, uint32_t y) { return &colours[3 * (size_t(y) * width + x)]; }

  uint32_t width, height;
  std::vector<uint8_t> colours;  // red, green, blue of each pixel, rows from the top
};

/// Throws std::runtime_error.
void write_png(const Picture& picture, const std::string& path);
