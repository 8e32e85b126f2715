// Makes valid pictures by libpng, libjpeg and libwebp, and assembles byte by byte what no encoder would write: wrong
// sizes or huge factors.
#include "tests/support/pictures.hpp"

#include <cstdio>
#include <cstdlib>
#include <span>

// After <cstdio>, which it needs.
#include <jpeglib.h>
#include <png.h>
#include <webp/encode.h>
#include <zlib.h>

namespace nif::test {

namespace {

/// An error ends the program, because no input here is untrusted.
std::string encode_jpeg(uint32_t width, uint32_t height, int channels, const uint8_t* pixels,
                        std::span<const jpeg_scan_info> scans = {}) {
  jpeg_error_mgr errors;
  jpeg_compress_struct jpeg{};
  jpeg.err = jpeg_std_error(&errors);
  jpeg_create_compress(&jpeg);
  unsigned char* memory = nullptr;
  unsigned long size = 0;
  jpeg_mem_dest(&jpeg, &memory, &size);
  jpeg.image_width = width;
  jpeg.image_height = height;
  jpeg.input_components = channels;
  jpeg.in_color_space = channels == 4 ? JCS_CMYK : JCS_RGB;
  jpeg_set_defaults(&jpeg);
  jpeg_set_quality(&jpeg, 80, TRUE);
  if (!scans.empty()) jpeg.scan_info = scans.data(), jpeg.num_scans = int(scans.size());
  jpeg_start_compress(&jpeg, TRUE);
  for (size_t row = 0; row < height; ++row) {
    auto* from = const_cast<uint8_t*>(pixels + row * width * size_t(channels));
    jpeg_write_scanlines(&jpeg, &from, 1);
  }
  jpeg_finish_compress(&jpeg);
  jpeg_destroy_compress(&jpeg);
  std::string bytes(reinterpret_cast<const char*>(memory), size);
  std::free(memory);
  return bytes;
}

std::string encode_png(uint32_t width, uint32_t height, png_uint_32 format, const void* pixels) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = width;
  image.height = height;
  image.format = format;
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(image);
  std::string bytes(size, '\0');
  if (!png_image_write_to_memory(&image, bytes.data(), &size, 0, pixels, 0, nullptr)) std::abort();
  bytes.resize(size);
  return bytes;
}

std::string big_endian(uint32_t value) {
  return {char(value >> 24), char(value >> 16 & 255), char(value >> 8 & 255), char(value & 255)};
}

}  // namespace

std::string png(uint32_t width, uint32_t height, const std::vector<std::array<uint8_t, 3>>& pixels) {
  return encode_png(width, height, PNG_FORMAT_RGB, pixels.data());
}

std::string png(uint32_t width, uint32_t height, const std::vector<std::array<uint8_t, 4>>& pixels) {
  return encode_png(width, height, PNG_FORMAT_RGBA, pixels.data());
}

std::string webp(uint32_t width, uint32_t height, const std::vector<std::array<uint8_t, 4>>& pixels) {
  uint8_t* memory = nullptr;
  const size_t size =
      WebPEncodeLosslessRGBA(pixels.data()->data(), int(width), int(height), int(4 * width), &memory);
  if (size == 0) std::abort();
  std::string bytes(reinterpret_cast<const char*>(memory), size);
  WebPFree(memory);
  return bytes;
}

std::string jpeg(uint32_t width, uint32_t height, const std::vector<std::array<uint8_t, 3>>& pixels) {
  return encode_jpeg(width, height, 3, pixels.data()->data());
}

std::string cmyk_jpeg(uint32_t width, uint32_t height, const std::vector<std::array<uint8_t, 4>>& inks) {
  return encode_jpeg(width, height, 4, inks.data()->data());
}

std::string jpeg_of_scans(uint32_t side, int scans) {
  // The means of all blocks, then each coefficient separately, and each of its lowest bits separately.
  std::vector<jpeg_scan_info> script{{3, {0, 1, 2}, 0, 0, 0, 0}};
  constexpr int kBits = 9;
  for (int component = 0; component < 3; ++component)
    for (int coefficient = 1; coefficient < 64; ++coefficient)
      for (int bit = kBits; bit >= 0; --bit)
        script.push_back({1, {component}, coefficient, coefficient, bit == kBits ? 0 : bit + 1, bit});
  const std::vector<std::array<uint8_t, 3>> grey(size_t{side} * side, {128, 128, 128});
  return encode_jpeg(side, side, 3, grey.data()->data(), std::span(script).first(size_t(scans)));
}

std::string png_chunk(std::string_view name, std::string_view content) {
  const std::string checked = std::string(name) + std::string(content);
  const uLong checksum = crc32(0, reinterpret_cast<const Bytef*>(checked.data()), uInt(checked.size()));
  return big_endian(uint32_t(content.size())) + checked + big_endian(uint32_t(checksum));
}

std::string png_that_claims(uint32_t width, uint32_t height, std::string_view data) {
  const std::string header = big_endian(width) + big_endian(height) + std::string("\x08\x02\0\0\0", 5);
  return "\x89PNG\r\n\x1a\n" + png_chunk("IHDR", header) + png_chunk("IDAT", data) + png_chunk("IEND", "");
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
