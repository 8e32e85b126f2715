// The judge itself: what it must find, and what it must let pass.
#include "tests/exact/judge.hpp"

#include <gtest/gtest.h>

#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

/// A triangle in the plane z = 1, bounded by x = 0, y = 0 and x + y = 4.
mesh::Mesh triangle() { return {"triangle", {{0, 0, 1}, {4, 0, 1}, {0, 4, 1}}, {{0, 1, 2}}}; }
NifRay upwards(float x, float y, float tmin = 0, float tmax = kEndless) {
  return {{x, y, 0}, tmin, {0, 0, 1}, tmax};
}
constexpr mesh::Float3 kCorners[3] = {{0, 0, 1}, {4, 0, 1}, {0, 4, 1}};

TEST(Judge, KnowsWhatIsMet) {
  const Judge judge(triangle(), false);
  EXPECT_FALSE(judge.visible(judge.look(upwards(1, 1))).empty());
  EXPECT_TRUE(judge.occluded(judge.look(upwards(1, 1))).empty());
  // Edges and corners belong to it, exactly to the last of 150 bits.
  for (const auto& [x, y] : {std::pair(0.f, 0.f), {2.f, 2.f}, {0.f, 3.f}, {0x1p-149f, 0.f}}) {
    EXPECT_FALSE(judge.visible(judge.look(upwards(x, y))).empty()) << x << ' ' << y;
    EXPECT_TRUE(judge.occluded(judge.look(upwards(x, y))).empty()) << x << ' ' << y;
  }
  NifRay slanted = upwards(0, 1);
  slanted.direction[0] = -0x1p-126f;
  EXPECT_TRUE(judge.visible(judge.look(slanted)).empty()) << "it passes 2^-126 beside";
  EXPECT_TRUE(judge.occluded(judge.look(slanted)).empty()) << "which is nearer than the tolerance";
  EXPECT_FALSE(judge.occluded(judge.look(upwards(-0x1p-30f, 1))).empty());
  EXPECT_TRUE(judge.occluded(judge.look(upwards(-0x1p-60f, 1))).empty());
}

TEST(Judge, KnowsTheEndsOfSegments) {
  const Judge judge(triangle(), false);
  EXPECT_FALSE(judge.visible(judge.look(upwards(1, 1, 0, 1.0001f))).empty());
  EXPECT_TRUE(judge.visible(judge.look(upwards(1, 1, 0, 1))).empty()) << "within the tolerance";
  EXPECT_TRUE(judge.occluded(judge.look(upwards(1, 1, 0, 1))).empty());
  EXPECT_FALSE(judge.occluded(judge.look(upwards(1, 1, 0, 0.9999f))).empty());
  EXPECT_FALSE(judge.occluded(judge.look(upwards(1, 1, 1.0001f))).empty());
  EXPECT_FALSE(judge.visible(judge.look(upwards(1, 1, -kEndless))).empty());
}

TEST(Judge, KnowsFirstHits) {
  mesh::Mesh two = triangle();
  two.positions.insert(two.positions.end(), {{0, 0, 3}, {4, 0, 3}, {0, 4, 3}});
  two.triangles.push_back({3, 4, 5});
  const Judge judge(two, false);
  const Look look = judge.look(upwards(1, 1));
  constexpr mesh::Float3 kBehind[3] = {{0, 0, 3}, {4, 0, 3}, {0, 4, 3}};
  EXPECT_TRUE(judge.first_hit(look, 1, kCorners).empty());
  EXPECT_FALSE(judge.first_hit(look, 3, kBehind).empty()) << "another one is met before";
  EXPECT_FALSE(judge.first_hit(look, 3, kCorners).empty()) << "not there";
  EXPECT_FALSE(judge.first_hit(look, 1.0001f, kCorners).empty());
  EXPECT_FALSE(judge.first_hit(judge.look(upwards(1, 1, 2)), 1, kCorners).empty()) << "before tmin";
  EXPECT_TRUE(judge.nothing_before(look, 1).empty());
  EXPECT_FALSE(judge.nothing_before(look, 1.0001f).empty());
  EXPECT_TRUE(judge.something_until(look, 1).empty());
  EXPECT_FALSE(judge.something_until(look, 0.9999f).empty());
  EXPECT_TRUE(judge.only_between(look, 1, 3).empty());
  EXPECT_FALSE(judge.only_between(look, 1.0001f, 3).empty());
  EXPECT_FALSE(judge.only_between(look, 0.5f, 2.9f).empty());
}

TEST(Judge, AllowsMissesOfTrianglesSeenEdgeOn) {
  const Judge judge(triangle(), false);
  const NifRay within{{-1, 1, 1}, 0, {1, 0, 0}, kEndless};
  EXPECT_TRUE(judge.visible(judge.look(within)).empty());
  EXPECT_TRUE(judge.occluded(judge.look(within)).empty());
  NifRay through = within;  // with a slope that is exact in double precision
  through.origin[2] = 1 + 0x1p-10f;
  through.direction[2] = -0x1p-11f;
  EXPECT_FALSE(judge.visible(judge.look(through)).empty());
}

TEST(Judge, KnowsTheInsideOfClosedMeshes) {
  const Judge judge(cube(), true), open(cube(), false);
  const NifRay from_within{{0.1f, 0.2f, 0.3f}, 0, {1, 0.3f, 0.1f}, kEndless};
  EXPECT_TRUE(judge.starts_inside(judge.look(from_within)));
  EXPECT_FALSE(open.starts_inside(open.look(from_within)));
  EXPECT_FALSE(judge.starts_inside(judge.look({{2, 0.2f, 0.3f}, 0, {1, 0, 0}, kEndless})));
}

TEST(Judge, AllowsATransformToMoveTheRay) {
  const Judge judge(triangle(), false);
  constexpr std::array<float, 12> kTwice{2, 0, 0, 10, 0, 2, 0, 0, 0, 0, 2, 0};
  const NifRay middle{{12, 2, 0}, 0, {0, 0, 1}, kEndless}, edge{{10, 2, 0}, 0, {0, 0, 1}, kEndless},
      beside{{9.99f, 2, 0}, 0, {0, 0, 1}, kEndless};
  EXPECT_FALSE(judge.visible(judge.look(middle, kTwice, 1e-3)).empty());
  EXPECT_TRUE(judge.visible(judge.look(edge, kTwice, 1e-3)).empty());
  EXPECT_TRUE(judge.occluded(judge.look(edge, kTwice, 1e-3)).empty());
  EXPECT_FALSE(judge.occluded(judge.look(beside, kTwice, 1e-3)).empty());
  EXPECT_TRUE(judge.first_hit(judge.look(middle, kTwice, 1e-3), 2, kCorners).empty());
}

}  // namespace
}  // namespace nif::test
