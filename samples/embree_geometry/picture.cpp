// Writes a PNG by hand, with stored blocks instead of compression, and both checksums, so that the sample
// needs no library for its pictures.
#include "picture.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <stdexcept>
#include <string_view>

namespace {

void append_big_endian(std::string& bytes, uint32_t value) {
  for (int shift = 24; shift >= 0; shift -= 8) bytes += char(value >> shift & 255);
}

uint32_t crc_of(std::string_view bytes) {
  uint32_t crc = 0xffffffff;
  for (const char byte : bytes) {
    crc ^= uint8_t(byte);
    for (int bit = 0; bit < 8; ++bit) crc = crc & 1 ? crc >> 1 ^ 0xedb88320 : crc >> 1;
  }
  return ~crc;
}

void append_chunk(std::string& file, std::string_view type, std::string_view content) {
  append_big_endian(file, uint32_t(content.size()));
  const std::string body = std::string(type) + std::string(content);
  file += body;
  append_big_endian(file, crc_of(body));
}

/// A zlib stream of stored blocks.
std::string stored(std::string_view bytes) {
  std::string stream("\x78\x01", 2);
  uint32_t a = 1, b = 0;
  for (const char byte : bytes) {
    a = (a + uint8_t(byte)) % 65521;
    b = (b + a) % 65521;
  }
  while (!bytes.empty()) {
    const std::string_view block = bytes.substr(0, 65535);
    bytes.remove_prefix(block.size());
    const auto size = uint16_t(block.size()), inverse = uint16_t(~size);
    stream += char(bytes.empty());  // the last one?
    for (const uint16_t number : {size, inverse}) {
      stream += char(number & 255);
      stream += char(number >> 8);
    }
    stream += block;
  }
  append_big_endian(stream, b << 16 | a);
  return stream;
}

}  // namespace

void write_png(const Picture& picture, const std::string& path) {
  std::string header, rows;
  append_big_endian(header, picture.width);
  append_big_endian(header, picture.height);
  header += std::string_view("\x08\x02\0\0\0", 5);  // 8 bits, colours, no interlacing
  for (uint32_t y = 0; y < picture.height; ++y) {
    rows += '\0';  // no filter
    rows.append(reinterpret_cast<const char*>(picture.colours.data()) + size_t(3) * y * picture.width,
                size_t(3) * picture.width);
  }
  std::string png = "\x89PNG\r\n\x1a\n";
  append_chunk(png, "IHDR", header);
  append_chunk(png, "IDAT", stored(rows));
  append_chunk(png, "IEND", {});

  std::ofstream file(path, std::ios::binary);
  if (!file) throw std::runtime_error(path + ": " + std::strerror(errno));
  file << png;
  file.close();
  if (!file) {
    std::remove(path.c_str());
    throw std::runtime_error(path + ": cannot be written");
  }
}
