// What is written in one format and converted to another is the same geometry, bit by bit, under the same
// names where both have names; what a format cannot keep is said.
#include "formats/mesh/write.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <limits>

#include "formats/mesh/flat_scene.hpp"
#include "formats/mesh/read.hpp"
#include "tests/support/real_meshes.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

using mesh::Float3;
using mesh::Scene;

const std::atomic<bool> kGoOn{false};

mesh::Written write(const std::filesystem::path& file, const Scene& scene,
                    const mesh::WriteOptions& options = {}) {
  return mesh::write(
      file.string(), scene, options, [](double) {}, kGoOn);
}

/// Two objects with difficult names, and coordinates that are hard to write as text.
Scene ball_and_ring() {
  Scene scene;
  scene.meshes = {icosphere(1), torus(12, 8)};
  scene.meshes[0].name = "ball \"1\" \xc3\xa9";
  scene.meshes[1].name = "ring, of 2 parts";
  scene.meshes[0].positions[0] = {0.1f, -3.4028235e38f, 1e-45f};
  scene.meshes[0].positions[1] = {-0.0f, 16777217.f, 1.17549435e-38f};
  scene.meshes[0].positions[2] = {1.0f / 3, -2e-9f, 123456.79f};
  for (uint32_t m = 0; m < 2; ++m) scene.instances.push_back({scene.meshes[m].name, m, mesh::kIdentity});
  return scene;
}

/// The bits of all corner positions in order, which every format keeps.
std::vector<uint32_t> corners_of(const Scene& scene) {
  const mesh::Mesh all = mesh::flatten(scene, "");
  std::vector<uint32_t> bits;
  for (const mesh::Triangle& t : all.triangles)
    for (const uint32_t v : t)
      for (const float x : all.positions[v]) bits.push_back(std::bit_cast<uint32_t>(x));
  return bits;
}

std::vector<std::string> names_of(const Scene& scene) {
  std::vector<std::string> names;
  for (const mesh::Instance& instance : scene.instances) names.push_back(instance.name);
  return names;
}

struct Lossless {
  const char* name;
  const char* ending;
  mesh::WriteOptions options;
  bool objects;  ///< keeps them, and their names
  bool indices;  ///< keeps which vertices triangles share
};
const std::vector<Lossless> kLossless{
    {"obj", ".obj", {}, true, true},
    {"ply", ".ply", {}, false, true},
    {"stl", ".stl", {}, false, false},
    {"text stl", ".stl", {.text = true, .draco = false, .draco_bits = {}}, true, false},
    {"off", ".off", {}, false, true},
    {"glb", ".glb", {}, true, true},
    {"exact drc", ".drc", {.text = false, .draco = false, .draco_bits = 0}, false, true},
    {"exact Draco glb", ".glb", {.text = false, .draco = true, .draco_bits = 0}, true, true}};

void expect_round_trips(const Scene& scene) {
  const std::vector<uint32_t> corners = corners_of(scene);
  const uint64_t vertices = mesh::FlatScene(scene).vertex_count();
  const TempDir folder;
  for (const Lossless& first : kLossless)
    for (const Lossless& second : kLossless) {
      SCOPED_TRACE(std::string(first.name) + " to " + second.name);
      const auto a = folder.path() / (std::string("a") + first.ending),
                 b = folder.path() / (std::string("b") + second.ending);
      write(a, scene, first.options);
      write(b, mesh::read(a), second.options);
      const Scene back = mesh::read(b);
      EXPECT_TRUE(corners_of(back) == corners);
      if (first.indices && second.indices) {
        EXPECT_EQ(mesh::FlatScene(back).vertex_count(), vertices);
      }
      if (first.objects && second.objects) {
        EXPECT_EQ(names_of(back), names_of(scene));
      }
    }
}

TEST(Write, EveryPairOfLosslessFormatsKeepsGeometryAndNames) { expect_round_trips(ball_and_ring()); }

TEST(Write, RealMeshesToo) {
  const auto folder = real_mesh_folder();
  if (!folder) GTEST_SKIP() << "NIF_TEST_MESHES is not set";
  for (const char* name : {"openscad_nonmanifold_1k.obj", "soup_100.stl"})
    if (std::filesystem::exists(*folder / name)) expect_round_trips(mesh::read(*folder / name));
}

TEST(Write, DracoKeepsANameOfOneMesh) {
  Scene scene;
  scene.meshes = {cube()};
  scene.instances = {{"a cube", 0, mesh::kIdentity}};
  const TempDir folder;
  const mesh::Written written = write(folder.path() / "x.drc", scene);
  ASSERT_EQ(written.notes.size(), 1u);
  EXPECT_NE(written.notes[0].find("14 bits"), std::string::npos) << written.notes[0];
  EXPECT_EQ(written.bytes, std::filesystem::file_size(folder.path() / "x.drc"));
  EXPECT_EQ(mesh::read(folder.path() / "x.drc").instances[0].name, "a cube");
}

TEST(Write, DracoRoundsByNoMoreThanItsBits) {
  Scene scene;
  scene.meshes = {icosphere(4)};
  scene.instances = {{"ball", 0, mesh::kIdentity}};
  const TempDir folder;
  uint64_t smaller = 0;
  for (const uint32_t bits : {8u, 12u, 20u}) {
    for (const char* name : {"a.drc", "a.glb"}) {
      const auto file = folder.path() / name;
      const mesh::Written written = write(file, scene, {false, name[2] == 'g', bits});
      EXPECT_GT(written.bytes, name[2] == 'd' ? smaller : 0);
      if (name[2] == 'd') smaller = written.bytes;
      const Scene back = mesh::read(file);
      ASSERT_EQ(back.meshes[0].triangles.size(), scene.meshes[0].triangles.size());
      const double step = 2.0 / (std::exp2(bits) - 1);
      double worst = 0;
      for (const Float3& p : back.meshes[0].positions) {
        const double length = std::sqrt(double(p[0]) * p[0] + double(p[1]) * p[1] + double(p[2]) * p[2]);
        worst = std::max(worst, std::abs(length - 1));
      }
      EXPECT_LE(worst, step) << bits;
      if (bits == 8) {
        EXPECT_GT(worst, step / 8) << "it was asked to round";
      }
      EXPECT_EQ(back.instances[0].name, "ball");
    }
  }
}

TEST(Write, InstancesStandWhereTheyStood) {
  Scene scene;
  scene.meshes = {cube()};
  scene.instances = {{"left", 0, mesh::kIdentity}, {"mirrored", 0, {-1, 0, 0, 10, 0, 1, 0, 0, 0, 0, 1, 0}}};
  const TempDir folder;
  const mesh::Written written = write(folder.path() / "two.obj", scene);
  EXPECT_EQ(written.notes.size(), 3u) << "names of meshes, transforms, instances";
  const Scene back = mesh::read(folder.path() / "two.obj");
  ASSERT_EQ(back.meshes.size(), 2u);
  EXPECT_EQ(names_of(back), (std::vector<std::string>{"left", "mirrored"}));
  EXPECT_EQ(back.meshes[1].positions[0], (Float3{11, -1, -1}));
  EXPECT_NEAR(signed_volume(back.meshes[1]), 8, 1e-6) << "a mirrored cube still faces outwards";
}

TEST(Write, SaysWhatAFormatCannotKeep) {
  const TempDir folder;
  Scene scene = ball_and_ring();
  EXPECT_TRUE(write(folder.path() / "a.obj", scene).notes.empty());
  EXPECT_TRUE(write(folder.path() / "a.glb", scene).notes.empty());
  const auto notes = write(folder.path() / "a.stl", scene).notes;
  ASSERT_EQ(notes.size(), 2u);
  EXPECT_NE(notes[0].find("2 objects became one"), std::string::npos) << notes[0];
  EXPECT_NE(notes[1].find("shared vertices"), std::string::npos) << notes[1];
  scene.cameras.emplace_back();
  for (const char* name : {"ends in \\", "ends in \\ "}) {  // a reader may trim it
    scene.instances[0].name = scene.meshes[0].name = name;
    const auto more = write(folder.path() / "a.obj", scene).notes;
    ASSERT_EQ(more.size(), 2u);
    EXPECT_NE(more[0].find("backslash"), std::string::npos) << more[0];
    EXPECT_NE(more[1].find("cameras"), std::string::npos) << more[1];
    const Scene again = mesh::read(folder.path() / "a.obj");
    ASSERT_EQ(again.meshes.size(), 2u) << "no line takes the next one along";
    EXPECT_EQ(again.meshes[0].positions.size(), scene.meshes[0].positions.size());
    EXPECT_EQ(again.meshes[0].name, "ends in _");
  }
}

TEST(Write, RefusesAndLeavesNothing) {
  const TempDir folder;
  const auto status_of = [&](const std::string& name, const Scene& scene,
                             const mesh::WriteOptions& options = {},
                             const std::atomic<bool>& cancel = kGoOn) {
    try {
      mesh::write((folder.path() / name).string(), scene, options, [](double) {}, cancel);
    } catch (const Error& error) {
      return error.status();
    }
    return Status::ok;
  };
  const Scene scene = ball_and_ring();
  EXPECT_EQ(status_of("a.fbx", scene), Status::usage);
  EXPECT_EQ(status_of("a.obj", scene, {.text = true, .draco = false, .draco_bits = {}}), Status::usage);
  EXPECT_EQ(status_of("a.obj", scene, {.text = false, .draco = true, .draco_bits = {}}), Status::usage);
  EXPECT_EQ(status_of("a.glb", scene, {.text = false, .draco = false, .draco_bits = 8}), Status::usage);
  const std::atomic<bool> cancel{true};
  for (const char* name : {"a.obj", "a.ply", "a.stl", "a.off", "a.glb", "a.drc"}) {
    EXPECT_EQ(status_of(name, scene, {}, cancel), Status::interrupted) << name;
    EXPECT_EQ(status_of(std::string("none/") + name, scene), Status::output_folder_missing) << name;
  }
  Scene broken = scene;
  broken.meshes[0].positions[5][0] = std::numeric_limits<float>::infinity();
  EXPECT_EQ(status_of("a.drc", broken), Status::non_finite_vertex);
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

}  // namespace
}  // namespace nif::test
