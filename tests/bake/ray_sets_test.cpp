// The named ray sets are what docs/ray-sets.md says, and the same for any number of threads.
#include "bake/ground_truth/ray_sets.hpp"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <cstring>
#include <numbers>
#include <set>

#include "bake/ground_truth/evaluate.hpp"
#include "tests/support/occupied_object.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

using bake::RaySet;

Double3 origin_of(const kernels::Segment& s) { return {s.origin[0], s.origin[1], s.origin[2]}; }
Double3 direction_of(const kernels::Segment& s) { return {s.direction[0], s.direction[1], s.direction[2]}; }

class RaySets : public testing::Test {
 protected:
  const OccupiedObject sphere{icosphere(5), 32};
  const bake::RaySource& source = sphere.truth->source();
};

TEST_F(RaySets, DoNotDependOnTheNumberOfThreads) {
  for (RaySet set : bake::kRaySets) {
    bake::RaysWithTruth results[2];
    for (size_t threads : {1, 2}) {
      tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
      results[threads - 1] = bake::make_ray_set(source, set, 20'000, 9);
    }
    ASSERT_EQ(results[0].segments.size(), 20'000u) << bake::name_of(set);
    ASSERT_EQ(std::memcmp(results[0].segments.data(), results[1].segments.data(),
                          20'000 * sizeof(kernels::Segment)),
              0);
    ASSERT_EQ(results[0].visible, results[1].visible);
    const bake::RaysWithTruth other = bake::make_ray_set(source, set, 20'000, 10);
    ASSERT_NE(
        std::memcmp(results[0].segments.data(), other.segments.data(), 20'000 * sizeof(kernels::Segment)), 0);
  }
}

TEST_F(RaySets, NamesAreFoundAgain) {
  for (RaySet set : bake::kAllRaySets) EXPECT_EQ(bake::ray_set_named(bake::name_of(set)), set);
  EXPECT_FALSE(bake::ray_set_named("outer lines"));
}

TEST_F(RaySets, OuterLinesAreIsotropicLinesThroughTheBoxFromOutside) {
  constexpr size_t kCount = 200'000;
  const bake::RaysWithTruth rays = bake::make_ray_set(source, RaySet::outer_lines, kCount, 1);
  Double3 mean{};
  double squares[3] = {};
  size_t occluded = 0;
  for (size_t i = 0; i < kCount; ++i) {
    const Double3 d = direction_of(rays.segments[i]), o = origin_of(rays.segments[i]);
    mean = mean + d * (1.0 / kCount);
    bool outside = false;
    for (int a = 0; a < 3; ++a) {
      squares[a] += d[a] * d[a] / kCount;
      outside |= o[a] < source.box.min[a] || o[a] > source.box.max[a];
    }
    ASSERT_TRUE(outside);
    ASSERT_EQ(rays.segments[i].tmax, std::numeric_limits<float>::infinity());
    occluded += !rays.visible[i];
  }
  // Cauchy: of the lines through a convex body, the share that meets a convex body inside it is the ratio of
  // their surface areas.
  EXPECT_NEAR(double(occluded) / kCount, std::numbers::pi * 4 / 24, 0.005);
  for (int a = 0; a < 3; ++a) EXPECT_NEAR(squares[a], 1.0 / 3, 0.01);
  EXPECT_NEAR(length(mean), 0, 0.02);
}

TEST_F(RaySets, InnerSurfaceStartsAtTheBiasOnTheVisibleSide) {
  const bake::RaysWithTruth rays = bake::make_ray_set(source, RaySet::inner_surface, 20'000, 1);
  for (const kernels::Segment& s : rays.segments) {
    const double distance = length(origin_of(s)) - 1;
    ASSERT_GT(distance, 0.0);
    ASSERT_LT(distance, 2 * source.bias);
    ASSERT_GT(dot(direction_of(s), origin_of(s)), -0.05);  // facets are slightly tilted against the sphere
  }
  // A convex body does not block rays that start on it, except where facets meet.
  EXPECT_GT(std::count(rays.visible.begin(), rays.visible.end(), 1), 19'900);
}

TEST_F(RaySets, InnerVolumeStartsOutsideTheSolid) {
  const bake::RaysWithTruth rays = bake::make_ray_set(source, RaySet::inner_volume, 20'000, 1);
  size_t close = 0;
  for (const kernels::Segment& s : rays.segments) {
    ASSERT_GT(length(origin_of(s)), 0.99);
    close += length(origin_of(s)) < 1.2;
  }
  EXPECT_GT(close, 2000u);
}

TEST_F(RaySets, SegmentsHaveLogUniformLengths) {
  const bake::RaysWithTruth rays = bake::make_ray_set(source, RaySet::segments, 40'000, 1);
  size_t tenth = 0;
  for (const kernels::Segment& s : rays.segments) {
    const double fraction = s.tmax / source.box.diagonal();
    ASSERT_GE(fraction, 0.00999);
    ASSERT_LE(fraction, 1.00001);
    tenth += fraction < 0.1;  // half of the way from 0.01 to 1 in logarithms
  }
  EXPECT_NEAR(double(tenth) / 40'000, 0.5, 0.01);
}

TEST_F(RaySets, EachSunHasOneDirectionAndLightsWhatFacesIt) {
  const bake::RaysWithTruth rays = bake::make_ray_set(source, RaySet::sun, 20'000, 1);
  ASSERT_EQ(rays.segments.size(), 20'000u);
  ASSERT_EQ(rays.group_ends.size(), bake::kSuns);
  ASSERT_EQ(rays.group_ends.back(), rays.segments.size());
  size_t first = 0;
  std::set<Double3> directions;
  for (const size_t end : rays.group_ends) {
    EXPECT_NEAR(double(end - first), 20'000.0 / bake::kSuns, 1);
    directions.insert(direction_of(rays.segments[first]));
    for (; first < end; ++first) {
      const kernels::Segment& s = rays.segments[first];
      ASSERT_EQ(direction_of(s), *directions.find(direction_of(s)));
      ASSERT_GT(dot(direction_of(s), origin_of(s)), -0.05);
    }
  }
  EXPECT_EQ(directions.size(), bake::kSuns);
}

/// Pictures that just contain the box, in scan order, from one viewpoint each.
TEST_F(RaySets, EachCameraSeesTheWholeBoxInScanOrder) {
  const bake::RaysWithTruth rays = bake::make_ray_set(source, RaySet::camera, 20'001, 1);
  ASSERT_EQ(rays.segments.size(), 20'001u);
  ASSERT_EQ(rays.group_ends.size(), bake::kCameras);
  const Double3 middle = (to_double(source.box.min) + to_double(source.box.max)) * 0.5;
  size_t first = 0;
  std::set<Double3> positions;
  for (const size_t end : rays.group_ends) {
    const Double3 position = origin_of(rays.segments[first]);
    positions.insert(position);
    EXPECT_NEAR(length(position - middle), 1.25 * source.box.diagonal(), 1e-5);
    size_t near = 0, hits = 0;
    const size_t begin = first;
    for (; first < end; ++first) {
      const Double3 direction = direction_of(rays.segments[first]);
      ASSERT_EQ(origin_of(rays.segments[first]), position);
      ASSERT_NEAR(length(direction), 1, 1e-6);
      ASSERT_EQ(rays.segments[first].tmax, kInfinity);
      hits += !rays.visible[first];
      if (first > begin) near += dot(direction, direction_of(rays.segments[first - 1])) > std::cos(0.03);
    }
    EXPECT_NEAR(double(end - begin), 20'001.0 / bake::kCameras, 1);
    EXPECT_GT(hits, (end - begin) / 10);
    EXPECT_GT(double(near), 0.97 * double(end - begin));  // all but the ends of rows
    // The picture shows the box's corners: each is within a pixel of some ray.
    for (uint32_t c = 0; c < 8; ++c) {
      Double3 corner;
      for (int a = 0; a < 3; ++a) corner[a] = (c >> a) & 1 ? source.box.max[a] : source.box.min[a];
      const Double3 to = corner - position;
      double best = -1;
      for (size_t i = begin; i < end; ++i)
        best = std::max(best, dot(direction_of(rays.segments[i]), to) / length(to));
      EXPECT_GT(best, std::cos(0.03)) << c;
    }
  }
  EXPECT_EQ(positions.size(), bake::kCameras);
  const bake::RaysWithTruth other = bake::make_ray_set(source, RaySet::camera, 20'001, 2);
  EXPECT_NE(origin_of(other.segments[0]), origin_of(rays.segments[0]));
}

TEST(RaySetsOfOddObjects, AFlatSheetHasAllButAVolume) {
  mesh::Mesh sheet{"sheet", {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 2, 3}}};
  const OccupiedObject o(sheet, 32);
  for (RaySet set : bake::kRaySets) {
    if (set == RaySet::sun) continue;  // may light the side that the picture does not show
    const size_t expected = set == RaySet::inner_volume ? 0 : 1000;
    EXPECT_EQ(bake::make_ray_set(o.truth->source(), set, 1000, 1).segments.size(), expected)
        << bake::name_of(set);
  }
}

TEST(Accuracy, BoundsTheErrorAsClopperAndPearson) {
  bake::Accuracy accuracy;
  accuracy.rays = 1000;
  EXPECT_NEAR(accuracy.error_bound(), 1 - std::pow(0.01, 1.0 / 1000), 1e-9);  // none of them wrong
  accuracy.leak = 3;
  accuracy.spurious = 4;
  // The rate at which 7 or fewer of 1000 are wrong with a probability of 1 %.
  const double p = accuracy.error_bound();
  double chance = 0;
  for (int k = 0; k <= 7; ++k)
    chance += std::exp(std::lgamma(1001) - std::lgamma(k + 1) - std::lgamma(1001 - k) + k * std::log(p) +
                       (1000 - k) * std::log1p(-p));
  EXPECT_NEAR(chance, 0.01, 1e-6);
  accuracy.leak = 996;
  EXPECT_EQ(accuracy.error_bound(), 1);
  bake::Accuracy exact;
  exact.rays = exact.certain = 10;
  EXPECT_EQ(exact.error_bound(), 0);
  EXPECT_EQ(bake::Accuracy{}.error_bound(), 0);
}

TEST(EmbreeTruth, IsInDoubtWhereRoundingDecides) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  const mesh::Mesh box = cube();
  const bake::EmbreeTruth embree(box);
  const auto in_doubt = [&](float x, float y, float tmax) {
    return embree.in_doubt({{x, y, -5}, {0, 0, 1}, 0, tmax});
  };
  EXPECT_FALSE(in_doubt(0.3f, 0.2f, kInfinity));
  EXPECT_FALSE(in_doubt(1.5f, 0.2f, kInfinity));
  EXPECT_FALSE(in_doubt(0.2f, 0.2f, kInfinity)) << "an edge between two triangles hides what they hide";
  EXPECT_TRUE(in_doubt(1, 0.2f, kInfinity));
  EXPECT_TRUE(in_doubt(0.3f, -1, kInfinity));
  EXPECT_FALSE(in_doubt(0.999f, 0.2f, kInfinity));
  EXPECT_TRUE(in_doubt(0.3f, 0.2f, 4)) << "it ends on the surface";
  EXPECT_FALSE(in_doubt(0.3f, 0.2f, 3.99f));
  EXPECT_FALSE(in_doubt(0.3f, 0.2f, 4.01f));
}

}  // namespace
}  // namespace nif::test
