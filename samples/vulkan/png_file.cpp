#include "png_file.hpp"

#include <png.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <vector>

void write_png(const std::string& path, uint32_t width, uint32_t height, std::span<const uint8_t> rgb) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = width, image.height = height;
  image.format = PNG_FORMAT_RGB;
  png_alloc_size_t size = 0;
  if (!png_image_write_to_memory(&image, nullptr, &size, 0, rgb.data(), 0, nullptr))
    throw std::runtime_error(path + ": " + image.message);
  std::vector<char> bytes(size);
  if (!png_image_write_to_memory(&image, bytes.data(), &size, 0, rgb.data(), 0, nullptr))
    throw std::runtime_error(path + ": " + image.message);
  std::FILE* const file = std::fopen(path.c_str(), "wb");
  if (!file) throw std::runtime_error(path + ": " + std::strerror(errno));
  errno = 0;
  const bool written = std::fwrite(bytes.data(), 1, size, file) == size;
  const bool closed = std::fclose(file) == 0;
  if (written && closed) return;
  const int error = errno;
  std::error_code ignored;
  if (std::filesystem::is_regular_file(path, ignored)) std::filesystem::remove(path, ignored);
  throw std::runtime_error(path + ": " + std::strerror(error));
}
