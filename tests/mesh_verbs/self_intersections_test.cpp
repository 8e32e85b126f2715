// Crossing triangles by CGAL: none are missed, and neighbours are none.
#include <gtest/gtest.h>

#include <cmath>

#include "mesh/cgal/cgal.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

cgal::SelfIntersections found_in(const mesh::Mesh& mesh) {
  const std::atomic<bool> go_on{false};
  return cgal::find_self_intersections(mesh::clean(mesh), go_on).value();
}

class SelfIntersections : public testing::Test {
 protected:
  void SetUp() override {
    if (!cgal::available()) GTEST_SKIP() << "built without CGAL";
  }
};

TEST_F(SelfIntersections, NeighboursDoNotCount) {
  for (const mesh::Mesh& mesh : {cube(), icosphere(3), torus(32, 16), open_bowl(8, 16), nested_spheres(2)})
    EXPECT_EQ(found_in(mesh).pairs, 0u) << mesh.name;
}

TEST_F(SelfIntersections, CrossingAndTouchingTrianglesArePairs) {
  const auto two = [](std::array<mesh::Float3, 3> p, std::array<mesh::Float3, 3> q) {
    mesh::Mesh mesh{"two", {}, {{0, 1, 2}, {3, 4, 5}}};
    mesh.positions.insert(mesh.positions.end(), p.begin(), p.end());
    mesh.positions.insert(mesh.positions.end(), q.begin(), q.end());
    return found_in(mesh).pairs;
  };
  const std::array<mesh::Float3, 3> flat{{{0, 0, 0}, {4, 0, 0}, {0, 4, 0}}};
  EXPECT_EQ(two(flat, {{{1, 1, -1}, {1, 1, 1}, {2, 1, 1}}}), 1u) << "crossing";
  EXPECT_EQ(two(flat, {{{1, 1, 0}, {1, 1, 1}, {2, 1, 1}}}), 1u) << "a vertex on the other";
  EXPECT_EQ(two(flat, {{{1, 1, 1e-30f}, {1, 1, 1}, {2, 1, 1}}}), 0u) << "almost a vertex on the other";
  EXPECT_EQ(two(flat, {{{1, 1, 0}, {3, 1, 0}, {1, 3, 0}}}), 1u) << "overlapping in a plane";
  EXPECT_EQ(two(flat, {{{0, 0, 0}, {4, 0, 0}, {0, 2, 0}}}), 1u) << "folded along a shared edge";
  EXPECT_EQ(two(flat, {{{0, 0, 0}, {4, 0, 0}, {0, -2, 0}}}), 0u) << "flat across a shared edge";
  EXPECT_EQ(two(flat, {{{0, 0, 0}, {4, 4, 1}, {4, 4, -1}}}), 1u) << "crossing from a shared vertex";
  EXPECT_EQ(two(flat, {{{0, 0, 0}, {0, 4, 0}, {4, 0, 0}}}), 0u) << "a twin that faces the other way";
}

TEST_F(SelfIntersections, TwoCubesThroughEachOther) {
  mesh::Mesh mesh = cube();
  append(mesh, cube(), 1, {0.5f, 0.7f, 0.9f});
  const cgal::SelfIntersections found = found_in(mesh);
  EXPECT_GT(found.pairs, 6u);
  EXPECT_GE(found.triangles, 12u);
  EXPECT_LE(found.triangles, 24u);
}

/// All triangles of a fan meet in one vertex.
TEST_F(SelfIntersections, StopAtTooManyPairs) {
  constexpr uint32_t kTriangles = 500;
  constexpr uint64_t kPairs = kTriangles * (kTriangles - 1) / 2;
  mesh::Mesh fan{"fan", {{0, 0, 0}}, {}};
  for (uint32_t i = 0; i <= kTriangles; ++i) {
    const float angle = 0.001f * static_cast<float>(i);
    fan.positions.push_back({std::cos(angle), std::sin(angle), 0});
    if (i > 0) fan.triangles.push_back({0, i, i + 1});
  }
  const std::atomic<bool> go_on{false};
  EXPECT_EQ(cgal::find_self_intersections(mesh::clean(fan), go_on, kPairs).value().pairs, 0u);
  EXPECT_FALSE(cgal::find_self_intersections(mesh::clean(fan), go_on, 100));
}

TEST_F(SelfIntersections, CanBeCancelled) {
  const std::atomic<bool> cancel{true};
  try {
    cgal::find_self_intersections(mesh::clean(cube()), cancel);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.status(), Status::interrupted);
  }
}

}  // namespace
}  // namespace nif::test
