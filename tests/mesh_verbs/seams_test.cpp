// Seams with vertices on one side alone are closed, and nothing else is made to fit.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "mesh/inspect/inspect.hpp"
#include "mesh/repair/repair.hpp"
#include "mesh/repair/t_junctions.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

using inspect::Inspection;
using mesh::Float3;
using mesh::Mesh;
using repair::TJunctions;

/// The unit cube; the top has extra vertices at these positions of an edge, and the front lacks them.
Mesh cube_with(const std::vector<float>& points) {
  Mesh mesh{
      "cube", {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {0, 0, 1}, {1, 0, 1}, {0, 1, 1}, {1, 1, 1}}, {}};
  const uint32_t sides[][4] = {{0, 2, 3, 1}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  for (const auto& [a, b, c, d] : sides) mesh.triangles.insert(mesh.triangles.end(), {{a, b, c}, {a, c, d}});
  uint32_t last = 4;
  for (const float x : points) {
    const auto next = uint32_t(mesh.positions.size());
    mesh.positions.push_back({x, 0, 1});
    mesh.triangles.push_back({last, next, 6});
    last = next;
  }
  mesh.triangles.insert(mesh.triangles.end(), {{last, 5, 7}, {last, 7, 6}});
  return mesh;
}

/// Rotated about some axis and moved in single precision, as programs do.
Mesh turned(const Mesh& mesh, uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> any(-1, 1);
  std::array<float, 4> q{any(random), any(random), any(random), any(random)};
  const float length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  for (float& x : q) x /= length;
  const auto [w, x, y, z] = q;
  const float rows[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)},
                            {2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)},
                            {2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)}};
  const Float3 shift{any(random), any(random), any(random)};
  Mesh out = mesh;
  for (Float3& p : out.positions) {
    const Float3 from = p;
    for (size_t i = 0; i < 3; ++i)
      p[i] = rows[i][0] * from[0] + rows[i][1] * from[1] + rows[i][2] * from[2] + shift[i];
  }
  return out;
}

TEST(Seams, AVertexOnAnEdgeSplitsIt) {
  Mesh mesh = cube_with({0.5f});
  EXPECT_EQ(inspect::inspect(mesh).closed_components(), 0u);
  const TJunctions done = repair::close_t_junctions(mesh, 0);
  EXPECT_EQ(done.edges, 1u);
  EXPECT_EQ(done.vertices, 1u);
  const Inspection found = inspect::inspect(mesh);
  EXPECT_EQ(found.solids(), 1u);
  EXPECT_EQ(found.volume, 1);
  EXPECT_EQ(found.area, 6);
  EXPECT_EQ(mesh.triangles.size(), 14u);
}

TEST(Seams, SeveralVerticesOnAnEdge) {
  Mesh mesh = cube_with({0.125f, 0.25f, 0.75f});
  EXPECT_EQ(repair::close_t_junctions(mesh, 0).vertices, 3u);
  EXPECT_EQ(inspect::inspect(mesh).volume, 1);
  EXPECT_EQ(inspect::inspect(mesh).area, 6);
}

TEST(Seams, RoundedVerticesOnSlantedEdges) {
  for (uint32_t seed = 0; seed < 200; ++seed) {
    Mesh mesh = turned(cube_with({0.1f, 0.3f, 0.7f}), seed);
    EXPECT_EQ(repair::close_t_junctions(mesh, 0).vertices, 3u) << seed;
    const Inspection found = inspect::inspect(mesh);
    EXPECT_EQ(found.solids(), 1u) << seed;
    EXPECT_EQ(found.degenerate, 0u);
    EXPECT_NEAR(found.volume, 1, 1e-5);
  }
}

/// Each side of the seam has vertices that the other lacks, and the strips begin at different positions.
TEST(Seams, ChainsThatMissEachOther) {
  const auto strip = [](const std::vector<float>& at, float side, Mesh& mesh) {
    for (const float x : at) mesh.positions.insert(mesh.positions.end(), {{x, 0, 0}, {x, side, 0}});
    for (size_t i = 0; i + 1 < at.size(); ++i) {
      const auto a = uint32_t(mesh.positions.size() - 2 * (at.size() - i)), b = a + 1, c = a + 2, d = a + 3;
      if (side > 0)
        mesh.triangles.insert(mesh.triangles.end(), {{a, c, b}, {b, c, d}});
      else
        mesh.triangles.insert(mesh.triangles.end(), {{a, b, c}, {b, d, c}});
    }
  };
  Mesh mesh{"strips", {}, {}};
  strip({0, 2, 3, 5, 8}, 1, mesh);
  strip({1, 3, 4, 6, 7}, -1, mesh);
  const std::atomic<bool> go_on{false};
  const repair::Report report = repair::repair(mesh, {}, go_on);
  EXPECT_EQ(report.t_junctions, 6u) << "1; 2, 4, 5, 6 and 7; 3 is on both sides";
  const Inspection found = inspect::inspect(mesh);
  EXPECT_EQ(found.components.size(), 1u);
  EXPECT_EQ(found.inconsistent_edges + found.non_manifold_edges, 0u);
  EXPECT_EQ(found.area, 8 + 6);
  // The boundary: two ends each, the far sides, and 0-1 and 7-8 of the seam.
  EXPECT_EQ(found.boundary_edges, 4u + 4 + 4 + 2);
}

/// A triangle with all edges split.
TEST(Seams, AllEdgesOfATriangle) {
  Mesh mesh{"star",
            {{0, 0, 0},
             {4, 0, 0},
             {0, 4, 0},
             {2, 0, 0},
             {1, 0, 0},
             {2, 2, 0},
             {0, 2, 0},
             {4, 4, 0},
             {-1, 1, 0},
             {1, -1, 0}},
            {{0, 1, 2}, {0, 9, 4}, {4, 9, 3}, {3, 9, 1}, {1, 7, 5}, {5, 7, 2}, {2, 8, 6}, {6, 8, 0}}};
  const double area = inspect::inspect(mesh).area;
  EXPECT_EQ(repair::close_t_junctions(mesh, 0).edges, 3u);
  const Inspection found = inspect::inspect(mesh);
  EXPECT_EQ(found.boundary_edges, 6u);
  EXPECT_EQ(found.components.size(), 1u);
  EXPECT_DOUBLE_EQ(found.area, area);
}

TEST(Seams, WhatClosesNothingStays) {
  // A corner that touches the edge of another sheet; a vertex within, not on an open edge; a fin on an edge
  // that is closed.
  Mesh corner{
      "corner", {{0, 0, 0}, {2, 0, 0}, {1, 1, 0}, {1, 0, 0}, {0, -1, 0}, {2, -1, 0}}, {{0, 1, 2}, {3, 4, 5}}};
  Mesh fin = cube();
  append(fin, Mesh{"fin", {{0, -1, -1}, {0.5f, -1, -1}, {0, -3, -3}}, {{0, 1, 2}}});
  // The opposite vertex lies on the edge except for rounding: the fan would flip.
  Mesh sliver{"sliver",
              {{0, 0, 0}, {1, 0, 0}, {0.5f, 1e-9f, 0}, {0.5f, 2e-9f, 0}},
              {{0, 1, 2}, {0, 2, 3}, {2, 1, 3}}};
  for (Mesh* mesh : {&corner, &fin, &sliver}) {
    const std::vector<mesh::Triangle> before = mesh->triangles;
    EXPECT_EQ(repair::close_t_junctions(*mesh, 0).edges, 0u) << mesh->name;
    EXPECT_EQ(mesh->triangles, before);
  }
}

TEST(Seams, NoEdgeGetsThreeTriangles) {
  Mesh mesh = cube_with({0.5f});
  // The fan's new edge, from the vertex to the corner, exists already.
  mesh.positions.push_back({2, -1, 1});
  mesh.triangles.insert(mesh.triangles.end(), {{8, 0, 9}, {0, 8, 9}});
  Mesh split = mesh;
  EXPECT_EQ(repair::close_t_junctions(split, 0).edges, 0u);
  EXPECT_EQ(split.triangles, mesh.triangles);
}

TEST(Seams, TheDistanceIsThatOfWelding) {
  Mesh mesh = cube_with({0.5f});
  mesh.positions[8][2] += 0.001f;
  Mesh wide = mesh;
  EXPECT_EQ(repair::close_t_junctions(mesh, 0).edges, 0u);
  EXPECT_EQ(repair::close_t_junctions(wide, 0.002).edges, 1u);
  EXPECT_EQ(inspect::inspect(wide).solids(), 1u);
}

TEST(Seams, TinyAndHugeMeshes) {
  for (const float scale : {1e-30f, 1e-38f, 1e30f, 3e37f}) {
    Mesh mesh = cube_with({0.1f, 0.3f, 0.7f});
    for (Float3& p : mesh.positions)
      for (float& x : p) x *= scale;
    EXPECT_EQ(repair::close_t_junctions(mesh, 0).vertices, 3u) << scale;
    EXPECT_EQ(inspect::inspect(mesh).solids(), 1u) << scale;
  }
}

/// Many vertices on one edge, and many edges each of which has many vertices of all others on it.
TEST(Seams, ManyVertices) {
  std::vector<float> points(20'000);
  for (size_t i = 0; i < points.size(); ++i) points[i] = float(i + 1) / float(points.size() + 1);
  Mesh mesh = cube_with(points);
  EXPECT_EQ(repair::close_t_junctions(mesh, 0).vertices, points.size());
  EXPECT_EQ(inspect::inspect(mesh).closed_components(), 1u);

  Mesh heap{"heap", {}, {}};
  for (uint32_t i = 0; i < 20'000; ++i) {
    heap.positions.insert(heap.positions.end(),
                          {{float(i), 0, 0}, {float(i) + 50'000, 0, 0}, {float(i), 1, 0}});
    heap.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  const std::vector<mesh::Triangle> before = heap.triangles;
  EXPECT_TRUE(repair::close_t_junctions(heap, 0).gave_up);
  EXPECT_EQ(heap.triangles, before);
}

}  // namespace
}  // namespace nif::test
