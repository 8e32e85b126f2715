// Volumes that answer visibility rays.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "formats/base/random.hpp"
#include "formats/base/status.hpp"
#include "mesh/volume/ray_volume.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

using kernels::Segment;

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr double kVoxel = 2.0 / 64;

/// How close to the middle of the unit ball a line from the outside passes.
struct Line {
  Segment segment;
  double distance;
};

std::vector<Line> lines(float x) {
  std::vector<Line> all;
  Random random(1, 2, 3);
  for (int i = 0; i < 5000; ++i) {
    const Double3 from = random.direction() * 3.0, to = random.direction() * random.uniform(0, 1.5);
    Double3 direction = to - from;
    direction = direction * (1 / length(direction));
    all.push_back({{{float(from[0]) + x, float(from[1]), float(from[2])},
                    {float(direction[0]), float(direction[1]), float(direction[2])},
                    0,
                    kInfinity},
                   length(cross(from, direction))});
  }
  return all;
}

std::vector<uint8_t> ask(const volume::RayVolume& volume, const std::vector<Line>& lines, double skip = 0) {
  std::vector<Segment> segments;
  for (const Line& line : lines) segments.push_back(line.segment);
  std::vector<uint8_t> visible(segments.size(), 9);
  volume.ask(segments, skip, visible.data());
  return visible;
}

TEST(RayVolume, AnswersAsABallDoes) {
  // Also away from the origin, where nodes of OpenVDB's tree begin.
  for (const float x : {0.f, -700.f}) {
    mesh::Mesh ball;
    append(ball, icosphere(5), 1, {x, 0, 0});
    for (const auto& volume : {volume::distance_volume(ball, kVoxel), volume::voxel_volume(ball, kVoxel)}) {
      const std::vector<Line> asked = lines(x);
      const std::vector<uint8_t> visible = ask(*volume, asked);
      size_t inside = 0, outside = 0;
      for (size_t i = 0; i < asked.size(); ++i) {
        if (asked[i].distance < 1 - 2 * kVoxel) {
          EXPECT_EQ(visible[i], 0) << asked[i].distance;
          ++inside;
        } else if (asked[i].distance > 1 + 2 * kVoxel) {
          EXPECT_EQ(visible[i], 1) << asked[i].distance;
          ++outside;
        }
      }
      EXPECT_GT(inside, 1000u);
      EXPECT_GT(outside, 200u);
      EXPECT_GT(volume->bytes(), 1000u);
      EXPECT_LT(volume->bytes(), 2'000'000u);
    }
  }
}

TEST(RayVolume, KeepsToASegmentsEnds) {
  const mesh::Mesh ball = icosphere(5);
  for (const auto& volume : {volume::distance_volume(ball, kVoxel), volume::voxel_volume(ball, kVoxel)}) {
    const auto visible = [&](float tmin, float tmax, double skip = 0) {
      // The direction has length 2: the surface is met at t = 1 and 2.
      const std::vector<Line> one{{{{-3, 0, 0}, {2, 0, 0}, tmin, tmax}, 0}};
      return ask(*volume, one, skip)[0];
    };
    EXPECT_EQ(visible(0, kInfinity), 0);
    EXPECT_EQ(visible(0, 0.9f), 1);
    EXPECT_EQ(visible(0, 1.1f), 0);
    EXPECT_EQ(visible(1.1f, 1.9f), 1);
    EXPECT_EQ(visible(2.1f, kInfinity), 1);
    EXPECT_EQ(visible(1.95f, kInfinity), 0);
    EXPECT_EQ(visible(1.95f, kInfinity, 6), 1);  // six voxels are 0.09 of t
    EXPECT_EQ(visible(1, 0.5f), 1);              // an empty segment
  }
}

TEST(RayVolume, OfAnOpenMeshHasVoxelsButNoDistances) {
  const mesh::Mesh bowl = open_bowl(40, 60);
  try {
    volume::distance_volume(bowl, kVoxel);
    FAIL() << "a bowl has an inside";
  } catch (const Error& error) {
    EXPECT_EQ(error.status(), Status::all_degenerate);
  }
  EXPECT_GT(volume::voxel_volume(bowl, kVoxel)->bytes(), 1000u);
}

}  // namespace
}  // namespace nif::test
