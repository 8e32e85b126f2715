// Rows are not filtered. They are compressed with the fixed codes of deflate (RFC 1951) and with the best of three
// earlier places that a repetition may start at, which is enough for pictures of flat colours.
#include "mesh/generate/png.hpp"

#include <algorithm>
#include <array>
#include <string_view>

namespace nif::generate {
namespace {

using Bytes = std::vector<std::byte>;

void append_big_endian(Bytes& bytes, uint32_t value) {
  for (int shift = 24; shift >= 0; shift -= 8) bytes.push_back(std::byte(value >> shift & 255));
}

uint32_t crc_of(std::span<const std::byte> bytes) {
  uint32_t crc = 0xffffffff;
  for (const std::byte byte : bytes) {
    crc ^= uint32_t(byte);
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 1) != 0 ? crc >> 1 ^ 0xedb88320 : crc >> 1;
  }
  return ~crc;
}

void append_chunk(Bytes& file, std::string_view type, std::span<const std::byte> content) {
  append_big_endian(file, uint32_t(content.size()));
  const size_t begin = file.size();
  for (const char letter : type) file.push_back(std::byte(letter));
  file.insert(file.end(), content.begin(), content.end());
  append_big_endian(file, crc_of(std::span(file).subspan(begin)));
}

class Bits {
 public:
  explicit Bits(Bytes& out) : out_(out) {}
  /// From the lowest bit.
  void put(uint32_t value, int count) {
    held_ |= uint64_t{value} << filled_;
    for (filled_ += count; filled_ >= 8; filled_ -= 8, held_ >>= 8) out_.push_back(std::byte(held_ & 255));
  }
  /// From the highest bit, as codes are.
  void put_code(uint32_t code, int count) {
    for (int bit = count; bit-- > 0;) put(code >> bit & 1, 1);
  }
  void end() { put(0, (8 - filled_) % 8); }

 private:
  Bytes& out_;
  uint64_t held_ = 0;
  int filled_ = 0;
};

/// A symbol of the fixed code for literals and lengths.
void put_symbol(Bits& bits, uint32_t symbol) {
  if (symbol < 144) return bits.put_code(0x30 + symbol, 8);
  if (symbol < 256) return bits.put_code(0x190 + symbol - 144, 9);
  if (symbol < 280) return bits.put_code(symbol - 256, 7);
  bits.put_code(0xc0 + symbol - 280, 8);
}

constexpr size_t kShortest = 3, kLongest = 258, kFarthest = 32768;

void put_repetition(Bits& bits, size_t length, size_t distance) {
  // Symbols 257 on stand for lengths, the longer ones with extra bits.
  if (length == kLongest) {
    put_symbol(bits, 285);
  } else {
    const auto rest = uint32_t(length - kShortest);
    int extra = 0;
    while (rest >> (extra + 3) != 0) ++extra;
    put_symbol(bits, 257 + 4 * uint32_t(extra) + (rest >> extra));
    bits.put(rest & ((1u << extra) - 1), extra);
  }
  const auto back = uint32_t(distance - 1);
  int extra = 0;
  while (back >> (extra + 2) != 0) ++extra;
  bits.put_code(2 * uint32_t(extra) + (back >> extra), 5);
  bits.put(back & ((1u << extra) - 1), extra);
}

/// A zlib stream.
Bytes compress(std::span<const std::byte> bytes, size_t row) {
  Bytes stream{std::byte{0x78}, std::byte{0x01}};
  Bits bits(stream);
  bits.put(1, 1);                               // the last block
  bits.put(1, 2);                               // with fixed codes
  std::vector<size_t> last(1 << 15, SIZE_MAX);  // by the hash of three bytes: where they were seen last
  const auto hash = [&](size_t at) {
    const uint32_t three = uint32_t(bytes[at]) | uint32_t(bytes[at + 1]) << 8 | uint32_t(bytes[at + 2]) << 16;
    return three * 0x9e3779b1u >> 17;
  };
  for (size_t at = 0; at < bytes.size();) {
    const size_t most = std::min(kLongest, bytes.size() - at);
    size_t length = 0, distance = 0;
    const auto consider = [&](size_t back) {
      if (back == 0 || back > at || back > kFarthest) return;
      size_t same = 0;
      while (same < most && bytes[at + same] == bytes[at + same - back]) ++same;
      if (same > length) length = same, distance = back;
    };
    consider(4);  // the texel to the left
    consider(row);
    if (most >= kShortest && last[hash(at)] != SIZE_MAX) consider(at - last[hash(at)]);
    const size_t step = length >= kShortest ? length : 1;
    if (step == 1)
      put_symbol(bits, uint32_t(bytes[at]));
    else
      put_repetition(bits, length, distance);
    for (const size_t end = at + step; at < end; ++at)
      if (at + kShortest <= bytes.size()) last[hash(at)] = at;
  }
  put_symbol(bits, 256);
  bits.end();
  uint32_t a = 1, b = 0;
  for (const std::byte byte : bytes) {
    a = (a + uint32_t(byte)) % 65521;
    b = (b + a) % 65521;
  }
  append_big_endian(stream, b << 16 | a);
  return stream;
}

}  // namespace

std::vector<std::byte> encode_png(uint32_t width, uint32_t height,
                                  std::span<const std::array<uint8_t, 4>> texels) {
  Bytes header, rows, file;
  append_big_endian(header, width);
  append_big_endian(header, height);
  for (const int byte : {8, 6, 0, 0, 0}) header.push_back(std::byte(byte));  // 8 bits, RGBA, not interlaced
  for (uint32_t y = 0; y < height; ++y) {
    rows.push_back(std::byte{0});  // no filter
    const auto row = std::as_bytes(texels.subspan(size_t{y} * width, width));
    rows.insert(rows.end(), row.begin(), row.end());
  }
  for (const int byte : {0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a}) file.push_back(std::byte(byte));
  append_chunk(file, "IHDR", header);
  append_chunk(file, "IDAT", compress(rows, size_t{4} * width + 1));
  append_chunk(file, "IEND", {});
  return file;
}

}  // namespace nif::generate
