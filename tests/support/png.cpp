#include "tests/support/png.hpp"

#define STB_IMAGE_WRITE_IMPLEMENTATION
#define STB_IMAGE_WRITE_STATIC
#define STBI_WRITE_NO_STDIO
#include <stb/stb_image_write.h>

namespace nif::test {

namespace {

void append(void* out, void* data, int size) {
  static_cast<std::string*>(out)->append(static_cast<const char*>(data), size_t(size));
}

}  // namespace

std::string png(int width, int height, const std::vector<std::array<uint8_t, 3>>& pixels) {
  std::string bytes;
  stbi_write_png_to_func(append, &bytes, width, height, 3, pixels.data(), 3 * width);
  return bytes;
}

std::string jpeg(int width, int height, const std::vector<std::array<uint8_t, 3>>& pixels) {
  std::string bytes;
  stbi_write_jpg_to_func(append, &bytes, width, height, 3, pixels.data(), 80);
  return bytes;
}

std::string jpeg_with_large_factors() {
  const auto segment = [](char marker, const std::string& content) {
    const size_t size = content.size() + 2;
    return std::string{'\xFF', marker, char(size >> 8), char(size & 255)} + content;
  };
  const auto one_code = [](char table, char symbol) {
    return std::string{table, 1} + std::string(15, '\0') + symbol;
  };
  std::string picture = "\xFF\xD8" + segment('\xDB', '\x10' + std::string(128, '\xFF')) +
                        segment('\xC0', std::string("\x08\0\x08\x01\0\x01\x01\x11\0", 9)) +
                        segment('\xC4', one_code('\0', 11)) + segment('\xC4', one_code('\x10', 0)) +
                        segment('\xDA', std::string("\x01\x01\0\0\x3F\0", 6));
  std::string bits;
  for (int block = 0; block < 32; ++block) bits += '0' + std::string(11, '1') + '0';
  for (size_t at = 0; at < bits.size(); at += 8) {
    picture += char(std::stoi(bits.substr(at, 8), nullptr, 2));
    if (picture.back() == '\xFF') picture += '\0';
  }
  return picture + "\xFF\xD9";
}

}  // namespace nif::test
