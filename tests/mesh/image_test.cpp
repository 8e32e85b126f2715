// Pictures of every kind, as textures see them: 8 bits of red, green and blue.
#include "formats/mesh/image.hpp"

#include <gtest/gtest.h>
#include <zlib.h>

#include <cstdlib>

#include "tests/support/pictures.hpp"

namespace nif::test {
namespace {

using Texels = std::vector<uint8_t>;

Texels texels_of(std::string_view picture, uint32_t width, uint32_t height) {
  uint64_t left = mesh::detail::kMostTexels;
  std::string why;
  const std::optional<mesh::Texture> texture = mesh::detail::decode_image(picture, left, why);
  EXPECT_TRUE(texture) << why;
  if (!texture) return {};
  EXPECT_EQ(texture->width, width);
  EXPECT_EQ(texture->height, height);
  EXPECT_EQ(left, mesh::detail::kMostTexels - uint64_t{width} * height);
  return texture->texels;
}

struct Png {
  uint32_t width = 1, height = 1;
  char depth = 8, kind = 2, interlaced = 0;
  std::string chunks = {};  ///< before its data
  std::string rows = {};    ///< each with its filter before it

  std::string bytes() const {
    const std::string header{0, 0, 0, char(width), 0, 0, 0, char(height), depth, kind, 0, 0, interlaced};
    std::string data(rows.size() + 100, '\0');
    uLongf length = data.size();
    compress(reinterpret_cast<Bytef*>(data.data()), &length, reinterpret_cast<const Bytef*>(rows.data()),
             rows.size());
    data.resize(length);
    return "\x89PNG\r\n\x1a\n" + png_chunk("IHDR", header) + chunks + png_chunk("IDAT", data) +
           png_chunk("IEND", "");
  }
};

constexpr char kGrey = 0, kColor = 2, kPalette = 3, kGreyAndAlpha = 4, kColorAndAlpha = 6;

std::string of(std::initializer_list<int> values) {
  std::string bytes;
  for (const int value : values) bytes += char(value);
  return bytes;
}

TEST(Image, PngOfEveryKind) {
  const auto expect = [](const Png& png, const Texels& texels, const char* what) {
    EXPECT_EQ(texels_of(png.bytes(), png.width, png.height), texels) << what;
  };
  expect({.kind = kColor, .rows = of({0, 1, 2, 3})}, {1, 2, 3}, "red, green and blue");
  expect({.kind = kGrey, .rows = of({0, 7})}, {7, 7, 7}, "grey");
  expect({.width = 4, .depth = 2, .kind = kGrey, .rows = of({0, 0b00011011})},
         {0, 0, 0, 85, 85, 85, 170, 170, 170, 255, 255, 255}, "grey of 2 bits");
  expect({.width = 2,
          .depth = 4,
          .kind = kPalette,
          .chunks = png_chunk("PLTE", of({1, 2, 3, 4, 5, 6})),
          .rows = of({0, 0x10})},
         {4, 5, 6, 1, 2, 3}, "a palette");
  expect({.depth = 16, .kind = kColor, .rows = of({0, 0x80, 0x7F, 0xFF, 0x40, 0, 0xFF})}, {128, 254, 1},
         "16 bits, rounded");
  // The colour of a surface does not depend on its opacity.
  expect({.kind = kColorAndAlpha, .rows = of({0, 1, 2, 3, 0})}, {1, 2, 3}, "alpha is left out");
  expect({.kind = kGreyAndAlpha, .rows = of({0, 9, 0})}, {9, 9, 9}, "grey, and alpha is left out");
  expect({.kind = kColor, .chunks = png_chunk("tRNS", of({0, 1, 0, 2, 0, 3})), .rows = of({0, 1, 2, 3})},
         {1, 2, 3}, "a colour that is transparent");
  expect({.kind = kPalette,
          .chunks = png_chunk("PLTE", of({1, 2, 3})) + png_chunk("tRNS", of({0})),
          .rows = of({0, 0})},
         {1, 2, 3}, "a palette's colour that is transparent");
  // glTF requires that colour spaces in pictures are ignored. This one claims linear values.
  expect({.kind = kColor, .chunks = png_chunk("gAMA", of({0, 1, 0x86, 0xA0})), .rows = of({0, 10, 20, 30})},
         {10, 20, 30}, "gamma");
  // A picture of 2 x 2: the pixel at 0 0, the one right of it, and the lower row.
  expect({.width = 2, .height = 2, .kind = kGrey, .interlaced = 1, .rows = of({0, 1, 0, 2, 0, 3, 4})},
         {1, 1, 1, 2, 2, 2, 3, 3, 3, 4, 4, 4}, "interlaced");
}

std::vector<uint16_t> alphas_of(std::string_view picture) {
  uint64_t left = mesh::detail::kMostTexels;
  std::string why;
  const std::optional<mesh::detail::AlphaTexels> texels = mesh::detail::decode_alpha(picture, left, why);
  EXPECT_TRUE(texels) << why;
  return texels ? texels->alpha : std::vector<uint16_t>{1, 2, 3};
}

TEST(Image, AlphaOfEveryKind) {
  const auto expect = [](const Png& png, const std::vector<uint16_t>& alphas, const char* what) {
    EXPECT_EQ(alphas_of(png.bytes()), alphas) << what;
  };
  expect({.kind = kColor, .rows = of({0, 1, 2, 3})}, {}, "none");
  expect({.width = 2, .kind = kColorAndAlpha, .rows = of({0, 1, 2, 3, 0, 4, 5, 6, 128})}, {0, 128 * 257},
         "beside colours");
  expect({.width = 2, .kind = kGreyAndAlpha, .rows = of({0, 9, 255, 9, 1})}, {65535, 257}, "beside grey");
  expect({.depth = 16, .kind = kGreyAndAlpha, .rows = of({0, 1, 2, 0x12, 0x34})}, {0x1234}, "16 bits");
  expect({.depth = 16, .kind = kColorAndAlpha, .rows = of({0, 1, 2, 3, 4, 5, 6, 0xFE, 0xDC})}, {0xFEDC},
         "16 bits beside colours");
  expect({.width = 2,
          .depth = 4,
          .kind = kPalette,
          .chunks = png_chunk("PLTE", of({1, 2, 3, 4, 5, 6})) + png_chunk("tRNS", of({7})),
          .rows = of({0, 0x10})},
         {65535, 7 * 257}, "of a palette");
  expect({.width = 2,
          .kind = kColor,
          .chunks = png_chunk("tRNS", of({0, 1, 0, 2, 0, 3})),
          .rows = of({0, 1, 2, 3, 1, 2, 4})},
         {0, 65535}, "a colour that is transparent");
  expect({.width = 4,
          .depth = 2,
          .kind = kGrey,
          .chunks = png_chunk("tRNS", of({0, 2})),
          .rows = of({0, 0b00011011})},
         {65535, 65535, 0, 65535}, "a grey of 2 bits that is transparent");
  expect({.depth = 16, .kind = kGrey, .chunks = png_chunk("tRNS", of({1, 2})), .rows = of({0, 1, 2})}, {0},
         "a grey of 16 bits that is transparent");
  expect({.width = 2,
          .height = 2,
          .kind = kGreyAndAlpha,
          .interlaced = 1,
          .rows = of({0, 9, 1, 0, 9, 2, 0, 9, 3, 9, 4})},
         {257, 2 * 257, 3 * 257, 4 * 257}, "interlaced");
  EXPECT_EQ(alphas_of(jpeg(8, 8, {64, {200, 40, 90}})), std::vector<uint16_t>());
  EXPECT_EQ(alphas_of(webp(2, 1, {{1, 2, 3, 255}, {4, 5, 6, 10}})), (std::vector<uint16_t>{65535, 2570}));
  EXPECT_EQ(alphas_of(webp(2, 1, {{1, 2, 3, 255}, {4, 5, 6, 255}})), std::vector<uint16_t>());
}

TEST(Image, Webp) {
  EXPECT_EQ(texels_of(webp(2, 1, {{1, 2, 3, 255}, {4, 5, 6, 255}}), 2, 1), (Texels{1, 2, 3, 4, 5, 6}));
  const std::string whole = webp(64, 64, std::vector<std::array<uint8_t, 4>>(4096, {1, 2, 3, 4}));
  for (size_t length = 12; length < whole.size(); length += 7) {
    uint64_t left = mesh::detail::kMostTexels;
    std::string why;
    EXPECT_FALSE(mesh::detail::decode_image(whole.substr(0, length), left, why)) << length;
    EXPECT_FALSE(mesh::detail::decode_alpha(whole.substr(0, length), left, why)) << length;
    EXPECT_NE(why.find("cannot be decoded"), std::string::npos) << why;
  }
}

void expect_near(const Texels& texels, const std::array<int, 3>& wanted) {
  ASSERT_FALSE(texels.empty());
  for (size_t i = 0; i < texels.size(); ++i) ASSERT_LE(std::abs(texels[i] - wanted[i % 3]), 3) << i;
}

TEST(Image, JpegOfEveryKind) {
  expect_near(texels_of(jpeg(20, 9, {180, {200, 40, 90}}), 20, 9), {200, 40, 90});
  expect_near(texels_of(jpeg_of_scans(16, 10), 16, 16), {128, 128, 128});
  // Half of the red remains, all of the green and a fifth of the blue; then half of everything.
  expect_near(texels_of(cmyk_jpeg(8, 8, {64, {128, 255, 51, 128}}), 8, 8), {64, 128, 26});
}

}  // namespace
}  // namespace nif::test
