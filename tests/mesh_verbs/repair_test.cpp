// Meshes with one fault each come out without it, and the report says what was done.
#include "mesh/repair/repair.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "mesh/inspect/inspect.hpp"
#include "mesh/repair/snap.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

using inspect::Inspection;
using mesh::Mesh;
using repair::Report;

class Repair : public testing::Test {
 protected:
  static Report repair(Mesh& mesh, const repair::Options& options = {}) {
    const std::atomic<bool> go_on{false};
    return repair::repair(mesh, options, go_on);
  }
};

TEST_F(Repair, LeavesASoundMeshAsItIs) {
  for (const Mesh& sound : {torus(16, 8), nested_spheres(2), open_bowl(4, 8)}) {
    Mesh mesh = sound;
    const Report report = repair(mesh);
    EXPECT_EQ(mesh.positions, sound.positions) << sound.name;
    EXPECT_EQ(mesh.triangles, sound.triangles) << sound.name;
    EXPECT_EQ(report.welded + report.degenerate + report.duplicate + report.opposite + report.turned +
                  report.split_vertices + report.stitched_edges + report.turned_solids,
              0u)
        << sound.name;
  }
}

TEST_F(Repair, TurnsWhatFacesTheWrongWay) {
  Mesh mesh;
  append(mesh, icosphere(2), 1, {0, 0, 0}, true);
  const Report inside_out = repair(mesh);
  EXPECT_EQ(inside_out.turned_solids, 1u);
  EXPECT_GT(signed_volume(mesh), 0);

  mesh = icosphere(2);
  for (size_t t = 0; t < 10; ++t) std::swap(mesh.triangles[7 * t][0], mesh.triangles[7 * t][1]);
  const Report mixed = repair(mesh);
  EXPECT_EQ(mixed.turned, 10u);
  EXPECT_EQ(open_edges(mesh), 0u);
  EXPECT_GT(signed_volume(mesh), 0);
}

TEST_F(Repair, AWallOfACavityFacesInwardsAsItDid) {
  Mesh mesh = nested_spheres(2);
  const double volume = signed_volume(mesh);
  repair(mesh);
  EXPECT_EQ(signed_volume(mesh), volume);
}

/// Only the fans around the edge's ends say which of four triangles at an edge belong together.
TEST_F(Repair, BoxesThatTouchAtAnEdgeStayClosed) {
  Mesh boxes = cube();
  append(boxes, cube(), 1, {2, 2, 0});
  EXPECT_EQ(inspect::inspect(boxes).non_manifold_edges, 1u);
  const Report report = repair(boxes);
  EXPECT_EQ(report.split_vertices, 2u);
  EXPECT_EQ(inspect::inspect(boxes, false).solids(), 2u);
}

/// Two fins at one edge of a box are detached and become one sheet.
TEST_F(Repair, StitchesWhatIsLeftOfAnEdge) {
  Mesh fins = cube();
  fins.positions.insert(fins.positions.end(), {{0, -3, -1}, {0, -1, -3}});
  fins.triangles.insert(fins.triangles.end(), {{0, 1, 8}, {1, 0, 9}});
  const Report report = repair(fins);
  EXPECT_EQ(report.stitched_edges, 1u);
  const Inspection found = inspect::inspect(fins, false);
  EXPECT_EQ(found.components.size(), 2u);
  EXPECT_EQ(found.boundary_edges, 4u);
  EXPECT_EQ(found.solids(), 1u);
}

TEST_F(Repair, CutsASurfaceThatHasOneSide) {
  Mesh strip{"Moebius strip", {}, {}};
  constexpr uint32_t kParts = 12;
  for (uint32_t i = 0; i < kParts; ++i) {
    const double turn = 2 * std::numbers::pi * i / kParts;
    for (const double across : {-0.3, 0.3}) {
      const double radius = 1 + across * std::cos(turn / 2);
      strip.positions.push_back({float(radius * std::cos(turn)), float(radius * std::sin(turn)),
                                 float(across * std::sin(turn / 2))});
    }
    uint32_t a = 2 * i, b = a + 1, c = a + 2, d = a + 3;
    if (i + 1 == kParts) c = 1, d = 0;
    strip.triangles.insert(strip.triangles.end(), {{a, c, b}, {b, c, d}});
  }
  EXPECT_EQ(inspect::inspect(strip).inconsistent_edges, 1u);
  const Report report = repair(strip);
  EXPECT_EQ(report.split_vertices, 2u);
  const Inspection found = inspect::inspect(strip, false);
  EXPECT_EQ(found.inconsistent_edges, 0u);
  EXPECT_EQ(found.boundary_edges, 2 * kParts + 2u);
}

TEST_F(Repair, WeldsWhatIsNear) {
  Mesh soup{"soup", {}, {}};
  const Mesh ball = icosphere(2);
  for (const mesh::Triangle& t : ball.triangles) {
    for (const uint32_t v : t) {
      mesh::Float3 p = ball.positions[v];
      p[0] += 1e-6f * float(soup.positions.size() % 3);
      soup.positions.push_back(p);
    }
    const auto n = uint32_t(soup.positions.size());
    soup.triangles.push_back({n - 3, n - 2, n - 1});
  }
  Mesh untouched = soup;
  repair(untouched);
  EXPECT_GT(inspect::inspect(untouched).boundary_edges, 0u);
  const Report report = repair(soup, {.weld = 1e-4});
  EXPECT_EQ(soup.positions.size(), ball.positions.size());
  EXPECT_EQ(report.welded, 3 * ball.triangles.size() - ball.positions.size());
  EXPECT_EQ(inspect::inspect(soup).boundary_edges, 0u);
}

/// If floats are farther apart than the distance, cell numbers exceed an integer's range.
TEST_F(Repair, WeldsFarFromTheOrigin) {
  for (const float far : {1e15f, -1e30f}) {
    std::vector<mesh::Float3> points;
    float x = far;
    for (uint32_t i = 0; i < 20000; ++i) {
      points.push_back({x, far, 0});
      x = std::nextafter(x, 0.0f);
    }
    const std::vector<mesh::Float3> before = points;
    EXPECT_EQ(repair::snap_vertices(points, 1e-3), 0u);
    EXPECT_EQ(points, before);
  }
  std::vector<mesh::Float3> near{{1e6f, 0, 0}, {1e6f, 5e-7f, 0}, {1e30f, 0, 0}, {1e30f, 5e-7f, 0}};
  EXPECT_EQ(repair::snap_vertices(near, 1e-6), 2u);
}

TEST_F(Repair, FillsHolesUpToTheirLimit) {
  if (!cgal::available()) GTEST_SKIP() << "built without CGAL";
  Mesh holed = icosphere(2);
  holed.triangles.erase(holed.triangles.begin(), holed.triangles.begin() + 1);
  Mesh bowl = open_bowl(6, 24);
  append(bowl, holed, 1, {5, 0, 0});
  Mesh small = bowl;
  const Report some = repair(small, {.hole_edges = 23});
  EXPECT_EQ(some.holes.filled, 1u);
  EXPECT_EQ(inspect::inspect(small).boundary_edges, 24u);
  Mesh large = bowl;
  const Report all = repair(large, {.hole_edges = 24});
  EXPECT_EQ(all.holes.filled, 2u);
  EXPECT_EQ(inspect::inspect(large).boundary_edges, 0u);
  EXPECT_EQ(inspect::inspect(large).solids(), 2u);
  EXPECT_EQ(large.triangles.size(), bowl.triangles.size() + all.holes.triangles);
}

TEST_F(Repair, ASheetIsNoHole) {
  if (!cgal::available()) GTEST_SKIP() << "built without CGAL";
  Mesh sheet{"sheet", {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 2, 3}}};
  const Report report = repair(sheet, {.hole_edges = 100});
  EXPECT_EQ(report.holes.filled, 0u);
  EXPECT_EQ(sheet.triangles.size(), 2u);
}

TEST_F(Repair, TakesApartWhatIsNotManifold) {
  Mesh fin = cube();
  fin.positions.push_back({0, 3, 0});
  fin.triangles.push_back({fin.triangles[0][0], fin.triangles[0][1], 8});
  const Report report = repair(fin, {.hole_edges = uint64_t(cgal::available() ? 100 : 0)});
  EXPECT_GT(report.split_vertices, 0u);
  EXPECT_EQ(report.holes.filled, 0u) << "a cut is no hole";
  const Inspection found = inspect::inspect(fin, false);
  EXPECT_EQ(found.non_manifold_edges + found.non_manifold_vertices, 0u);
  EXPECT_EQ(found.triangles, 13u);

  Mesh tips = cube();
  append(tips, cube(), 1, {2, 2, 2});
  EXPECT_EQ(repair(tips).split_vertices, 1u);
  EXPECT_EQ(inspect::inspect(tips, false).non_manifold_vertices, 0u);
}

TEST_F(Repair, DropsDuplicatesAndOpposites) {
  Mesh mesh = cube();
  const mesh::Triangle t = mesh.triangles[3];
  mesh.triangles.insert(mesh.triangles.end(), {{t[1], t[2], t[0]}, {t[1], t[0], t[2]}, {t[0], t[0], t[1]}});
  const Report report = repair(mesh);
  EXPECT_EQ(report.duplicate, 1u);
  EXPECT_EQ(report.opposite, 1u);
  EXPECT_EQ(report.degenerate, 1u);
  EXPECT_EQ(mesh.triangles, cube().triangles);
}

}  // namespace
}  // namespace nif::test
