// Lights: what their samples add up to is what they send.
#include "tools/render/lighting.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <set>

#include "formats/base/status.hpp"
#include "tests/support/temp_dir.hpp"
#include "tools/render/pixel_samples.hpp"

namespace nif::render {
namespace {

using std::numbers::pi;

constexpr uint32_t kSamples = 1 << 16;

SceneDescription scene_of(Light light) {
  SceneDescription scene;
  scene.lights.push_back(std::move(light));
  return scene;
}

/// Irradiance on a surface at a point: the mean over samples.
Colour irradiance(const SceneDescription& scene, const Double3& point, const Double3& normal) {
  const Lighting lighting(scene);
  const PixelSamples numbers(1, 2, kSamples);
  Colour sum{};
  for (uint32_t s = 0; s < kSamples; ++s) {
    const LightSample sample = lighting.draw(0, point, normal, numbers.pair(0, s));
    EXPECT_NEAR(length(sample.direction), 1, 1e-9);
    const double cosine = std::max(0.0, dot(sample.direction, normal));
    for (size_t c = 0; c < 3; ++c) sum[c] += sample.irradiance[c] * cosine / kSamples;
  }
  return sum;
}

TEST(PixelSamples, EachCellOnce) {
  for (const uint32_t samples : {1u, 2u, 5u, 16u, 63u, 64u, 100u}) {
    const PixelSamples numbers(3, 4, samples);
    const auto columns = uint32_t(std::ceil(std::sqrt(double(samples)))),
               rows = (samples + columns - 1) / columns;
    std::set<std::pair<uint32_t, uint32_t>> cells;
    for (uint32_t s = 0; s < samples; ++s) {
      const Pair u = numbers.pair(7, s);
      ASSERT_TRUE(u[0] >= 0 && u[0] < 1 && u[1] >= 0 && u[1] < 1);
      cells.insert({uint32_t(u[0] * columns), uint32_t(u[1] * rows)});
    }
    EXPECT_EQ(cells.size(), samples);
  }
}

TEST(PixelSamples, DimensionsAreInOrdersOfTheirOwn) {
  const PixelSamples numbers(3, 4, 64);
  size_t same = 0;
  for (uint32_t s = 0; s < 64; ++s) same += int(numbers.pair(0, s)[0] * 8) == int(numbers.pair(1, s)[0] * 8);
  EXPECT_LT(same, 24u);  // 8 by chance
}

TEST(Lighting, SunShinesEvenly) {
  const Double3 direction{0.6, 0.8, 0};
  for (const double angle : {0.0, 0.5, 20.0}) {
    const Colour e = irradiance(scene_of(Sun{direction, {1, 2, 3}, angle}), {}, {0, 1, 0});
    EXPECT_NEAR(e[0], 0.8, 0.01) << angle;
    EXPECT_NEAR(e[2], 2.4, 0.03) << angle;
  }
}

TEST(Lighting, SkyOfOneColour) {
  for (const Sampling sampling : {Sampling::importance, Sampling::uniform}) {
    Sky sky;
    sky.radiance = {2, 1, 0};
    sky.sampling = sampling;
    const Double3 normal{0.48, 0.6, 0.64};
    const Colour e = irradiance(scene_of(sky), {}, normal);
    EXPECT_NEAR(e[0], 2 * pi, 0.01);
    EXPECT_EQ(e[2], 0);
  }
}

TEST(Lighting, AreaFromFarIsAPoint) {
  const double side = 0.01, distance = 3;
  const AreaLight area{{-side / 2, distance, -side / 2}, {side, 0, 0}, {0, 0, side}, {5, 5, 5}};
  const Colour e = irradiance(scene_of(area), {}, {0, 1, 0});
  EXPECT_NEAR(e[0], 5 * side * side / (distance * distance), 1e-8);
  const Colour point =
      irradiance(scene_of(PointLight{{0, distance, 0}, {5 * side * side, 0, 0}}), {}, {0, 1, 0});
  EXPECT_NEAR(point[0], e[0], 1e-8);
  // It shines only to one side.
  EXPECT_EQ(irradiance(scene_of(area), {0, 2 * distance, 0}, {0, -1, 0})[0], 0);
}

TEST(Lighting, SpotsFallOffBetweenTheirCones) {
  const SpotLight spot{{0, 2, 0}, {0, -1, 0}, {3, 3, 3}, 20, 40};
  const auto degrees = [](double angle) { return std::cos(angle * pi / 180); };
  EXPECT_EQ(spot_share(spot, 1), 1);
  EXPECT_EQ(spot_share(spot, degrees(19.9)), 1);
  EXPECT_EQ(spot_share(spot, degrees(40.1)), 0);
  EXPECT_EQ(spot_share(spot, -1), 0);
  // Halfway between the cosines it is a quarter; it falls monotonically without a step.
  EXPECT_NEAR(spot_share(spot, (degrees(20) + degrees(40)) / 2), 0.25, 1e-12);
  double last = 1;
  for (double angle = 20; angle <= 40; angle += 0.1) {
    const double share = spot_share(spot, degrees(angle));
    EXPECT_LE(share, last);
    EXPECT_GT(share, last - 0.02);
    last = share;
  }
  // Narrow cones, and those without a falloff.
  EXPECT_EQ(spot_share({{}, {0, -1, 0}, {1, 1, 1}, 0, 0.5}, 1), 1);
  const SpotLight hard{{}, {0, -1, 0}, {1, 1, 1}, 30, 30};
  EXPECT_EQ(spot_share(hard, degrees(29.9)), 1);
  EXPECT_EQ(spot_share(hard, degrees(30.1)), 0);
  // Within the inner cone it equals a point light; it does not shine backwards.
  EXPECT_NEAR(irradiance(scene_of(spot), {}, {0, 1, 0})[0], 3.0 / 4, 1e-9);
  EXPECT_EQ(irradiance(scene_of(spot), {3, 0, 0}, {0, 1, 0})[0], 0);
  EXPECT_EQ(irradiance(scene_of(spot), {0, 5, 0}, {0, -1, 0})[0], 0);
  EXPECT_EQ(irradiance(scene_of(spot), spot.position, {0, 1, 0})[0], 0);
}

class Environment : public testing::Test {
 protected:
  /// Dark except for one bright texel and a dim lower half.
  SceneDescription scene(Sampling sampling, double rotation, int up) {
    Image image(32, 16);
    for (uint32_t y = 8; y < 16; ++y)
      for (uint32_t x = 0; x < 32; ++x) image.at(x, y)[1] = 0.25f;
    image.at(5, 3)[0] = 100;
    const std::string path = (folder_.path() / "sky.exr").string();
    write_exr(path, image);
    Sky sky;
    sky.map = path;
    sky.sampling = sampling;
    sky.rotation = rotation;
    SceneDescription description = scene_of(sky);
    description.up = up;
    return description;
  }
  const test::TempDir folder_;
};

TEST_F(Environment, BothSamplingsAgree) {
  for (const int up : {0, 1, 2})
    for (const double rotation : {0.0, 77.0}) {
      Double3 tilted{0.36, 0.48, 0.8};
      const Colour important = irradiance(scene(Sampling::importance, rotation, up), {}, tilted);
      const Colour uniform = irradiance(scene(Sampling::uniform, rotation, up), {}, tilted);
      EXPECT_NEAR(important[0], uniform[0], 0.03 * important[0] + 0.01) << up << rotation;
      EXPECT_NEAR(important[1], uniform[1], 0.02) << up << rotation;
    }
}

TEST(Lighting, SkyWithAGlow) {
  Sky sky;
  sky.radiance = {0.5, 0.5, 0.5};
  sky.glow = Glow{{0.6, 0.8, 0}, {40, 20, 10}, 12};
  for (const int up : {0, 1, 2}) {
    SceneDescription scene = scene_of(sky);
    scene.up = up;
    const Double3 normal{0, 0.8, 0.6};
    const Colour important = irradiance(scene, {}, normal);
    std::get<Sky>(scene.lights[0]).sampling = Sampling::uniform;
    const Colour uniform = irradiance(scene, {}, normal);
    for (size_t c = 0; c < 3; ++c) EXPECT_NEAR(important[c], uniform[c], 0.02 * uniform[c]) << up;
    const Lighting lighting(scene);
    EXPECT_NEAR(lighting.background({0.6, 0.8, 0})[0], 40.5, 0.1);
    EXPECT_NEAR(lighting.background({-0.6, -0.8, 0})[0], 0.5, 1e-6);
  }
}

TEST_F(Environment, SamplesAreWhereTheLightIs) {
  const SceneDescription description = scene(Sampling::importance, 30, 1);
  const Lighting lighting(description);
  const PixelSamples numbers(1, 2, 1024);
  size_t bright = 0;
  for (uint32_t s = 0; s < 1024; ++s) {
    const LightSample sample = lighting.draw(0, {}, {0, 1, 0}, numbers.pair(0, s));
    const Colour seen = lighting.background(sample.direction);
    bright += seen[0] > 0;
    EXPECT_TRUE(seen[0] > 0 || seen[1] > 0);
  }
  EXPECT_GT(bright, 200u);
}

TEST_F(Environment, BlackOnesAreRefused) {
  const std::string path = (folder_.path() / "black.exr").string();
  write_exr(path, Image(8, 4));
  Sky sky;
  sky.map = path;
  try {
    const Lighting lighting(scene_of(sky));
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_EQ(error.status(), Status::not_an_image);
  }
}

}  // namespace
}  // namespace nif::render
