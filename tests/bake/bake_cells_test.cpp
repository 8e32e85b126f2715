// Planes enclose the triangles in their cells, walls are found where surfaces have no holes, and words are as
// stored in files.
#include "bake/planes/fit_cells.hpp"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "bake/planes/thinnest.hpp"
#include "formats/base/random.hpp"
#include "formats/base/status.hpp"
#include "formats/nif/writer.hpp"
#include "kernels/reference/planes/grid_traversal.hpp"
#include "tests/support/occupied_object.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

Double3 vector_of(uint32_t word) {
  const kernels::CellNormal n = kernels::cell_normal(word);
  return {double(n.x), double(n.y), double(n.z)};
}

/// Meshes of each kind: closed, open, intersecting each other, small compared to a voxel.
mesh::Mesh mixed_mesh() {
  mesh::Mesh mesh = torus(40, 20);
  append(mesh, open_bowl(6, 12), 0.7f, {1.1f, 0.2f, 0.1f});
  append(mesh, cube(), 0.02f, {-1, 0.3f, 0.9f});
  mesh.triangles.push_back({0, 400, uint32_t(mesh.positions.size() - 1)});
  mesh.name = "mixed";
  return mesh;
}

class FitCells : public testing::TestWithParam<uint32_t> {};

TEST_P(FitCells, PlanesEncloseAllNearTriangles) {
  const uint32_t levels = GetParam();
  const OccupiedObject o(mixed_mesh(), 40, {.levels = levels});
  const auto& surface = o.prepared.surface;
  nif::Random random(1, 2, 3);
  const double near = 0.999 * kernels::kSurfacePadding;
  for (const mesh::Triangle& t : surface.triangles) {
    Double3 corners[3];
    for (size_t c = 0; c < 3; ++c) corners[c] = o.occupancy.grid.to_cells(surface.positions[t[c]]);
    for (int i = 0; i < 30; ++i) {
      double u = random.uniform(), v = random.uniform();
      if (u + v > 1) u = 1 - u, v = 1 - v;
      const Double3 p = corners[0] + (corners[1] - corners[0]) * u + (corners[2] - corners[0]) * v;
      for (uint32_t side = 0; side < 8; ++side) {
        int32_t cell[3];
        for (size_t a = 0; a < 3; ++a) {
          const int32_t last = int32_t(o.field.voxels[a] << levels) - 1;
          cell[a] = std::clamp(int32_t(std::floor(p[a] + (side >> a & 1 ? near : -near))), 0, last);
        }
        const kernels::Cube cube = kernels::find_cube(o.field, cell);
        ASSERT_NE(kernels::word_kind(cube.word), kernels::kEmptyVoxel);
        Double3 from_middle;
        for (size_t a = 0; a < 3; ++a) from_middle[a] = p[a] - cube.low[a] - 0.5 * cube.size;
        const double height = dot(vector_of(cube.word), from_middle);
        const auto plane = [&](uint32_t place) { return kernels::plane_height(place, float(cube.size)); };
        const uint32_t lower = kernels::lower_offset(cube.word), upper = kernels::upper_offset(cube.word);
        // No point is as high as the last place or as low as the first, so the margin there may be smaller.
        ASSERT_LE(height + (upper == kernels::kPlaneOffsets ? 0 : kernels::kHeightMargin), plane(upper));
        ASSERT_GE(height - (lower == 0 ? 0 : kernels::kHeightMargin), plane(lower));
      }
    }
  }
}

TEST_P(FitCells, MakesTheWordsOfFiles) {
  const OccupiedObject o(mixed_mesh(), 40, {.levels = GetParam()});
  EXPECT_EQ(o.object.planes->children.empty(), GetParam() == 0);
  EXPECT_EQ(o.cells.children, o.object.planes->children.size());
  format::Asset asset;
  format::Object& object = asset.objects.emplace_back();
  object.name = "mixed";
  object.aabb_min = o.prepared.box.min;
  object.aabb_max = o.prepared.box.max;
  object.bias = o.prepared.bias;
  object.triangle_count = uint32_t(o.prepared.surface.triangles.size());
  object.planes = o.object.planes;
  object.network = o.object.network;
  const uint32_t inputs =
      kernels::input_count(o.object.network->samples, o.object.network->features_per_corner);
  asset.mlps = {{{{inputs, 1, 0, std::vector<int32_t>(1), std::vector<int8_t>(inputs)}}, 1}};
  EXPECT_NO_THROW(format::encode(asset));  // also reads what it wrote
}

INSTANTIATE_TEST_SUITE_P(Levels, FitCells, testing::Values(0u, 2u, 4u));

TEST(FitCells, IsTheSameForAnyNumberOfThreads) {
  const auto words = [](size_t threads) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    const OccupiedObject o(mixed_mesh(), 40, {.levels = 2});
    return std::pair(o.object.planes->voxel_records, o.object.planes->children);
  };
  EXPECT_EQ(words(1), words(4));
}

TEST(FitCells, FindsWallsInWholeSurfacesOnly) {
  const OccupiedObject ball(icosphere(4), 40, {.levels = 2});
  EXPECT_GT(double(ball.cells.walls), 0.97 * double(ball.cells.planes));
  EXPECT_EQ(ball.cells.bare, 0u);

  // No two triangles are connected, and each has an edge within every cell that it touches.
  mesh::Mesh crumbs{"crumbs", {}, {}};
  nif::Random random(1, 2, 4);
  for (uint32_t i = 0; i < 200; ++i) {
    const Double3 at{random.uniform(), random.uniform(), random.uniform()};
    for (int corner = 0; corner < 3; ++corner) {
      const Double3 p = at + random.direction() * 1e-3;
      crumbs.positions.push_back({float(p[0]), float(p[1]), float(p[2])});
    }
    crumbs.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  EXPECT_EQ(OccupiedObject(crumbs, 40, {.levels = 2}).cells.walls, 0u);
}

TEST(FitCells, FindsNoWallsWhereTrianglesHaveHoles) {
  OccupiedObject ball(icosphere(3), 20, {.levels = 2});
  mesh::CleanMesh& mesh = ball.prepared.surface;
  const bake::Grid& grid = ball.occupancy.grid;
  const bake::SurfaceVoxels surface = bake::voxelize(grid, mesh);
  mesh.holes.resize(mesh.triangles.size());
  // With holes above a height.
  const auto fit = [&](float height) {
    for (size_t t = 0; t < mesh.triangles.size(); ++t)
      mesh.holes[t].map = mesh.positions[mesh.triangles[t][0]][2] > height ? 0 : mesh::TriangleHoles::kNoMap;
    return bake::fit_cells(grid, mesh, surface, 0.1, "ball", *ball.object.planes);
  };
  const bake::CellCounts solid = fit(2), half = fit(0), none = fit(-2);
  EXPECT_GT(double(half.walls), 0.4 * double(solid.walls));
  EXPECT_LT(double(half.walls), 0.6 * double(solid.walls));
  EXPECT_GT(solid.walls, 0u);
  EXPECT_EQ(none.walls, 0u);
}

TEST(FitCells, TreatsADoubleSheetAsOne) {
  mesh::Mesh mesh = open_bowl(12, 24);
  const OccupiedObject single(mesh, 40, {.levels = 2});
  const auto once = mesh.triangles;
  for (const mesh::Triangle& t : once) mesh.triangles.push_back({t[0], t[2], t[1]});
  const OccupiedObject twice(mesh, 40, {.levels = 2});
  const auto share = [](const OccupiedObject& o) { return double(o.cells.walls) / double(o.cells.planes); };
  EXPECT_GT(share(single), 0.5);
  EXPECT_NEAR(share(twice), share(single), 0.01);
}

TEST(FitCells, CountsTheEdgesOfSlivers) {
  // A cube with an extra vertex on an edge, with and without the zero-area triangle that closes the gap.
  mesh::Mesh mesh = cube();
  const auto middle = uint32_t(mesh.positions.size());
  const mesh::Triangle t = mesh.triangles[0];
  mesh.positions.push_back({});
  for (size_t a = 0; a < 3; ++a)
    mesh.positions[middle][a] = (mesh.positions[t[0]][a] + mesh.positions[t[1]][a]) / 2;
  mesh.triangles[0] = {t[0], middle, t[2]};
  mesh.triangles.push_back({middle, t[1], t[2]});
  const OccupiedObject cracked(mesh, 20, {.levels = 2});
  mesh.triangles.push_back({t[0], t[1], middle});
  const OccupiedObject closed(mesh, 20, {.levels = 2}), whole(cube(), 20, {.levels = 2});
  EXPECT_EQ(closed.cells.walls, whole.cells.walls);
  EXPECT_LT(cracked.cells.walls, whole.cells.walls);
}

TEST(FitCells, CutsLessIfThereAreTooManyChildren) {
  OccupiedObject o(icosphere(3), 10, {.levels = 2});
  const bake::Grid& grid = o.occupancy.grid;
  const bake::SurfaceVoxels surface = bake::voxelize(grid, o.prepared.surface);
  const auto fit = [&](double thickness, size_t most) {
    bake::fit_cells(grid, o.prepared.surface, surface, thickness, "ball", *o.object.planes, most);
    return o.object.planes->children;
  };
  const auto fine = fit(0.05, kernels::kMaxChildren), coarse = fit(0.1, kernels::kMaxChildren);
  ASSERT_GT(fine.size(), coarse.size());
  EXPECT_EQ(fit(0.05, fine.size()), fine);
  EXPECT_EQ(fit(0.05, fine.size() - 1), coarse);
  EXPECT_TRUE(fit(0.05, 0).empty());
}

TEST(FitCells, StopsWherePlanesJoinOutsideWithInside) {
  OccupiedObject o(icosphere(4), 40, {.levels = 2});
  const std::vector<uint32_t> records = o.object.planes->voxel_records;
  bake::set_sides("icosphere", *o.object.planes);
  EXPECT_EQ(o.object.planes->voxel_records, records) << "it was right";
  narrow_planes(*o.object.planes);
  try {
    bake::set_sides("icosphere", *o.object.planes);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.status(), Status::internal);
    EXPECT_NE(std::string(error.what()).find("icosphere"), std::string::npos) << error.what();
  }
}

TEST(ThinnestSlab, IsHardlyThickerThanTheBest) {
  nif::Random random(1, 2, 5);
  bake::ThinnestSlab thinnest;
  double excess = 0;
  constexpr int kTries = 200;
  for (int i = 0; i < kTries; ++i) {
    // A fan around a point of a bent sheet with a random orientation.
    const Double3 n = random.direction(), u = cross(n, random.direction()), v = cross(n, u);
    const double bend = random.uniform(-0.1, 0.1), twist = random.uniform(-0.1, 0.1);
    std::vector<Double3> ring;
    for (int k = 0; k <= 12; ++k) {
      const double x = 2 * std::cos(k * std::numbers::pi / 6), y = 2 * std::sin(k * std::numbers::pi / 6);
      ring.push_back(u * x + v * y + n * (bend * x * x + twist * x * y));
    }
    thinnest.clear();
    for (size_t k = 1; k < ring.size(); ++k) {
      const Double3 corners[3] = {{}, ring[k - 1], ring[k]};
      thinnest.add(corners, cross(corners[1], corners[2]));
    }
    const bake::Slab slab = thinnest.find();
    const auto thickness = [](uint32_t normal, double lowest, double highest) {
      return (highest - lowest + 2 * kernels::kHeightMargin) / length(vector_of(normal));
    };
    double best = 1e300, lowest = 0, highest = 0;
    const auto extend = [&](uint32_t normal) {
      lowest = highest = 0;  // the fan's middle
      for (const Double3& p : ring) {
        lowest = std::min(lowest, dot(vector_of(normal), p));
        highest = std::max(highest, dot(vector_of(normal), p));
      }
      return thickness(normal, lowest, highest);
    };
    for (uint32_t a = 0; a <= uint32_t(kernels::kNormalSum); ++a)
      for (uint32_t b = 0; b <= uint32_t(kernels::kNormalSum); ++b)
        best = std::min(best, extend(a << 4 | b << 10));
    const double found = extend(slab.normal);
    EXPECT_DOUBLE_EQ(slab.lowest, lowest);
    EXPECT_DOUBLE_EQ(slab.highest, highest);
    ASSERT_GE(found, best);
    excess += found / best - 1;
  }
  EXPECT_LT(excess / kTries, 0.02);
}

}  // namespace
}  // namespace nif::test
