// Decimation and subdivision of shapes whose result is known.
#include <gtest/gtest.h>

#include <limits>

#include "formats/base/status.hpp"
#include "mesh/compare/compare.hpp"
#include "mesh/halfedge/decimate.hpp"
#include "mesh/halfedge/subdivide.hpp"
#include "mesh/inspect/inspect.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

using halfedge::DecimateOptions;
using halfedge::Scheme;
using mesh::Mesh;

const std::atomic<bool> kGoOn{false};

Mesh decimate(const Mesh& mesh, const DecimateOptions& options) {
  return halfedge::decimate(
      mesh, options, [](double) {}, kGoOn);
}

/// The largest distance of vertices and of triangles' centres from the unit sphere.
double distance_from_sphere(const Mesh& mesh) {
  double worst = 0;
  for (const mesh::Triangle& t : mesh.triangles) {
    double middle[3]{};
    for (const uint32_t v : t)
      for (size_t axis = 0; axis < 3; ++axis) middle[axis] += double(mesh.positions[v][axis]) / 3;
    worst = std::max(worst, std::abs(1 - std::hypot(middle[0], middle[1], middle[2])));
  }
  return worst;
}

TEST(Decimate, StopsAtTheNumberAndStaysClosed) {
  const Mesh ball = icosphere(4);
  for (const bool fast : {false, true}) {
    const Mesh light =
        fast ? halfedge::decimate_fast(ball, {500, {}, false}) : decimate(ball, {500, {}, false});
    EXPECT_LE(light.triangles.size(), 500u);
    EXPECT_GE(light.triangles.size(), 480u);
    const auto found = inspect::inspect(light);
    EXPECT_EQ(found.solids(), 1u);
    EXPECT_NEAR(found.volume, inspect::inspect(ball).volume, 0.15);
    EXPECT_LT(distance_from_sphere(light), 0.05);
    EXPECT_EQ(light.name, ball.name);
  }
}

TEST(Decimate, KeepsWithinTheErrorBound) {
  const Mesh ball = icosphere(5);
  size_t before = ball.triangles.size();
  for (const double bound : {0.002, 0.02}) {
    const Mesh light = decimate(ball, {0, bound, false});
    EXPECT_LT(light.triangles.size(), before);
    before = light.triangles.size();
    // Measured at vertices; a single random point of the surface is added.
    EXPECT_LE(compare::distance(mesh::clean(ball), mesh::clean(light), 1, 1).max, 1.001 * bound) << bound;
  }
}

TEST(Decimate, KeepsTheBoundaryUnlessAsked) {
  const Mesh bowl = open_bowl(24, 64);
  const Mesh kept = decimate(bowl, {200, {}, false}), moved = decimate(bowl, {40, {}, true});
  EXPECT_EQ(inspect::inspect(kept).boundary_edges, 64u);
  EXPECT_LT(inspect::inspect(moved).boundary_edges, 64u);
}

TEST(Decimate, TakesWhatIsNotManifold) {
  Mesh fin = icosphere(3);
  fin.positions.push_back({0, 3, 0});
  fin.triangles.push_back({fin.triangles[0][0], fin.triangles[0][1], uint32_t(fin.positions.size() - 1)});
  EXPECT_LE(decimate(fin, {300, {}, false}).triangles.size(), 310u);
  EXPECT_LE(halfedge::decimate_fast(fin, {300, {}, false}).triangles.size(), 310u);
}

TEST(Decimate, IsTheSameEachTimeAndCanBeCancelled) {
  const Mesh ring = torus(64, 32);
  const Mesh a = decimate(ring, {500, 0.01, false}), b = decimate(ring, {500, 0.01, false});
  EXPECT_EQ(a.positions, b.positions);
  EXPECT_EQ(a.triangles, b.triangles);
  const std::atomic<bool> cancel{true};
  try {
    halfedge::decimate(
        ring, {500, {}, false}, [](double) {}, cancel);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.status(), Status::interrupted);
  }
}

TEST(Subdivide, MakesAsManyTrianglesAsItSays) {
  const Mesh ball = icosphere(1);
  for (const Scheme scheme : {Scheme::loop, Scheme::catmull_clark, Scheme::sqrt3})
    for (const uint32_t times : {1u, 2u, 3u}) {
      const Mesh fine = halfedge::subdivide(ball, scheme, times);
      EXPECT_EQ(fine.triangles.size(), halfedge::subdivided_triangles(scheme, 80, times)) << int(scheme);
      const auto found = inspect::inspect(fine);
      EXPECT_EQ(found.solids(), 1u) << int(scheme) << ' ' << times;
      EXPECT_GT(found.volume, 0) << "it still faces outwards";
    }
  EXPECT_EQ(halfedge::subdivided_triangles(Scheme::loop, 100, 3), 6400u);
  EXPECT_EQ(halfedge::subdivided_triangles(Scheme::catmull_clark, 100, 2), 2400u);
  EXPECT_EQ(halfedge::subdivided_triangles(Scheme::loop, 1, 40), std::numeric_limits<uint64_t>::max());
}

TEST(Subdivide, KeepsABoundaryOpen) {
  const auto found = inspect::inspect(halfedge::subdivide(open_bowl(4, 8), Scheme::loop, 1));
  EXPECT_EQ(found.boundary_edges, 16u);
  EXPECT_EQ(found.boundary_loops, 1u);
}

TEST(Subdivide, Sqrt3TakesTrianglesThatShareMoreThanAnEdge) {
  // Two triangles back to back: OpenMesh could not flip their edges.
  const Mesh pillow{"pillow", {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 2, 1}}};
  EXPECT_EQ(halfedge::subdivide(pillow, Scheme::sqrt3, 1).triangles.size(), 6u);
  const Mesh tetrahedron{"tetrahedron",
                         {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                         {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}}};
  EXPECT_EQ(inspect::inspect(halfedge::subdivide(tetrahedron, Scheme::sqrt3, 2)).solids(), 1u);
}

TEST(Subdivide, Sqrt3KeepsABoundaryAndSmoothsByItsMask) {
  const auto found = inspect::inspect(halfedge::subdivide(open_bowl(4, 8), Scheme::sqrt3, 2));
  EXPECT_EQ(found.boundary_edges, 8u);
  // A vertex of a tetrahedron has 3 neighbours: it moves by (4 - 2 cos 120) / 9 = 5 / 9 to their middle.
  const Mesh tetrahedron{"tetrahedron",
                         {{0, 0, 3}, {1, 0, 0}, {0, 1, 0}, {-1, -1, 0}},
                         {{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 3, 2}}};
  EXPECT_NEAR(halfedge::subdivide(tetrahedron, Scheme::sqrt3, 1).positions[0][2], 3 * 4 / 9.0, 1e-6);
}

TEST(Subdivide, LoopTakesVerticesOfManyNeighbours) {
  // By default, OpenMesh has weights for fewer than 50 neighbours.
  const Mesh fine = halfedge::subdivide(uv_sphere(4, 500), Scheme::loop, 1);
  for (const mesh::Float3& p : fine.positions)
    for (const float x : p) ASSERT_LE(std::abs(x), 1.01f);
  EXPECT_GT(fine.positions[0][2], 0.4f);
}

TEST(Subdivide, LoopSmoothsByItsMask) {
  // A vertex of an octahedron has 4 neighbours; Loop moves it to (1 - 4b) v + b sum, with b = 31 / 256.
  const Mesh octahedron{
      "octahedron",
      {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}},
      {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}}};
  const Mesh fine = halfedge::subdivide(octahedron, Scheme::loop, 1);
  EXPECT_NEAR(fine.positions[0][0], 1 - 4 * 31 / 256.0, 1e-6);
}

}  // namespace
}  // namespace nif::test
