// FLIP: its properties, and values that can be computed by hand.
#include "tools/render/flip.hpp"

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <cmath>

#include "formats/base/random.hpp"

namespace nif::render {
namespace {

Image plain(float r, float g, float b, uint32_t width = 24, uint32_t height = 20) {
  Image image(width, height);
  for (size_t i = 0; i < image.values.size(); ++i) image.values[i] = i % 3 == 0 ? r : i % 3 == 1 ? g : b;
  return image;
}

Image noise(uint64_t seed) {
  Image image(40, 30);
  Random random(seed, 0, 0);
  for (float& value : image.values) value = float(random.uniform());
  return image;
}

/// A box filter: the mean of all pixels at most `radius` away along x and y.
Image blurred_by(const Image& image, int radius) {
  Image out(image.width, image.height);
  for (int y = 0; y < int(image.height); ++y)
    for (int x = 0; x < int(image.width); ++x)
      for (size_t c = 0; c < 3; ++c) {
        float sum = 0;
        int count = 0;
        for (int v = std::max(0, y - radius); v <= std::min(int(image.height) - 1, y + radius); ++v)
          for (int u = std::max(0, x - radius); u <= std::min(int(image.width) - 1, x + radius); ++u) {
            sum += image.at(uint32_t(u), uint32_t(v))[c];
            ++count;
          }
        out.at(uint32_t(x), uint32_t(y))[c] = sum / float(count);
      }
  return out;
}

// The paper's colour difference of two uniform pictures: no filter has an effect, and there are no features.
// With the four-digit sRGB matrix of IEC 61966-2-1.
struct Lab {
  double l, a, b;
};
Lab hunt_of(double r, double g, double b) {
  const auto f = [](double v) { return v > 216.0 / 24389 ? std::cbrt(v) : (24389.0 / 27 * v + 16) / 116; };
  const double x = f((0.4124 * r + 0.3576 * g + 0.1805 * b) / 0.9505),
               y = f(0.2126 * r + 0.7152 * g + 0.0722 * b),
               z = f((0.0193 * r + 0.1192 * g + 0.9505 * b) / 1.0890);
  const double l = 116 * y - 16;
  return {l, 0.01 * l * 500 * (x - y), 0.01 * l * 200 * (y - z)};
}
double expected(const Lab& one, const Lab& other) {
  const auto powered = [](const Lab& p, const Lab& q) {
    return std::pow(std::abs(p.l - q.l) + std::sqrt((p.a - q.a) * (p.a - q.a) + (p.b - q.b) * (p.b - q.b)),
                    0.7);
  };
  const double most = powered(hunt_of(0, 1, 0), hunt_of(0, 0, 1)), here = powered(one, other);
  return here < 0.4 * most ? 0.95 * here / (0.4 * most)
                           : 0.95 + 0.05 * (here - 0.4 * most) / (most - 0.4 * most);
}

TEST(Flip, PlainColours) {
  const double black_white = flip(plain(0, 0, 0), plain(1, 1, 1));
  EXPECT_NEAR(black_white, expected(hunt_of(0, 0, 0), hunt_of(1, 1, 1)), 1e-3);
  EXPECT_NEAR(black_white, 0.967, 1e-3);  // the value of the authors' program
  EXPECT_NEAR(flip(plain(0, 1, 0), plain(0, 0, 1)), 1, 1e-6);
  // sRGB 0.5 is 0.2140 in linear light.
  EXPECT_NEAR(flip(plain(0.5f, 0, 0), plain(0.5f, 0.5f, 0)),
              expected(hunt_of(0.21404, 0, 0), hunt_of(0.21404, 0.21404, 0)), 1e-3);
  EXPECT_NEAR(flip(plain(0.5f, 0.5f, 0.5f), plain(0.52f, 0.5f, 0.5f)),
              expected(hunt_of(0.21404, 0.21404, 0.21404), hunt_of(0.23302, 0.21404, 0.21404)), 1e-3);
}

TEST(Flip, EqualPicturesDoNotDiffer) {
  EXPECT_EQ(flip(noise(1), noise(1)), 0);
  // Values are clamped to 0..1.
  EXPECT_EQ(flip(plain(-3, 2, 0.5f), plain(0, 1, 0.5f)), 0);
}

TEST(Flip, IsSymmetricAndWithinItsRange) {
  for (uint64_t seed = 1; seed < 4; ++seed) {
    const Image a = noise(seed), b = noise(seed + 10);
    const double there = flip(a, b);
    EXPECT_EQ(there, flip(b, a));
    EXPECT_GT(there, 0.1);
    EXPECT_LE(there, 1);
  }
}

TEST(Flip, MoreBlurDiffersMore) {
  Image squares(64, 48);
  for (uint32_t y = 0; y < 48; ++y)
    for (uint32_t x = 0; x < 64; ++x)
      for (size_t c = 0; c < 3; ++c) squares.at(x, y)[c] = (x / 12 + y / 12) % 2 ? 0.8f : 0.3f;
  double before = 0;
  for (int radius = 1; radius <= 5; ++radius) {
    const double now = flip(squares, blurred_by(squares, radius));
    EXPECT_GT(now, before) << radius;
    before = now;
  }
}

/// A missing edge counts more than the same change of colour without an edge.
TEST(Flip, FeaturesCount) {
  const Image grey = plain(0.5f, 0.5f, 0.5f, 64, 48);
  Image half = grey;
  for (uint32_t y = 0; y < 48; ++y)
    for (uint32_t x = 32; x < 64; ++x)
      for (size_t c = 0; c < 3; ++c) half.at(x, y)[c] = 0.7f;
  const double whole = flip(grey, plain(0.7f, 0.7f, 0.7f, 64, 48));
  EXPECT_GT(flip(grey, half), 0.5 * whole * 1.02);
}

/// From the paper's distance, single-pixel noise is hardly visible; the same values in large squares are.
TEST(Flip, TheEyeDoesNotSeeEveryPixel) {
  const auto checked = [](uint32_t size) {
    Image image(64, 64);
    for (uint32_t y = 0; y < 64; ++y)
      for (uint32_t x = 0; x < 64; ++x)
        for (size_t c = 0; c < 3; ++c) image.at(x, y)[c] = (x / size + y / size) % 2 ? 0.45f : 0.55f;
    return image;
  };
  const Image grey = plain(0.502f, 0.502f, 0.502f, 64, 64);
  EXPECT_LT(flip(grey, checked(1)), 0.5 * flip(grey, checked(16)));
}

TEST(Flip, SameForAnyNumberOfThreads) {
  double one = 0, two = 0;
  tbb::task_arena(1).execute([&] { one = flip(noise(1), noise(2)); });
  tbb::task_arena(2).execute([&] { two = flip(noise(1), noise(2)); });
  EXPECT_EQ(one, two);
}

/// Pictures smaller than the filters.
TEST(Flip, OnePixel) {
  EXPECT_NEAR(flip(plain(0, 0, 0, 1, 1), plain(1, 1, 1, 1, 1)), flip(plain(0, 0, 0), plain(1, 1, 1)), 1e-9);
  EXPECT_EQ(flip(Image(), Image()), 0);
}

}  // namespace
}  // namespace nif::render
