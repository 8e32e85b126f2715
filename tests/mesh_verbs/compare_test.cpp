// Distances and differences of visibility that are known beforehand.
#include "mesh/compare/compare.hpp"

#include <gtest/gtest.h>

#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

using mesh::Mesh;

TEST(Compare, AMeshIsNotFarFromItself) {
  const mesh::CleanMesh ring = mesh::clean(torus(64, 32));
  const compare::Distance distance = compare::distance(ring, ring, 10000, 1);
  EXPECT_EQ(distance.samples, 10000u);
  EXPECT_LT(distance.max, 1e-12);
  const Mesh mesh = torus(64, 32);
  const bake::Prepared prepared = bake::prepare(mesh);
  const bake::GroundTruth truth(prepared);
  for (const bake::RaySet set : bake::kRaySets) {
    const auto same = compare::visibility(truth, truth.source().embree, set, 10000, 1);
    EXPECT_GT(same.rays, 0u);
    EXPECT_EQ(same.opened + same.closed, 0u) << bake::name_of(set);
  }
}

TEST(Compare, ShiftedAndScaledCubes) {
  Mesh large;
  append(large, cube(), 2);
  const mesh::CleanMesh small = mesh::clean(cube()), big = mesh::clean(large);
  // Each point of the small cube is 1 from the nearest side of the large one, whose corners are sqrt(3) away.
  const compare::Distance there = compare::distance(small, big, 10000, 1),
                          back = compare::distance(big, small, 10000, 1);
  EXPECT_NEAR(there.mean, 1, 1e-9);
  EXPECT_NEAR(there.max, 1, 1e-9);
  EXPECT_NEAR(back.max, std::sqrt(3), 1e-6);
  EXPECT_GT(back.mean, 1);
  EXPECT_LT(back.mean, back.root_mean_square);
}

TEST(Compare, AHoleLetsRaysThrough) {
  const Mesh ball = icosphere(3);
  Mesh holed = ball;
  holed.triangles.erase(holed.triangles.begin(), holed.triangles.begin() + 64);
  const mesh::CleanMesh clean = mesh::clean(holed);
  const bake::Prepared prepared = bake::prepare(ball);
  const bake::GroundTruth truth(prepared);
  const bake::EmbreeTruth embree(clean);
  const auto found = compare::visibility(truth, embree, bake::RaySet::outer_lines, 100000, 1);
  EXPECT_EQ(found.closed, 0u);
  // A line through the removed twentieth of the sphere usually meets the rest on the other side.
  EXPECT_GT(found.opened, 0u);
  EXPECT_LT(found.difference(), 0.05);
}

}  // namespace
}  // namespace nif::test
