// What mesh files bring to a scene: lights and cameras, where their nodes and objects place them.
#include "tools/render/scene_meshes.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "formats/base/status.hpp"
#include "tests/support/gltf.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/support/test_shapes.hpp"
#include "tools/common/progress.hpp"
#include "tools/render/scene_file.hpp"

namespace nif::render {
namespace {

using nlohmann::json;
using std::numbers::pi;

const json kPerspective = {{"type", "perspective"}, {"perspective", {{"yfov", pi / 6}, {"znear", 0.1}}}};

class SceneMeshes : public testing::Test {
 protected:
  SceneDescription read(SceneDescription scene) {
    tools::Progress quiet(true);
    notes_.clear();
    meshes_ = read_meshes(scene, {}, notes_, quiet);
    return scene;
  }
  /// A scene in TOML that uses a.glb, written from the current gltf_.
  SceneDescription read_text(const std::string& text) {
    folder_.write("a.glb", gltf_.glb());
    return read(read_scene(folder_.write("scene.toml", text)));
  }
  SceneDescription read_direct() { return read(read_scene(folder_.write("a.glb", gltf_.glb()))); }
  std::string refusal(const std::string& text) {
    try {
      read_text(text);
    } catch (const Error& error) {
      EXPECT_EQ(error.status(), Status::malformed_scene);
      return error.what();
    }
    ADD_FAILURE() << "accepted: " << text;
    return "";
  }
  static void expect_near(const Double3& a, const Double3& b) {
    for (size_t k = 0; k < 3; ++k) EXPECT_NEAR(a[k], b[k], 1e-6) << k;
  }

  const test::TempDir folder_;
  test::Gltf gltf_ = test::gltf_of(test::cube());
  std::vector<std::string> notes_;
  ObjectMeshes meshes_;
};

TEST_F(SceneMeshes, LightsKeepTheirUnits) {
  gltf_.camera(kPerspective);
  gltf_.light({{"type", "directional"}, {"color", {1, 0.5, 0}}, {"intensity", 4}});
  gltf_.light({{"type", "point"}, {"intensity", 5}}, {{"translation", {1, 2, 3}}});
  gltf_.light({{"type", "spot"}, {"spot", {{"innerConeAngle", pi / 9}, {"outerConeAngle", pi / 6}}}},
              {{"rotation", {std::sqrt(0.5), 0, 0, std::sqrt(0.5)}}});
  const SceneDescription scene = read_direct();
  EXPECT_TRUE(notes_.empty());
  ASSERT_EQ(scene.lights.size(), 3u);
  const auto& sun = std::get<Sun>(scene.lights[0]);
  expect_near(sun.direction, {0, 0, 1});  // it shines along -z
  EXPECT_EQ(sun.irradiance, (Colour{4, 2, 0}));
  EXPECT_EQ(sun.angle, 0);
  const auto& point = std::get<PointLight>(scene.lights[1]);
  EXPECT_EQ(point.position, (Double3{1, 2, 3}));
  EXPECT_EQ(point.intensity, (Colour{5, 5, 5}));
  const auto& spot = std::get<SpotLight>(scene.lights[2]);
  expect_near(spot.direction, {0, 1, 0});
  EXPECT_NEAR(spot.inner_angle, 20, 1e-9);
  EXPECT_NEAR(spot.outer_angle, 30, 1e-9);
  ASSERT_EQ(scene.cameras.size(), 1u);
  EXPECT_EQ(scene.cameras[0].name, "camera");
  EXPECT_NEAR(scene.cameras[0].fov, 30, 1e-9);
}

TEST_F(SceneMeshes, ObjectsTakeLightsAndCamerasAlong) {
  gltf_.camera(
      kPerspective,
      {{"name", "eye"}, {"translation", {0, 0, 5}}, {"rotation", {0, 0, std::sqrt(0.5), std::sqrt(0.5)}}});
  gltf_.light({{"type", "spot"}}, {{"translation", {1, 0, 0}}});
  gltf_.light({{"type", "directional"}, {"intensity", 2}});
  const SceneDescription scene =
      read_text("[[object]]\nmesh = 'a.glb'\nscale = 2\nrotate = [0, 90, 0]\ntranslate = [10, 0, 0]\n");
  ASSERT_EQ(scene.cameras.size(), 1u);
  EXPECT_EQ(scene.cameras[0].name, "eye");
  // A quarter turn about y takes z to x and x to -z; the camera rolls to the left, so that its "up" is -x.
  const auto& view = std::get<View>(scene.cameras[0].where);
  expect_near(view.position, {20, 0, 0});
  expect_near(view.forward, {-1, 0, 0});
  expect_near(view.up, {0, 0, 1});
  ASSERT_EQ(scene.lights.size(), 2u);
  const auto& spot = std::get<SpotLight>(scene.lights[0]);
  expect_near(spot.position, {10, 0, -2});
  expect_near(spot.direction, {-1, 0, 0});
  EXPECT_EQ(spot.intensity, (Colour{1, 1, 1}));  // scale does not change intensity
  const auto& sun = std::get<Sun>(scene.lights[1]);
  expect_near(sun.direction, {1, 0, 0});
  EXPECT_EQ(sun.irradiance, (Colour{2, 2, 2}));
}

TEST_F(SceneMeshes, OnlyWhatIsWanted) {
  gltf_.camera(kPerspective);
  gltf_.light({{"type", "point"}});
  const std::string object = "[[object]]\nmesh = 'a.glb'\n", light = "[[light]]\ntype = 'sky'\n",
                    camera = "[[camera]]\n";
  EXPECT_EQ(read_text(object + light).lights.size(), 2u);
  EXPECT_EQ(read_text(object + camera).cameras.size(), 2u);
  EXPECT_EQ(read_text(object + "lights = false\n" + light).lights.size(), 1u);
  EXPECT_EQ(read_text(object + "cameras = false\n" + camera).cameras.size(), 1u);
  EXPECT_NE(refusal(object + "lights = false\n").find("has no light"), std::string::npos);
  EXPECT_NE(refusal(object + "cameras = false\n").find("has no camera"), std::string::npos);
  gltf_ = test::gltf_of(test::cube());
  EXPECT_NE(refusal(object + camera).find("scene.toml: has no light"), std::string::npos);
  EXPECT_NE(refusal(object + light).find("scene.toml: has no camera"), std::string::npos);
}

TEST_F(SceneMeshes, AGltfAloneIsSeenUnderASky) {
  const SceneDescription scene = read_direct();
  ASSERT_EQ(scene.lights.size(), 1u);
  EXPECT_TRUE(std::holds_alternative<Sky>(scene.lights[0]));
  ASSERT_EQ(scene.cameras.size(), 1u);
  EXPECT_TRUE(std::holds_alternative<Orbit>(scene.cameras[0].where));
  EXPECT_EQ(notes_.size(), 2u);
}

TEST_F(SceneMeshes, ObjectsOfOneFileShareIt) {
  gltf_.camera(kPerspective);
  gltf_.light({{"type", "point"}});
  const SceneDescription scene =
      read_text("[[object]]\nmesh = 'a.glb'\n[[object]]\nmesh = 'a.glb'\ntranslate = [5, 0, 0]\n");
  EXPECT_EQ(scene.lights.size(), 2u);
  ASSERT_EQ(meshes_.size(), 2u);
  EXPECT_EQ(meshes_[0], meshes_[1]);
  ASSERT_EQ(scene.cameras.size(), 2u);
  EXPECT_EQ(scene.cameras[1].name, "camera2");
}

TEST_F(SceneMeshes, NamesAreUniqueAndNameFiles) {
  for (const char* name : {"front", "front", "front2", "../a/b", ".hidden", "a:b*c", "front", "\n"})
    gltf_.camera(kPerspective, {{"name", name}});
  std::string large;
  for (int i = 0; i < 100; ++i) large += "ü";
  gltf_.camera(kPerspective, {{"name", large}});
  const SceneDescription scene =
      read_text("[[object]]\nmesh = 'a.glb'\n[[light]]\ntype = 'sky'\n[[camera]]\nname = 'front'\n");
  std::vector<std::string> names;
  for (const CameraDescription& camera : scene.cameras) names.push_back(camera.name);
  EXPECT_EQ(names, (std::vector<std::string>{"front", "front2", "front3", "front22", "_._a_b", "_hidden",
                                             "a_b_c", "front4", "camera", large.substr(0, 120)}));
}

TEST_F(SceneMeshes, WhatHasNoDirectionIsLeftOut) {
  gltf_.camera(kPerspective, {{"scale", {1, 0, 1}}});
  gltf_.light({{"type", "directional"}}, {{"scale", {0, 0, 0}}});
  gltf_.light({{"type", "point"}}, {{"scale", {0, 0, 0}}});  // needs no direction
  gltf_.light({{"type", "point"}}, {{"translation", {1e30, 0, 0}}});
  const SceneDescription scene = read_direct();
  ASSERT_EQ(scene.lights.size(), 1u);
  EXPECT_TRUE(std::holds_alternative<PointLight>(scene.lights[0]));
  ASSERT_EQ(scene.cameras.size(), 1u);
  EXPECT_TRUE(std::holds_alternative<Orbit>(scene.cameras[0].where));
  ASSERT_EQ(notes_.size(), 3u);
  EXPECT_NE(notes_[0].find("2 of its lights"), std::string::npos) << notes_[0];
  EXPECT_NE(notes_[1].find("1 of its cameras"), std::string::npos) << notes_[1];
}

TEST_F(SceneMeshes, NotesOfTheReaderArePassedOn) {
  gltf_.camera({{"type", "orthographic"}});
  read_direct();
  ASSERT_FALSE(notes_.empty());
  EXPECT_NE(notes_[0].find("is orthographic"), std::string::npos);
}

}  // namespace
}  // namespace nif::render
