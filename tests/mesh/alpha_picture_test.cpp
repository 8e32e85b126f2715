// What triangles show of a picture: points of random triangles never contradict the answer, in all modes of wrapping. And
// the limits of what is kept of it.
#include "formats/mesh/alpha_picture.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "formats/mesh/hole_maker.hpp"
#include "tests/support/test_random.hpp"

namespace nif::test {
namespace {

using mesh::TriangleAlpha;
using mesh::Wrap;
using mesh::detail::AlphaPicture;
using mesh::detail::Filled;
using mesh::detail::HoleMaker;
using mesh::detail::NewHoles;
using mesh::detail::TexelPoint;

constexpr uint32_t kHalf = 32768;

/// Alpha by x and y.
template <class AlphaAt>
mesh::detail::AlphaTexels texels(uint32_t width, uint32_t height, const AlphaAt& alpha_at) {
  mesh::detail::AlphaTexels out{width, height, {}};
  for (uint32_t y = 0; y < height; ++y)
    for (uint32_t x = 0; x < width; ++x) out.alpha.push_back(uint16_t(alpha_at(x, y)));
  return out;
}

/// The texel of a coordinate, as engines wrap it.
uint32_t wrapped(double at, uint32_t size, Wrap wrap) {
  const double texel = std::floor(at), whole = double(size);
  if (wrap == Wrap::clamp) return uint32_t(std::clamp(texel, 0.0, whole - 1));
  const double period = wrap == Wrap::mirror ? 2 * whole : whole;
  const double within = texel - std::floor(texel / period) * period;
  return uint32_t(within < whole ? within : period - 1 - within);
}

TEST(AlphaPicture, NoPointOfATriangleContradictsIt) {
  Random random(5);
  int found[3] = {};
  uint64_t steps = AlphaPicture::kMostSteps;
  for (int round = 0; round < 3000; ++round) {
    const uint32_t width = 1 + random.below(40), height = 1 + random.below(40), part = 1 + random.below(200);
    const bool mostly = random.below(2) == 0;
    const auto source = texels(
        width, height, [&](uint32_t, uint32_t) { return (random.below(part) == 0) == mostly ? 0 : 65535; });
    const AlphaPicture picture(source);
    const std::array<Wrap, 2> wrap{Wrap(random.below(3)), Wrap(random.below(3))};
    const double reach = random.below(4) == 0 ? 60 : 3;
    const TexelPoint middle{random.between(-60.0f, 90.0f), random.between(-60.0f, 90.0f)};
    std::array<TexelPoint, 3> corners;
    for (TexelPoint& corner : corners)
      corner = {middle[0] + random.between(-1.0f, 1.0f) * reach,
                middle[1] + random.between(-1.0f, 1.0f) * reach};
    if (random.below(8) == 0) corners[1] = corners[0];  // no area
    const TriangleAlpha shown = picture.show(corners, wrap, kHalf, steps);
    ++found[size_t(shown)];
    bool blocks = false, passes = false;
    for (int i = 0; i < 400; ++i) {
      double u = random.unit(), v = random.unit();
      if (u + v > 1) u = 1 - u, v = 1 - v;
      TexelPoint p;
      for (size_t a = 0; a < 2; ++a)
        p[a] = (1 - u - v) * corners[0][a] + u * corners[1][a] + v * corners[2][a];
      const uint16_t alpha =
          source.alpha[size_t{wrapped(p[1], height, wrap[1])} * width + wrapped(p[0], width, wrap[0])];
      (alpha >= kHalf ? blocks : passes) = true;
    }
    ASSERT_FALSE(shown == TriangleAlpha::solid && passes) << round;
    ASSERT_FALSE(shown == TriangleAlpha::clear && blocks) << round;
  }
  for (const int count : found) EXPECT_GT(count, 20);
}

TEST(AlphaPicture, LooksOnlyAtTexelsThatATriangleTouches) {
  // The lower right half blocks.
  const AlphaPicture picture(texels(64, 64, [](uint32_t x, uint32_t y) { return x > y ? 0 : 65535; }));
  uint64_t steps = AlphaPicture::kMostSteps;
  const auto show = [&](const TexelPoint& a, const TexelPoint& b, const TexelPoint& c,
                        const std::array<Wrap, 2>& wrap = {}) {
    return picture.show({a, b, c}, wrap, kHalf, steps);
  };
  EXPECT_EQ(show({0.5, 1.5}, {0.5, 63.5}, {62.5, 63.5}), TriangleAlpha::solid);
  EXPECT_EQ(show({2.5, 0.5}, {63.5, 0.5}, {63.5, 61.5}), TriangleAlpha::clear);
  EXPECT_EQ(show({0.5, 0.5}, {63.5, 0.5}, {63.5, 63.5}), TriangleAlpha::cut);
  EXPECT_EQ(show({5, 40}, {5, 40}, {5, 40}), TriangleAlpha::solid) << "a point";
  EXPECT_EQ(show({-100, -100}, {-90, -100}, {-90, -90}, {Wrap::clamp, Wrap::clamp}), TriangleAlpha::solid)
      << "the corner at 0 0";
  EXPECT_EQ(show({100, -100}, {110, -100}, {110, -90}, {Wrap::clamp, Wrap::clamp}), TriangleAlpha::clear);
  EXPECT_EQ(show({-61, 1}, {-40, 1}, {-40, 15}, {Wrap::repeat, Wrap::repeat}), TriangleAlpha::clear);
  EXPECT_EQ(show({-62, 1}, {-62, 60}, {-60, 60}, {Wrap::mirror, Wrap::repeat}), TriangleAlpha::cut);
}

TEST(AlphaPicture, FarAndHugeTrianglesShowWhatTheWholePictureHas) {
  const AlphaPicture mixed(texels(8, 8, [](uint32_t x, uint32_t) { return x == 3 ? 0 : 65535; })),
      solid(texels(8, 8, [](uint32_t, uint32_t) { return 65535; }));
  uint64_t steps = AlphaPicture::kMostSteps;
  const double nan = std::numeric_limits<double>::quiet_NaN(), huge = 1e300;
  for (const double far : {1e12, -1e12, huge, nan, std::numeric_limits<double>::infinity(), 1e6}) {
    const std::array<TexelPoint, 3> corners{TexelPoint{0, 0}, {far, 1}, {1, far}};
    for (const Wrap wrap : {Wrap::repeat, Wrap::mirror}) {
      EXPECT_EQ(mixed.show(corners, {wrap, wrap}, kHalf, steps), TriangleAlpha::cut) << far;
      EXPECT_EQ(solid.show(corners, {wrap, wrap}, kHalf, steps), TriangleAlpha::solid) << far;
      EXPECT_EQ(solid.show(corners, {wrap, wrap}, 65536, steps), TriangleAlpha::clear)
          << "no texel is enough";
    }
  }
}

TEST(AlphaPicture, TakesNoMoreStepsThanItMay) {
  // Rows that pass and rows that block by turns: along one, only single texels decide.
  const AlphaPicture picture(texels(64, 64, [](uint32_t, uint32_t y) { return y % 2 == 0 ? 0 : 65535; }));
  const std::array<TexelPoint, 3> corners{TexelPoint{0, 0.3}, {60, 0.3}, {30, 0.6}};
  uint64_t steps = 1000;
  EXPECT_EQ(picture.show(corners, {}, kHalf, steps), TriangleAlpha::clear);
  EXPECT_LT(steps, 1000u);
  steps = 10;
  EXPECT_EQ(picture.show(corners, {}, kHalf, steps), TriangleAlpha::cut);
  EXPECT_EQ(steps, 0u);
}

/// Once the maps of a file are too large together, triangles that need another one have no holes.
TEST(HoleMaker, KeepsToItsLimit) {
  const AlphaPicture small({2, 1, {0, UINT16_MAX}}), large({100, 100, std::vector<uint16_t>(10'000, 7)});
  const std::array<TexelPoint, 3> corners{TexelPoint{0, 0}, {1, 0}, {0, 1}};
  HoleMaker maker(0, 104 * 104 + 4096);
  const std::array<Wrap, 2> repeat{}, clamp{Wrap::clamp, Wrap::clamp}, mirror{Wrap::mirror, Wrap::mirror};
  const NewHoles first = maker.of_picture(large, repeat, 5, corners);
  ASSERT_TRUE(first.map);
  EXPECT_EQ(maker.of_picture(large, repeat, 7, corners).map, first.map) << "no texel has 5 or 6";
  EXPECT_EQ(maker.of_picture(large, repeat, 8, corners).why, Filled::many);
  EXPECT_TRUE(maker.of_picture(small, repeat, 9, corners).map) << "as large as 4096 texels";
  const NewHoles last = maker.of_picture(small, clamp, 9, corners);
  EXPECT_FALSE(last.map);
  EXPECT_EQ(last.why, Filled::many);
  EXPECT_EQ(maker.of_picture(large, repeat, 6, corners).map, first.map) << "what is there stays";
  const NewHoles none =
      maker.of_picture(large, mirror, 7, {TexelPoint{NAN, 0}, {1, INFINITY}, {-1e300, 1e300}});
  EXPECT_FALSE(none.map);
  EXPECT_EQ(none.why, Filled::far);
}

/// Any places whatever: those that fit are kept to half a unit.
TEST(HoleMaker, PlacesFit) {
  const AlphaPicture picture({3, 2, {0, UINT16_MAX, 0, 0, 0, 0}});
  HoleMaker maker(0);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> exponent(-20, 70), sign(-1, 1);
  for (int i = 0; i < 20'000; ++i) {
    std::array<TexelPoint, 3> corners;
    const double scale = std::exp2(exponent(random));
    for (TexelPoint& corner : corners)
      for (double& at : corner) at = sign(random) * scale;
    for (const Wrap wrap : {Wrap::repeat, Wrap::mirror, Wrap::clamp}) {
      const NewHoles made = maker.of_picture(picture, {wrap, wrap}, 1, corners);
      if (!made.map) {
        EXPECT_GT(scale, 0x1p29);
        continue;
      }
      const double unit = std::ldexp(1.0, int(made.holes.shift) - 16);
      for (size_t a = 0; a < 2; ++a) {
        const double period = wrap == Wrap::clamp ? 0 : (a == 0 ? 3 : 2) * (wrap == Wrap::mirror ? 2 : 1);
        double moved = made.holes.places[0][a] * unit - corners[0][a];
        if (period > 0) moved -= period * std::round(moved / period);
        EXPECT_LE(std::abs(moved), unit * 0.5001 + scale * 1e-15);
        int32_t least = made.holes.places[0][a];
        for (const auto& place : made.holes.places) least = std::min(least, place[a]);
        if (period > 0) {
          EXPECT_TRUE(least >= 0 && least * unit <= period) << least;
        }
        for (size_t k = 1; k < 3; ++k)
          EXPECT_NEAR((made.holes.places[k][a] - double(made.holes.places[0][a])) * unit,
                      corners[k][a] - corners[0][a], unit * 1.0001 + scale * 1e-15);
      }
    }
  }
}

}  // namespace
}  // namespace nif::test
