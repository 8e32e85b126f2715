// The scalar definition of `spherical`: half precision, angles, which rays ask which network, look-ups.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "kernels/reference/kernel.hpp"
#include "kernels/reference/spherical/spherical_query.hpp"
#include "tests/support/random_spherical.hpp"

namespace nif {
namespace {

using kernels::Answer;
using kernels::Segment;
using kernels::SphericalField;
using kernels::SphericalKind;
constexpr float kInfinity = std::numeric_limits<float>::infinity();

TEST(Half, EveryNumberAndBack) {
  for (uint32_t bits = 0; bits < 0x10000; ++bits) {
    if ((bits & kernels::kHalfExponent) == kernels::kHalfExponent) continue;  // infinite or NaN
    const float value = kernels::from_half(uint16_t(bits));
    const uint32_t exponent = bits >> 10 & 31, mantissa = bits & 1023;
    const double size = exponent == 0 ? mantissa * 0x1p-24 : std::ldexp(1024 + mantissa, int(exponent) - 25);
    ASSERT_EQ(double(value), bits & 0x8000 ? -size : size);
    ASSERT_EQ(kernels::to_half(value), bits);
  }
}

TEST(Half, RoundsToTheNearestAndTiesToEven) {
  for (uint32_t bits = 0; bits < 0x7bff; ++bits) {
    const double low = double(kernels::from_half(uint16_t(bits))),
                 high = double(kernels::from_half(uint16_t(bits + 1)));
    const auto rounded = [&](double share) {
      return kernels::to_half(static_cast<float>(low + share * (high - low)));
    };
    ASSERT_EQ(rounded(0.25), bits);
    ASSERT_EQ(rounded(0.75), bits + 1);
    ASSERT_EQ(rounded(0.5), bits % 2 == 0 ? bits : bits + 1);
  }
  EXPECT_EQ(kernels::to_half(1e9f), 0x7bff);
  EXPECT_EQ(kernels::to_half(-kInfinity), 0xfbff);
  EXPECT_EQ(kernels::to_half(-1e-20f), 0x8000);
}

TEST(Spherical, AnglesAreThoseOfTheStandardLibrary) {
  test::Random random(1);
  for (int i = 0; i < 200'000; ++i) {
    const float scale = std::exp2(random.between(-60.0f, 60.0f));
    float x = scale * random.between(-1.0f, 1.0f), y = scale * random.between(-1.0f, 1.0f);
    if (i % 16 == 0) x = 0;
    if (i % 16 == 1) y = 0;
    if (i % 16 == 2) y = i % 32 == 2 ? x : -x;
    const double expected = x == 0 && y == 0 ? 0 : std::atan2(double(y), double(x));
    ASSERT_NEAR(double(kernels::angle_of(y, x)), expected, 4e-7) << y << ' ' << x;
  }
}

SphericalField box(const std::array<float, 3>& low, const std::array<float, 3>& high) {
  SphericalField field;
  EXPECT_TRUE(kernels::set_bounds(low.data(), high.data(), field));
  return field;
}

TEST(Spherical, AsksTheNetworkOfWhereTheRayStarts) {
  const SphericalField field = box({-1, -1, -1}, {1, 1, 1});
  const auto kind = [&](const Segment& s) { return kernels::prepare_spherical(field, s).kind; };
  EXPECT_EQ(kind({{0, 0, 5}, {0, 0, -1}, 0, kInfinity}), SphericalKind::outer);
  EXPECT_EQ(kind({{0, 0, 5}, {0, 0, -1}, 4.5f, kInfinity}), SphericalKind::inner);
  EXPECT_EQ(kind({{0, 0, 0}, {0, 0, -1}, 0, kInfinity}), SphericalKind::inner);
  EXPECT_EQ(kind({{1, 0, 0}, {1, 0, 0}, 0, kInfinity}), SphericalKind::inner) << "the AABB is closed";
  EXPECT_EQ(kind({{0, 0, 0}, {0, 0, -1}, -kInfinity, kInfinity}), SphericalKind::outer);
  EXPECT_EQ(kind({{0, 0, 0}, {0, 0, -1}, 2, kInfinity}), SphericalKind::none) << "starts behind the AABB";
  EXPECT_EQ(kind({{0, 0, 5}, {0, 0, -1}, 0, 3.5f}), SphericalKind::none) << "ends before it";
  EXPECT_EQ(kind({{0, 0, 5}, {0, 0, -1}, 0, 4.5f}), SphericalKind::outer);
  EXPECT_EQ(kind({{0, 0, 5}, {0, 0, 1}, 0, kInfinity}), SphericalKind::none);

  // The entry point, or the distance if the ray starts inside.
  const auto at = kernels::prepare_spherical(field, {{0.5f, 0.5f, 5}, {0, 0, -2}, 0, kInfinity}).at;
  EXPECT_NEAR(at.position_theta, std::acos(1 / std::sqrt(1.5)) / M_PI, 1e-4);
  EXPECT_NEAR(at.position_phi, 0.5 + 1.0 / 8, 1e-6);
  EXPECT_NEAR(at.direction_theta, 1, 1e-6);
  EXPECT_NEAR(kernels::prepare_spherical(field, {{0.5f, 0, 0}, {0, 1, 0}, 0, 1}).at.distance,
              0.5 / std::sqrt(3), 1e-6);
}

/// Does the segment meet the AABB, in double precision?
bool meets(const SphericalField& field, const Segment& s) {
  double enter = double(s.tmin), leave = double(s.tmax);
  for (int a = 0; a < 3; ++a) {
    const double o = double(s.origin[a]), d = double(s.direction[a]);
    if (d == 0) {
      if (o < double(field.low[a]) || o > double(field.high[a])) return false;
      continue;
    }
    const double low = (double(field.low[a]) - o) / d, high = (double(field.high[a]) - o) / d;
    enter = std::max(enter, std::min(low, high));
    leave = std::min(leave, std::max(low, high));
  }
  return enter <= leave;
}

TEST(Spherical, IsCertainOnlyOfMisses) {
  test::Random random(2);
  uint64_t misses = 0, hits = 0, asked = 0;
  for (int i = 0; i < 300; ++i) {
    const format::Object object = test::random_spherical_object(random, "", 4);
    const SphericalField field = box(object.aabb_min, object.aabb_max);
    for (int r = 0; r < 1000; ++r) {
      const Segment segment = test::random_segment(random, field);
      const kernels::SphericalRay ray = kernels::prepare_spherical(field, segment);
      for (const float x : {ray.at.position_theta, ray.at.position_phi, ray.at.direction_theta,
                            ray.at.direction_phi, ray.at.distance})
        ASSERT_TRUE(x >= 0 && x <= 1.0001f) << x;
      asked += ray.kind != SphericalKind::none;
      if (ray.kind != SphericalKind::none || !ray.certain) continue;
      ++misses;
      hits += meets(field, segment);
    }
  }
  EXPECT_EQ(hits, 0u);
  EXPECT_GT(misses, 30'000u);
  EXPECT_GT(asked, 100'000u);
}

TEST(Spherical, GridsGoRoundInPhiAndEndInTheta) {
  const std::vector<float> values{0, 1, 2, 3, 10, 11, 12, 13, 20, 21, 22, 23, 30, 31, 32, 33};
  const kernels::SphericalGrid grid{{values.data(), false}, 4, 1};
  const auto at = [&](float theta, float phi) {
    float out;
    kernels::look_up_angles(grid, theta, phi, [&](uint32_t, float value) { out = value; });
    return out;
  };
  EXPECT_EQ(at(0, 0), 0);
  EXPECT_EQ(at(0, 0.125f), 0.5f);
  EXPECT_EQ(at(0, 0.75f), 3);
  EXPECT_EQ(at(0, 0.875f), 1.5f) << "between the last and the first";
  EXPECT_EQ(at(0, 1), 0);
  EXPECT_EQ(at(1, 0.25f), 31);
  EXPECT_NEAR(at(0.5f, 0), 15, 1e-5);
  EXPECT_EQ(at(1.0001f, -0.1f), 30) << "rounding beyond the ends";
}

TEST(Spherical, NoWeightsThatAReaderTakesGiveNaN) {
  test::Random random(3);
  for (int i = 0; i < 40; ++i) {
    format::Object object = test::random_spherical_object(random, "", 3);
    format::SphericalGrids& grids = object.spherical->grids;
    format::SphericalNetworks networks = test::random_networks(random, grids, kernels::kMaxSphericalWidth);
    const float top = kernels::kMaxSphericalValue;
    for (auto* values :
         {&grids.outer_position, &grids.outer_direction, &grids.inner_position, &grids.inner_direction,
          &grids.distance, &networks.outer.weights, &networks.inner.weights})
      for (float& value : *values) value = random.below(4) ? top : -top;
    const SphericalField field = format::field_of(grids, networks, object.bounds());
    for (int r = 0; r < 200; ++r) {
      const Segment segment = test::random_segment(random, field);
      const Answer answer = kernels::query(field, segment);
      ASSERT_EQ(answer.visible, answer.logit >= 0);
      ASSERT_GE(answer.logit, -int32_t(kernels::kMaxSphericalOutput) * 65536);
    }
  }
}

TEST(Spherical, TheLogitsSignIsTheOutputs) {
  EXPECT_EQ(kernels::spherical_logit(0), 0);
  EXPECT_EQ(kernels::spherical_logit(-1e-20f), -1);
  EXPECT_EQ(kernels::spherical_logit(1e-20f), 0);
  EXPECT_EQ(kernels::spherical_logit(1), 65536);
  EXPECT_LT(kernels::spherical_logit(1e30f), kernels::kCertainLogit);
  EXPECT_GT(kernels::spherical_logit(-1e30f), -kernels::kCertainLogit);
}

TEST(Spherical, RaysThatAreNoneAreVisible) {
  test::Random random(4);
  const format::Object object = test::random_spherical_object(random, "", 4);
  const format::SphericalGrids& grids = object.spherical->grids;
  const format::SphericalNetworks networks = test::random_networks(random, grids, 8);
  const SphericalField field = format::field_of(grids, networks, object.bounds());
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (const Segment& none :
       {Segment{{nan, 0, 0}, {0, 0, 1}, 0, 1}, Segment{{0, kInfinity, 0}, {0, 0, 1}, 0, 1},
        Segment{{0, 0, 0}, {0, nan, 1}, 0, 1}, Segment{{0, 0, 0}, {0, 0, 0}, 0, 1},
        Segment{{0, 0, 0}, {0, 0, 1}, nan, 1}, Segment{{0, 0, 0}, {0, 0, 1}, 0, nan}}) {
    EXPECT_TRUE(kernels::query(field, none).visible);
    EXPECT_FALSE(kernels::query(field, none).certain);
  }
  EXPECT_TRUE(kernels::query(field, {{0, 0, 0}, {0, 0, 1}, 2, 1}).certain);
}

}  // namespace
}  // namespace nif
