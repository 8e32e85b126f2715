// What is written as .glb reads back as the same scene, bit by bit.
#include "formats/mesh/gltf/gltf_writer.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <limits>

#include "formats/base/status.hpp"
#include "formats/mesh/read.hpp"
#include "tests/support/pictures.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

using mesh::Light;
using mesh::Scene;

Scene round_trip(const Scene& scene) {
  const TempDir folder;
  const std::vector<std::byte> bytes = mesh::encode_glb(scene);
  return mesh::read(
      folder.write("scene.glb", std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size())));
}

Scene lively_scene() {
  Scene scene;
  scene.meshes = {icosphere(2), cube()};
  scene.meshes[0].name = "ball \"1\" \xc3\xa9";
  scene.meshes[1].name = "cube";
  scene.meshes[0].positions[0] = {0.1f, -3.4028235e38f, 1e-45f};
  scene.instances = {{"first", 0, mesh::kIdentity},
                     {"second", 1, {0.1f, 2, 3, 4, 5, -0.7f, 7, 8, 9, 10, 11.3f, 12}},
                     {"third", 0, {-1, 0, 0, 1, 0, 1, 0, 2, 0, 0, 1, 3}}};
  scene.cameras = {{"front", {1, 0, 0, 5, 0, 1, 0, 6, 0, 0, 1, 7}, 0.7}};
  Light spot{Light::Kind::spot, "lamp", {1, 0, 0, 1, 0, 1, 0, 2, 0, 0, 1, 3}, {1, 0.5f, 0}, 12.5, 0.1, 0.4};
  scene.lights = {{Light::Kind::directional, "sun", mesh::kIdentity, {1, 1, 1}, 3, 0, 0}, spot};
  return scene;
}

// Each material has a primitive whose indices count from its own first vertex.
TEST(GlbWriter, WritesAPrimitiveForEachMaterial) {
  Scene scene;
  scene.meshes = {icosphere(1), cube()};
  scene.instances = {{"ball", 0}, {"cube", 1}};
  mesh::Paint paint;
  paint.materials = {{"red", {1, 0, 0}}, {"leaf", {1, 1, 1}, 0, true}};
  const std::string picture =
      png(2, 1, std::vector<std::array<uint8_t, 4>>{{0, 255, 0, 255}, {0, 0, 255, 0}});
  const auto bytes = std::as_bytes(std::span(picture));
  paint.pictures.emplace_back(bytes.begin(), bytes.end());
  // Two more triangles with vertices of their own, of which the picture's left half blocks.
  mesh::Mesh& ball = scene.meshes[0];
  ball.look.materials.assign(ball.triangles.size(), 0);
  const auto first = uint32_t(ball.positions.size());
  for (const mesh::Float3& p : {mesh::Float3{0, 0, 5}, {1, 0, 5}, {1, 1, 5}, {0, 1, 5}})
    ball.positions.push_back(p);
  ball.look.coordinates.resize(first);
  for (const auto& uv : {std::array{0.0f, 1.0f}, {1, 1}, {1, 0}, {0, 0}}) ball.look.coordinates.push_back(uv);
  ball.triangles.push_back({first, first + 1, first + 2});
  ball.triangles.push_back({first, first + 2, first + 3});
  ball.look.materials.insert(ball.look.materials.end(), 2, 1);
  const TempDir folder;
  const std::vector<std::byte> glb = mesh::encode_glb(scene, &paint);
  const auto file =
      folder.write("scene.glb", std::string(reinterpret_cast<const char*>(glb.data()), glb.size()));
  mesh::ReadLimits limits;
  limits.alpha.read = true;
  limits.colors = true;
  const Scene read = mesh::read(file, limits);
  EXPECT_TRUE(read.notes.empty()) << read.notes[0].text;
  EXPECT_EQ(read.meshes[0].positions, ball.positions);
  EXPECT_EQ(read.meshes[0].triangles, ball.triangles);
  EXPECT_EQ(read.meshes[1].triangles, scene.meshes[1].triangles);
  EXPECT_FALSE(read.meshes[1].look.known());
  const std::vector<mesh::TriangleAlpha>& alpha = read.meshes[0].alpha;
  ASSERT_EQ(alpha.size(), ball.triangles.size());
  for (size_t i = 0; i < alpha.size(); ++i)
    EXPECT_EQ(alpha[i], i + 2 < alpha.size() ? mesh::TriangleAlpha::solid : mesh::TriangleAlpha::cut) << i;
  ASSERT_EQ(read.textures.size(), 1u);
  EXPECT_EQ(read.textures[0].texels, (std::vector<uint8_t>{0, 255, 0, 0, 0, 255}));
  const mesh::Material& red = read.materials[read.meshes[0].look.materials[0]];
  EXPECT_EQ(red.factor, (std::array<float, 3>{1, 0, 0}));
  EXPECT_EQ(red.texture, mesh::kNoTexture);
}

TEST(GlbWriter, WhatIsReadIsWhatWasWritten) {
  const Scene scene = lively_scene(), read = round_trip(scene);
  EXPECT_TRUE(read.notes.empty());
  ASSERT_EQ(read.meshes.size(), scene.meshes.size());
  for (size_t m = 0; m < scene.meshes.size(); ++m) {
    EXPECT_EQ(read.meshes[m].name, scene.meshes[m].name);
    EXPECT_EQ(read.meshes[m].positions, scene.meshes[m].positions);
    EXPECT_EQ(read.meshes[m].triangles, scene.meshes[m].triangles);
  }
  ASSERT_EQ(read.instances.size(), scene.instances.size());
  for (size_t i = 0; i < scene.instances.size(); ++i) {
    EXPECT_EQ(read.instances[i].name, scene.instances[i].name);
    EXPECT_EQ(read.instances[i].mesh, scene.instances[i].mesh);
    EXPECT_EQ(read.instances[i].transform, scene.instances[i].transform);
  }
  ASSERT_EQ(read.cameras.size(), 1u);
  EXPECT_EQ(read.cameras[0].name, "front");
  EXPECT_EQ(read.cameras[0].transform, scene.cameras[0].transform);
  EXPECT_EQ(read.cameras[0].vertical_fov, 0.7);
  ASSERT_EQ(read.lights.size(), 2u);
  EXPECT_EQ(read.lights[0].kind, Light::Kind::directional);
  EXPECT_EQ(read.lights[0].intensity, 3);
  EXPECT_EQ(read.lights[1].colour, scene.lights[1].colour);
  EXPECT_EQ(read.lights[1].transform, scene.lights[1].transform);
  EXPECT_EQ(read.lights[1].inner_cone, 0.1);
  EXPECT_EQ(read.lights[1].outer_cone, 0.4);
}

TEST(GlbWriter, RefusesWhatNoReaderTakes) {
  const auto status_of = [](const Scene& scene) {
    try {
      mesh::encode_glb(scene);
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find("'cube'"), std::string::npos) << error.what();
      return error.status();
    }
    return Status::ok;
  };
  Scene scene = lively_scene();
  scene.meshes[1].triangles[0][2] = 1000;
  EXPECT_EQ(status_of(scene), Status::index_out_of_range);
  scene = lively_scene();
  scene.meshes[1].positions[3][1] = std::numeric_limits<float>::infinity();
  EXPECT_EQ(status_of(scene), Status::non_finite_vertex);
  scene = lively_scene();
  scene.meshes[1].triangles.clear();
  EXPECT_EQ(status_of(scene), Status::no_triangles);
}

}  // namespace
}  // namespace nif::test
