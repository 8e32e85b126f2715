// Pictures: what is written is what is read, what is no picture is refused, and measures of difference.
#include "tools/render/image_file.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "formats/base/status.hpp"
#include "tests/support/temp_dir.hpp"
#include "tools/render/compare_pictures.hpp"

namespace nif::render {
namespace {

Image gradient(uint32_t width, uint32_t height) {
  Image image(width, height);
  for (size_t i = 0; i < image.values.size(); ++i) image.values[i] = float(i % 97) / 96;
  return image;
}

Status status_of(const std::string& path) {
  try {
    read_environment(path);
    return Status::ok;
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find(path), std::string::npos) << error.what();
    return error.status();
  }
}

TEST(Images, OpenExrRoundTrip) {
  const test::TempDir folder;
  const std::string path = (folder.path() / "a.exr").string();
  Image image = gradient(37, 11);
  image.values[5] = 1e6f;
  write_exr(path, image);
  const Image read = read_environment(path);
  EXPECT_EQ(read.width, 37u);
  EXPECT_EQ(read.height, 11u);
  EXPECT_EQ(read.values, image.values);
}

TEST(Images, Radiance) {
  const test::TempDir folder;
  // Two pixels, not run-length encoded: mantissas 128, 64, 0 at exponent 129 are 1, 1/2, 0; exponent 0 is
  // black.
  const std::string text = std::string("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n") + "\x80\x40" +
                           std::string(1, '\0') + "\x81" + std::string(4, '\0');
  const Image image = read_environment(folder.write("a.hdr", text).string());
  EXPECT_EQ(image.width, 2u);
  EXPECT_EQ(image.values, (std::vector<float>{1, 0.5f, 0, 0, 0, 0}));
}

TEST(Images, FilesThatAreNoPictures) {
  const test::TempDir folder;
  EXPECT_EQ(status_of((folder.path() / "none.exr").string()), Status::file_not_found);
  EXPECT_EQ(status_of(folder.write("empty.exr", "").string()), Status::not_an_image);
  EXPECT_EQ(status_of(folder.write("text.exr", "hello").string()), Status::not_an_image);
  EXPECT_EQ(status_of(folder.write("text.hdr", "#?RADIANCE\nhello").string()), Status::not_an_image);
  EXPECT_EQ(
      status_of(
          folder.write("huge.hdr", "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 99999 +X 99999\n").string()),
      Status::not_an_image);
  Image bad = gradient(4, 4);
  bad.values[7] = -1;
  write_exr((folder.path() / "negative.exr").string(), bad);
  EXPECT_EQ(status_of((folder.path() / "negative.exr").string()), Status::not_an_image);
}

/// Found by fuzzing: stb never ends at a run of length 0, which is also what it reads past the end.
TEST(Images, RunsOfNoPixels) {
  const test::TempDir folder;
  const std::string head = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 8\n";
  std::string row("\2\2\0\x08", 4);
  for (const char value : {'\x0a', '\x14', '\x1e', '\x81'}) row += std::string("\x88") + value;
  const std::string whole = head + row + row;
  EXPECT_EQ(status_of(folder.write("whole.hdr", whole).string()), Status::ok);
  for (size_t size = head.size(); size < whole.size(); ++size)
    EXPECT_EQ(status_of(folder.write("cut.hdr", whole.substr(0, size)).string()), Status::not_an_image)
        << size;
  std::string none = whole;
  none[head.size() + 4] = 0;
  EXPECT_EQ(status_of(folder.write("none.hdr", none).string()), Status::not_an_image);
  EXPECT_EQ(status_of(folder.write("mixed.hdr", head + row + std::string(40, 'x')).string()),
            Status::not_an_image);
}

/// Both found by fuzzing: a few bytes that claim a large size must not take memory.
TEST(Images, ClaimsBeyondTheLengthOfTheFile) {
  const test::TempDir folder;
  const auto sentence_of = [&](const std::string& name, const std::string& bytes) {
    try {
      read_environment(folder.write(name, bytes).string());
      return std::string();
    } catch (const Error& error) {
      EXPECT_EQ(error.status(), Status::not_an_image);
      return std::string(error.what());
    }
  };
  const std::string radiance = sentence_of(
      "a.hdr", "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 16384 +X 16384\n" + std::string(200, '\2'));
  EXPECT_NE(radiance.find("too short for the 16384 x 16384 pixels"), std::string::npos) << radiance;

  const std::string path = (folder.path() / "b.exr").string();
  write_exr(path, gradient(3, 2));
  const std::string bytes = test::read_bytes(path);
  const auto changed = [&](const std::string& after, size_t skip, const std::string& value) {
    std::string other = bytes;
    const size_t at = other.find(after);
    EXPECT_NE(at, std::string::npos);
    return other.replace(at + after.size() + skip, value.size(), value);
  };
  // An attribute of an unknown type, whose length is trusted.
  const std::string much("\xff\xff\xff\x6f", 4), side("\xff\x3f\0\0", 4);
  const std::string of_attribute = sentence_of(
      "c.exr", changed(std::string("screenWindowWidth\0", 18), 0, std::string("flood\0", 6) + much));
  EXPECT_NE(of_attribute.find("cannot be read"), std::string::npos) << of_attribute;
  // xMax and yMax, after length, xMin and yMin
  const std::string of_pixels =
      sentence_of("d.exr", changed(std::string("dataWindow\0box2i\0", 17), 12, side + side));
  EXPECT_NE(of_pixels.find("d.exr"), std::string::npos) << of_pixels;
}

TEST(Images, EveryTruncationIsRefused) {
  const test::TempDir folder;
  const std::string path = (folder.path() / "a.exr").string();
  write_exr(path, gradient(19, 23));
  const std::string bytes = test::read_bytes(path);
  for (size_t size = 0; size < bytes.size(); size += 1 + size / 50)
    EXPECT_EQ(status_of(folder.write("cut.exr", bytes.substr(0, size)).string()), Status::not_an_image)
        << size;
}

TEST(Images, PngIsOne) {
  const test::TempDir folder;
  const std::string path = (folder.path() / "a.png").string();
  write_png(path, gradient(20, 10));
  EXPECT_TRUE(test::read_bytes(path).starts_with("\x89PNG\r\n"));
  EXPECT_THROW(write_png((folder.path() / "no" / "a.png").string(), gradient(2, 2)), Error);
}

TEST(Images, SrgbThereAndBack) {
  EXPECT_EQ(srgb_encode(-1), 0);
  EXPECT_FLOAT_EQ(srgb_encode(2), 1);
  EXPECT_NEAR(srgb_encode(0.18f), 0.4614f, 1e-4);
  for (float x = 0; x <= 1; x += 0.01f) EXPECT_NEAR(srgb_decode(srgb_encode(x)), x, 1e-5);
}

TEST(Compare, PsnrByHand) {
  const Image a = gradient(16, 9);
  Image b = a;
  EXPECT_TRUE(std::isinf(psnr(a, b)));
  for (float& value : b.values) value += 0.1f;
  EXPECT_NEAR(psnr(a, b), 20, 1e-4);  // a mean square of 1/100
  b = a;
  b.values[0] += 1;
  EXPECT_NEAR(psnr(a, b), 10 * std::log10(16 * 9 * 3), 1e-4);
}

TEST(Compare, SsimFallsWithDamage) {
  const Image a = gradient(40, 30);
  EXPECT_NEAR(ssim(a, a), 1, 1e-12);
  Image little = a, much = a;
  for (size_t i = 0; i < a.values.size(); i += 7) {
    little.values[i] += 0.05f;
    much.values[i] = 1 - much.values[i];
  }
  EXPECT_LT(ssim(a, little), 1);
  EXPECT_LT(ssim(a, much), ssim(a, little));
  // For two uniform pictures only the means matter: (2 x y + c1) / (x^2 + y^2 + c1).
  Image grey(16, 16), white(16, 16);
  std::fill(grey.values.begin(), grey.values.end(), 0.5f);
  std::fill(white.values.begin(), white.values.end(), 1.0f);
  EXPECT_NEAR(ssim(grey, white), (1 + 1e-4) / (1.25 + 1e-4), 1e-6);
}

TEST(Compare, SheetsKeepEveryPicture) {
  const Image a = gradient(8, 4);
  const Image sheet = contact_sheet({&a, &a, &a}, 2);
  EXPECT_EQ(sheet.width, 2 * 8 + 4u);
  EXPECT_EQ(sheet.height, 2 * 4 + 4u);
  EXPECT_EQ(sheet.at(12, 0)[0], a.at(0, 0)[0]);
  EXPECT_EQ(sheet.at(0, 8)[2], a.at(0, 0)[2]);
  EXPECT_EQ(sheet.at(12, 8)[0], 1);
  const Image small = scaled_down(a, 4);
  EXPECT_EQ(small.width, 4u);
  EXPECT_EQ(small.height, 2u);
  Image flat(9, 7);
  std::fill(flat.values.begin(), flat.values.end(), 0.3f);
  for (const float value : scaled_down(flat, 4).values) EXPECT_NEAR(value, 0.3f, 1e-5);
}

}  // namespace
}  // namespace nif::render
