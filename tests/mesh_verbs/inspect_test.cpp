// What is counted of meshes whose counts are known.
#include "mesh/inspect/inspect.hpp"

#include <gtest/gtest.h>

#include "formats/mesh/read.hpp"
#include "tests/support/real_meshes.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

using inspect::Inspection;
using mesh::Mesh;

TEST(Inspect, CountsAClosedSolid) {
  const Inspection ball = inspect::inspect(icosphere(3));
  EXPECT_EQ(ball.triangles, 1280u);
  EXPECT_EQ(ball.distinct_vertices, 642u);
  EXPECT_EQ(ball.edges, 1920u);
  ASSERT_EQ(ball.components.size(), 1u);
  EXPECT_TRUE(ball.components[0].solid());
  EXPECT_EQ(ball.components[0].genus(), 0u);
  EXPECT_EQ(ball.boundary_loops + ball.non_manifold_edges + ball.non_manifold_vertices, 0u);
  EXPECT_NEAR(ball.volume, 4.0 / 3 * std::numbers::pi, 0.05);
  EXPECT_NEAR(ball.area, 4 * std::numbers::pi, 0.1);

  const Inspection ring = inspect::inspect(torus(24, 12));
  EXPECT_EQ(ring.components.at(0).genus(), 1u);
}

TEST(Inspect, VolumeIsSignedAndExactForACube) {
  Mesh inside_out;
  append(inside_out, cube(), 1, {1000, 2000, 3000}, true);
  const Inspection found = inspect::inspect(inside_out);
  EXPECT_EQ(found.volume, -8);
  EXPECT_EQ(found.area, 24);
  EXPECT_EQ(found.inward_solids(), 1u);
  EXPECT_EQ(found.low, (mesh::Float3{999, 1999, 2999}));
  EXPECT_EQ(found.high, (mesh::Float3{1001, 2001, 3001}));
}

TEST(Inspect, FindsRimsAndHoles) {
  const Inspection bowl = inspect::inspect(open_bowl(8, 16));
  EXPECT_EQ(bowl.boundary_edges, 16u);
  EXPECT_EQ(bowl.boundary_loops, 1u);
  EXPECT_EQ(bowl.longest_loop, 16u);
  EXPECT_EQ(bowl.closed_components(), 0u);
  EXPECT_EQ(bowl.components[0].genus(), std::nullopt);

  Mesh holed = icosphere(2);
  holed.triangles.erase(holed.triangles.begin() + 100);
  holed.triangles.erase(holed.triangles.begin());
  const Inspection two = inspect::inspect(holed);
  EXPECT_EQ(two.boundary_loops, 2u);
  EXPECT_EQ(two.longest_loop, 3u);
}

TEST(Inspect, HolesThatTouchAtAVertexAreTwo) {
  // Two triangles of the fan around vertex 0 that share no edge: each leaves a hole of its own.
  Mesh holed = icosphere(0);
  const mesh::Triangle first = holed.triangles[0], second = holed.triangles[2];
  std::erase_if(holed.triangles, [&](const mesh::Triangle& t) { return t == first || t == second; });
  const Inspection found = inspect::inspect(holed);
  EXPECT_EQ(found.boundary_edges, 6u);
  EXPECT_EQ(found.non_manifold_vertices, 1u);
  // The vertex has two fans, so the boundary loops merge there.
  EXPECT_EQ(found.boundary_loops, 1u);
}

TEST(Inspect, FindsWhatIsNotManifold) {
  Mesh fin = cube();
  fin.positions.push_back({0, 3, 0});
  fin.triangles.push_back({fin.triangles[0][0], fin.triangles[0][1], 8});
  const Inspection edge = inspect::inspect(fin);
  EXPECT_EQ(edge.non_manifold_edges, 1u);
  EXPECT_EQ(edge.boundary_edges, 2u);

  Mesh tips = cube();
  append(tips, cube(), 1, {2, 2, 2});  // share the corner (1, 1, 1), but only by position
  const Inspection vertex = inspect::inspect(tips);
  EXPECT_EQ(vertex.non_manifold_edges, 0u);
  EXPECT_EQ(vertex.non_manifold_vertices, 1u);
  EXPECT_EQ(vertex.solids(), 2u);
  EXPECT_EQ(vertex.components[0].genus(), 0u) << "the shared corner counts for both";
}

TEST(Inspect, FindsATurnedTriangle) {
  Mesh mesh = icosphere(1);
  std::swap(mesh.triangles[5][0], mesh.triangles[5][1]);
  const Inspection found = inspect::inspect(mesh);
  EXPECT_EQ(found.inconsistent_edges, 3u);
  EXPECT_EQ(found.closed_components(), 1u);
  EXPECT_EQ(found.solids(), 0u);
}

TEST(Inspect, CountsDegenerateDuplicateAndOppositeTriangles) {
  Mesh mesh = cube();
  const mesh::Triangle t = mesh.triangles[3];
  mesh.triangles.push_back({t[1], t[2], t[0]});  // duplicate
  mesh.triangles.push_back({t[1], t[0], t[2]});  // opposite
  mesh.triangles.push_back({t[0], t[0], t[1]});  // degenerate
  const Inspection found = inspect::inspect(mesh);
  EXPECT_EQ(found.triangles, 15u);
  EXPECT_EQ(found.duplicate, 1u);
  EXPECT_EQ(found.opposite, 1u);
  EXPECT_EQ(found.degenerate, 1u);
}

TEST(Inspect, TakesWhatHasNoAreaAtAll) {
  const Inspection found =
      inspect::inspect(Mesh{"flat", {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}, {{0, 1, 2}, {0, 0, 1}, {1, 1, 1}}});
  EXPECT_EQ(found.degenerate, 3u);
  EXPECT_EQ(found.area, 0);
  EXPECT_EQ(inspect::inspect(Mesh{"none", {}, {}}).components.size(), 0u);
}

TEST(Inspect, AddsUp) {
  Inspection sum = inspect::inspect(cube());
  sum += inspect::inspect(icosphere(2));
  EXPECT_EQ(sum.triangles, 12u + 320u);
  EXPECT_EQ(sum.components.size(), 2u);
  EXPECT_EQ(sum.largest(1).at(0).triangles, 320u);
  EXPECT_EQ(sum.largest(9).size(), 2u);
  EXPECT_EQ(sum.low, (mesh::Float3{-1, -1, -1}));
}

// Counts from another program, with exactly equal positions welded.
TEST(Inspect, RealMeshes) {
  const auto folder = real_mesh_folder();
  if (!folder) GTEST_SKIP() << "NIF_TEST_MESHES is not set";
  struct Known {
    const char* file;
    uint64_t boundary, non_manifold, same_corners;
    uint64_t components;  ///< 0: that program connects them over vertices, too, and finds others
  };
  for (const Known& known : {
           Known{"stanford_dragon_871k.ply.gz", 0, 0, 0, 1},
           Known{"bunny_zipper_69k_open.ply", 223, 0, 0, 1},
           Known{"skull_100k.obj", 0, 0, 0, 1},
           Known{"cycloidal_43k_nonmanifold_100comp.ply", 0, 242, 0, 0},
           Known{"self_intersect_17k.obj", 0, 0, 0, 1},
           Known{"soup_100.stl", 300, 0, 0, 100},
       }) {
    if (!std::filesystem::exists(*folder / known.file)) continue;
    const Inspection found = inspect::inspect(mesh::read(*folder / known.file).meshes.at(0));
    EXPECT_EQ(found.boundary_edges, known.boundary) << known.file;
    EXPECT_EQ(found.non_manifold_edges, known.non_manifold) << known.file;
    EXPECT_EQ(found.duplicate + found.opposite, known.same_corners) << known.file;
    if (known.components != 0) {
      EXPECT_EQ(found.components.size(), known.components) << known.file;
    }
  }
}

}  // namespace
}  // namespace nif::test
