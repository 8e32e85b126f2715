// Level sets of shapes whose volume is known, and the files that hold them.
#include "mesh/volume/volume.hpp"

#include <gtest/gtest.h>

#include "mesh/inspect/inspect.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

using mesh::Mesh;
using volume::Kind;

TEST(Volume, RemeshesAClosedSolid) {
  Mesh mesh = torus(64, 32);
  append(mesh, torus(64, 32), 1, {0.3f, 0, 0.1f});  // through the first
  const Mesh fine = volume::remesh(mesh, {0.02, 0}, 0);
  const auto found = inspect::inspect(fine);
  EXPECT_EQ(found.boundary_edges, 0u);
  EXPECT_EQ(found.inconsistent_edges, 0u);
  const double one = inspect::inspect(torus(64, 32)).volume;
  EXPECT_GT(found.volume, one) << "and it faces outwards";
  EXPECT_LT(found.volume, 2 * one) << "the overlap counts once";

  const Mesh coarse = volume::remesh(torus(64, 32), {0.02, 0}, 0.5);
  EXPECT_LT(coarse.triangles.size(), fine.triangles.size() / 2);
  EXPECT_NEAR(inspect::inspect(coarse).volume, one, 0.05 * one);
  EXPECT_EQ(coarse.name, "torus");
}

TEST(Volume, AnOpenMeshMayHaveAThickness) {
  const Mesh bowl = open_bowl(16, 32);
  const auto shell = inspect::inspect(volume::remesh(bowl, {0.02, 0.1}, 0));
  EXPECT_EQ(shell.boundary_edges, 0u);
  EXPECT_NEAR(shell.volume, 2 * std::numbers::pi * 0.1, 0.05) << "half a sphere, a tenth thick";
}

TEST(Volume, CavitiesAreFilled) {
  const double ball = inspect::inspect(icosphere(3)).volume;
  EXPECT_NEAR(inspect::inspect(volume::remesh(nested_spheres(3), {0.04, 0}, 0)).volume, ball, 0.02 * ball);
}

TEST(Volume, FilesAreTheSameEachTime) {
  const Mesh ball = icosphere(4);
  const volume::VolumeFile first = volume::make_vdb(ball, {0.05, 0}, Kind::level_set),
                           again = volume::make_vdb(ball, {0.05, 0}, Kind::level_set),
                           mask = volume::make_vdb(ball, {0.05, 0}, Kind::occupancy);
  EXPECT_TRUE(first.bytes == again.bytes);
  EXPECT_NEAR(double(mask.voxels), 4.0 / 3 * std::numbers::pi / std::pow(0.05, 3), 1000);
  EXPECT_NEAR(mask.size[0], 40, 1);
  EXPECT_NE(first.bytes.find("icosphere"), std::string::npos) << "the grid has the mesh's name";
}

TEST(Volume, FilesAreReadAsTheSurfacesTheyHold) {
  const TempDir folder;
  const Mesh ball = icosphere(4);
  const std::string file =
      folder.write("ball.vdb", volume::make_vdb(ball, {0.05, 0}, Kind::level_set).bytes).string();
  const volume::LevelSets found = volume::read_vdb(file);
  ASSERT_EQ(found.meshes.size(), 1u);
  EXPECT_EQ(found.meshes[0].name, "icosphere");
  EXPECT_TRUE(found.notes.empty());
  const Mesh direct = volume::remesh(ball, {0.05, 0}, 0);
  EXPECT_EQ(found.meshes[0].positions, direct.positions);
  EXPECT_EQ(found.meshes[0].triangles, direct.triangles);

  const std::string mask =
      folder.write("mask.vdb", volume::make_vdb(ball, {0.05, 0}, Kind::occupancy).bytes).string();
  const volume::LevelSets none = volume::read_vdb(mask);
  EXPECT_TRUE(none.meshes.empty());
  ASSERT_EQ(none.notes.size(), 1u);
  EXPECT_NE(none.notes[0].find("grid 'icosphere', which is not a level set"), std::string::npos);
}

}  // namespace
}  // namespace nif::test
