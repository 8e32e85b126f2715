// The shapes that other tests trust are what they claim to be.
#include "tests/support/test_shapes.hpp"

#include <gtest/gtest.h>

namespace nif::test {
namespace {

TEST(Shapes, ClosedOnesAreClosedAndFaceOutwards) {
  const double ball = 4.0 / 3 * std::numbers::pi;
  for (const auto& [mesh, volume, tolerance] :
       {std::tuple{cube(), 8.0, 1e-9}, std::tuple{icosphere(4), ball, 0.02},
        std::tuple{uv_sphere(40, 60), ball, 0.05},
        std::tuple{torus(80, 60), 2 * std::numbers::pi * std::numbers::pi * 0.16, 0.05},
        std::tuple{nested_spheres(4), ball * (1 - 0.125), 0.02}}) {
    EXPECT_EQ(open_edges(mesh), 0u) << mesh.name;
    EXPECT_NEAR(signed_volume(mesh), volume, tolerance) << mesh.name;
  }
}

TEST(Shapes, HaveTheStatedNumbersOfTriangles) {
  EXPECT_EQ(icosphere(3).triangles.size(), 20u * 64);
  EXPECT_EQ(uv_sphere(10, 12).triangles.size(), 2u * 12 * 9);
  EXPECT_EQ(torus(7, 5).triangles.size(), 70u);
}

TEST(Shapes, TheBowlIsOpenAlongItsRimOnly) {
  const mesh::Mesh bowl = open_bowl(6, 24);
  EXPECT_EQ(open_edges(bowl), 24u);
  EXPECT_GT(signed_volume(bowl), 0);
}

}  // namespace
}  // namespace nif::test
