// Voxels are marked wherever there is a triangle, and called inside or outside only if they are.
#include "bake/planes/occupancy.hpp"

#include <gtest/gtest.h>

#include <bit>

#include "formats/base/random.hpp"
#include "kernels/reference/network/samples.hpp"
#include "tests/support/occupied_object.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

using kernels::VoxelState;

VoxelState state_at(const OccupiedObject& o, const std::array<float, 3>& point) {
  const auto g = o.occupancy.grid.to_grid(point);
  return static_cast<VoxelState>(o.occupancy.states[o.occupancy.grid.index(
      uint32_t(std::floor(g[0])), uint32_t(std::floor(g[1])), uint32_t(std::floor(g[2])))]);
}

TEST(Voxelize, MarksTheVoxelOfEveryPointOfEveryTriangle) {
  mesh::Mesh mesh = torus(40, 20);
  append(mesh, cube(), 0.3f, {0.1f, 0.2f, 2.0f});
  mesh.triangles.push_back({0, 400, uint32_t(mesh.positions.size() - 1)});  // spans much of the grid
  const OccupiedObject o(mesh, 61);
  nif::Random random(1, 2, 3);
  for (const mesh::Triangle& t : o.prepared.surface.triangles) {
    const auto& p = o.prepared.surface.positions;
    for (int i = 0; i < 50; ++i) {
      double u = random.uniform(), v = random.uniform();
      if (u + v > 1) u = 1 - u, v = 1 - v;
      std::array<float, 3> point;
      for (int a = 0; a < 3; ++a) {
        point[a] =
            float(p[t[0]][a] + u * (double(p[t[1]][a]) - p[t[0]][a]) + v * (double(p[t[2]][a]) - p[t[0]][a]));
      }
      ASSERT_EQ(state_at(o, point), VoxelState::surface);
    }
  }
}

TEST(Voxelize, MarksNoVoxelFarFromTheSurface) {
  const OccupiedObject o(icosphere(4), 50);
  const bake::Grid& grid = o.occupancy.grid;
  for (uint32_t z = 0; z < grid.voxels[2]; ++z) {
    for (uint32_t y = 0; y < grid.voxels[1]; ++y) {
      for (uint32_t x = 0; x < grid.voxels[0]; ++x) {
        if (o.occupancy.states[grid.index(x, y, z)] != uint8_t(VoxelState::surface)) continue;
        const Double3 centre =
            to_double(grid.origin) + Double3{x + 0.5, y + 0.5, z + 0.5} * (1.0 / grid.voxels_per_unit);
        // Half a voxel's diagonal, the padding, and the sphere's own facets.
        ASSERT_NEAR(length(centre), 1.0, (0.87 + 0.03) / grid.voxels_per_unit + 0.005);
      }
    }
  }
}

TEST(Classify, ASphereHasAnInside) {
  const OccupiedObject o(icosphere(3), 40);
  EXPECT_EQ(o.prepared.closed.count(), 1u);
  EXPECT_EQ(state_at(o, {0, 0, 0}), VoxelState::inside);
  EXPECT_EQ(state_at(o, {0.97f, 0.97f, 0.97f}), VoxelState::outside);
  EXPECT_EQ(o.occupancy.unknown_voxels, 0u);
}

TEST(Classify, ATorusHasAHoleThatIsOutside) {
  const OccupiedObject o(torus(60, 30), 60);
  EXPECT_EQ(state_at(o, {0, 0, 0}), VoxelState::outside);
  EXPECT_EQ(state_at(o, {1, 0, 0}), VoxelState::inside);
}

TEST(Classify, AnInsideOutSphereHasAnInsideToo) {
  mesh::Mesh mesh{"flipped", {}, {}};
  append(mesh, icosphere(3), 1, {0, 0, 0}, true);
  EXPECT_EQ(state_at(OccupiedObject(mesh, 40), {0, 0, 0}), VoxelState::inside);
}

TEST(Classify, AnOpenBowlHasNoInside) {
  const OccupiedObject o(open_bowl(20, 40), 40);
  EXPECT_EQ(o.prepared.closed.count(), 0u);
  EXPECT_EQ(o.occupancy.inside_voxels, 0u);
}

TEST(Classify, ASphereWithOneTriangleMissingHasNoInside) {
  mesh::Mesh mesh = icosphere(3);
  mesh.triangles.pop_back();
  EXPECT_EQ(OccupiedObject(mesh, 8).occupancy.inside_voxels,
            0u);  // coarse enough for the voxels to close the hole
}

TEST(Classify, ASphereHasAnInsideWhicheverWayItsTrianglesFace) {
  mesh::Mesh mesh = icosphere(3);
  append(mesh, torus(24, 12), 1, {4, 0, 0});
  const OccupiedObject whole(mesh, 60);
  EXPECT_EQ(whole.prepared.closed.turned, 0u);
  for (size_t t = 0; t < mesh.triangles.size(); t += 3) std::swap(mesh.triangles[t][0], mesh.triangles[t][1]);
  const OccupiedObject mixed(mesh, 60);
  EXPECT_EQ(mixed.prepared.closed.count(), 2u);
  EXPECT_EQ(mixed.prepared.closed.turned, (mesh.triangles.size() + 2) / 3);  // the minority
  EXPECT_EQ(mixed.occupancy.states, whole.occupancy.states);
}

TEST(Classify, TurnsNothingIfThatClosesNothing) {
  mesh::Mesh bowl = open_bowl(10, 20);
  std::swap(bowl.triangles[7][0], bowl.triangles[7][1]);
  EXPECT_EQ(OccupiedObject(bowl, 40).prepared.closed.turned, 0u);
}

TEST(Classify, ASurfaceOfOneSideHasNoInside) {
  // A Klein bottle, figure-8 immersion: closed, with two triangles at every edge, but no way to orient it.
  constexpr uint32_t kAround = 40, kAcross = 20;
  mesh::Mesh mesh{"klein", {}, {}};
  for (uint32_t i = 0; i < kAround; ++i)
    for (uint32_t j = 0; j < kAcross; ++j) {
      const double u = 2 * std::numbers::pi * i / kAround, v = 2 * std::numbers::pi * (j + 0.5) / kAcross;
      const double a = std::cos(u / 2) * std::sin(v) - std::sin(u / 2) * std::sin(2 * v);
      const double b = std::sin(u / 2) * std::sin(v) + std::cos(u / 2) * std::sin(2 * v);
      mesh.positions.push_back({float((3 + a) * std::cos(u)), float((3 + a) * std::sin(u)), float(b)});
    }
  // After one turn around, v has changed its sign.
  const auto at = [&](uint32_t i, uint32_t j) {
    j %= kAcross;
    return i < kAround ? i * kAcross + j : (kAcross - 1 - j) % kAcross;
  };
  for (uint32_t i = 0; i < kAround; ++i)
    for (uint32_t j = 0; j < kAcross; ++j) {
      mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i, j + 1)});
      mesh.triangles.push_back({at(i, j + 1), at(i + 1, j), at(i + 1, j + 1)});
    }
  const OccupiedObject o(mesh, 80);
  EXPECT_EQ(o.prepared.closed.count(), 0u);
  EXPECT_EQ(o.prepared.closed.open_components, 1u);
  EXPECT_EQ(o.occupancy.inside_voxels, 0u);
}

TEST(Classify, ASliverKeepsTheSurfaceClosed) {
  // A cube with an extra vertex on an edge of one side; a triangle without area closes the gap.
  mesh::Mesh mesh = cube();
  const auto middle = uint32_t(mesh.positions.size());
  const mesh::Triangle t = mesh.triangles[0];
  mesh.positions.push_back({});
  for (int a = 0; a < 3; ++a)
    mesh.positions[middle][a] = (mesh.positions[t[0]][a] + mesh.positions[t[1]][a]) / 2;
  mesh.triangles[0] = {t[0], middle, t[2]};
  mesh.triangles.push_back({middle, t[1], t[2]});
  mesh.triangles.push_back({t[0], t[1], middle});
  const OccupiedObject o(mesh, 20);
  EXPECT_EQ(o.prepared.surface.slivers.size(), 1u);
  EXPECT_EQ(state_at(o, {0, 0, 0}), VoxelState::inside);
}

TEST(Classify, AHollowBallIsSolidBetweenItsSpheres) {
  // Both spheres enclose the hollow, so its voxels are inside; only the shell between them is proven outside.
  mesh::Mesh mesh = icosphere(3);
  append(mesh, icosphere(3), 0.5f, {0, 0, 0}, true);
  const OccupiedObject o(mesh, 60);
  EXPECT_EQ(o.prepared.closed.count(), 2u);
  EXPECT_EQ(state_at(o, {0.75f, 0, 0}), VoxelState::inside);
}

TEST(Classify, ClosedPartsBesideOpenOnesKeepTheirInside) {
  mesh::Mesh mesh = icosphere(2);
  append(mesh, open_bowl(10, 20), 1, {3, 0, 0});
  const OccupiedObject o(mesh, 64);
  EXPECT_EQ(o.prepared.closed.count(), 1u);
  EXPECT_GE(o.prepared.closed.open_components, 1u);
  EXPECT_EQ(state_at(o, {0, 0, 0}), VoxelState::inside);
}

TEST(StoreOccupancy, KeepsEveryVoxelAndGivesEverySurfaceVoxelItsCorners) {
  mesh::Mesh mesh = torus(40, 20);
  append(mesh, open_bowl(10, 20), 1, {0, 0, 1});
  const OccupiedObject o(mesh, 45);
  const bake::Grid& grid = o.occupancy.grid;
  std::vector<bool> used(o.object.network->corners, false);
  for (uint32_t z = 0; z < grid.voxels[2]; ++z) {
    for (uint32_t y = 0; y < grid.voxels[1]; ++y) {
      for (uint32_t x = 0; x < grid.voxels[0]; ++x) {
        const int32_t voxel[3] = {int32_t(x), int32_t(y), int32_t(z)};
        const auto state = static_cast<VoxelState>(o.occupancy.states[grid.index(x, y, z)]);
        ASSERT_EQ(kernels::voxel_state(o.field, voxel), state);
        if (state != VoxelState::surface) continue;
        for (uint32_t c = 0; c < 8; ++c) {
          const uint32_t corner =
              kernels::corner_index(o.field, x + (c & 1), y + ((c >> 1) & 1), z + (c >> 2));
          ASSERT_LT(corner, o.object.network->corners);
          used[corner] = true;
        }
      }
    }
  }
  EXPECT_EQ(std::count(used.begin(), used.end(), false), 0);
}

TEST(MakeGrid, KeepsClearOfItsBorderWhereverTheObjectLies) {
  for (const float offset : {0.0f, 1000.0f, -3e5f}) {
    for (const float scale : {1e-3f, 1.0f, 700.0f}) {
      mesh::Mesh mesh{"moved", {}, {}};
      append(mesh, icosphere(2), scale, {offset, -offset, 0});
      const mesh::Box box = mesh::bounds(mesh.positions, mesh.triangles);
      if (!(box.longest_side() > 0)) continue;  // rounded to a point
      const bake::Grid grid = bake::make_grid(box, 96);
      for (int a = 0; a < 3; ++a) {
        ASSERT_LE(grid.voxels[a], 96u);
        ASSERT_GE(grid.to_grid(box.min)[a], kernels::kSurfacePadding);
        ASSERT_LE(grid.to_grid(box.max)[a], grid.voxels[a] - kernels::kSurfacePadding);
      }
    }
  }
}

}  // namespace
}  // namespace nif::test
