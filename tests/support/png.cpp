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

}  // namespace nif::test
