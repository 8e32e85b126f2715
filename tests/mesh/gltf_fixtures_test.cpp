// Cameras and lights of glTF: what is read, and that what is wrong with one is told and costs no mesh.
#include <gtest/gtest.h>

#include <numbers>

#include "formats/mesh/read.hpp"
#include "tests/mesh/encode.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

using mesh::Light;
using mesh::Scene;
using nlohmann::json;
using std::numbers::pi;

/// A cube in a scene to which nodes can be added.
class Fixtures : public testing::Test {
 protected:
  /// Adds a node to the scene and returns its number.
  int node(json node) {
    const int index = gltf_.node(std::move(node));
    gltf_.json["scenes"][0]["nodes"].push_back(index);
    return index;
  }
  Scene read() const { return mesh::read(folder_.write("file.glb", gltf_.glb())); }
  /// The file is read without a camera or light, and with one warning that contains all of these words.
  void expect_left_out(const std::vector<std::string>& fragments) const {
    const Scene scene = read();
    EXPECT_EQ(scene.meshes.size(), 1u);
    EXPECT_TRUE(scene.cameras.empty());
    EXPECT_TRUE(scene.lights.empty());
    ASSERT_EQ(scene.notes.size(), 1u) << gltf_.json.dump();
    EXPECT_NE(scene.notes[0].text.find("file.glb: "), std::string::npos);
    EXPECT_EQ(scene.notes[0].text.find('\n'), std::string::npos);
    for (const std::string& fragment : fragments)
      EXPECT_NE(scene.notes[0].text.find(fragment), std::string::npos) << scene.notes[0].text;
  }

  const TempDir folder_;
  Gltf gltf_ = gltf_of(cube());
};

const json kPerspective = {{"type", "perspective"}, {"perspective", {{"yfov", 0.5}, {"znear", 0.1}}}};

TEST_F(Fixtures, CamerasStandWhereTheirNodesDo) {
  json named = kPerspective;
  named["name"] = "definition";
  gltf_.camera(named, {{"name", "front"}, {"translation", {1, 2, 3}}});
  gltf_.camera(named);
  const int parent = node({{"translation", {10, 0, 0}}});
  const int child = gltf_.node({{"camera", 0}, {"rotation", {0, std::sqrt(0.5), 0, std::sqrt(0.5)}}});
  gltf_.json["nodes"][size_t(parent)]["children"] = {child};
  const Scene scene = read();
  EXPECT_TRUE(scene.notes.empty());
  ASSERT_EQ(scene.cameras.size(), 3u);
  EXPECT_EQ(scene.cameras[0].name, "front");
  EXPECT_EQ(scene.cameras[0].vertical_fov, 0.5);
  EXPECT_EQ(scene.cameras[0].transform, (mesh::Transform{1, 0, 0, 1, 0, 1, 0, 2, 0, 0, 1, 3}));
  EXPECT_EQ(scene.cameras[1].name, "definition");
  const mesh::Transform turned{0, 0, 1, 10, 0, 1, 0, 0, -1, 0, 0, 0};
  for (size_t i = 0; i < 12; ++i) EXPECT_NEAR(scene.cameras[2].transform[i], turned[i], 1e-6) << i;
}

TEST_F(Fixtures, LightsOfAllKinds) {
  gltf_.light({{"type", "directional"}, {"color", {1, 0.5, 0.25}}, {"intensity", 3}}, {{"name", "sun"}});
  gltf_.light({{"type", "point"}, {"name", "bulb"}});
  gltf_.light({{"type", "spot"}, {"spot", {{"innerConeAngle", 0.1}, {"outerConeAngle", 0.2}}}});
  gltf_.light({{"type", "spot"}, {"spot", json::object()}});
  gltf_.light({{"type", "spot"}, {"spot", {{"outerConeAngle", double(float(pi / 2))}}}});
  const Scene scene = read();
  EXPECT_TRUE(scene.notes.empty());
  ASSERT_EQ(scene.lights.size(), 5u);
  EXPECT_EQ(scene.lights[0].kind, Light::Kind::directional);
  EXPECT_EQ(scene.lights[0].name, "sun");
  EXPECT_EQ(scene.lights[0].colour, (mesh::Float3{1, 0.5f, 0.25f}));
  EXPECT_EQ(scene.lights[0].intensity, 3);
  EXPECT_EQ(scene.lights[1].kind, Light::Kind::point);
  EXPECT_EQ(scene.lights[1].name, "bulb");
  EXPECT_EQ(scene.lights[1].colour, (mesh::Float3{1, 1, 1}));
  EXPECT_EQ(scene.lights[1].intensity, 1);
  EXPECT_EQ(scene.lights[2].inner_cone, 0.1);
  EXPECT_EQ(scene.lights[2].outer_cone, 0.2);
  EXPECT_EQ(scene.lights[3].inner_cone, 0);
  EXPECT_EQ(scene.lights[3].outer_cone, pi / 4);
  EXPECT_EQ(scene.lights[4].outer_cone, pi / 2);
}

TEST_F(Fixtures, WhatIsNotInTheSceneIsNotTaken) {
  gltf_.json["cameras"].push_back(kPerspective);
  gltf_.json["cameras"].push_back("nonsense");
  gltf_.node({{"camera", 0}});
  gltf_.node({{"camera", 7}});
  const Scene scene = read();
  EXPECT_TRUE(scene.cameras.empty());
  EXPECT_TRUE(scene.notes.empty());
}

TEST_F(Fixtures, OtherFormatsHaveNone) {
  const Scene scene = mesh::read(folder_.write("a.ply", ply_text(cube())));
  EXPECT_TRUE(scene.cameras.empty());
  EXPECT_TRUE(scene.lights.empty());
}

TEST_F(Fixtures, MeshesAreTheSameWithAndWithout) {
  const Scene without = mesh::read(folder_.write("file.glb", gltf_of(cube()).glb()));
  gltf_.camera(kPerspective);
  gltf_.light({{"type", "point"}});
  const Scene with = read();
  EXPECT_EQ(with.meshes[0].positions, without.meshes[0].positions);
  EXPECT_EQ(with.meshes[0].triangles, without.meshes[0].triangles);
  EXPECT_EQ(with.instances.size(), without.instances.size());
}

TEST_F(Fixtures, MalformedCamerasAreLeftOut) {
  const std::vector<std::pair<json, std::string>> cases{
      {{{"type", "orthographic"}, {"orthographic", {{"xmag", 1}}}}, "is orthographic"},
      {{{"type", "fisheye"}}, "not a perspective camera"},
      {json::object(), "not a perspective camera"},
      {nullptr, "not a perspective camera"},
      {"text", "not a perspective camera"},
      {{{"type", "perspective"}}, "not a perspective camera"},
      {{{"type", 3}, {"perspective", {{"yfov", 1}}}}, "not a perspective camera"},
      {{{"type", "perspective"}, {"perspective", 5}}, "yfov"},
      {{{"type", "perspective"}, {"perspective", json::object()}}, "yfov"},
      {{{"type", "perspective"}, {"perspective", {{"yfov", "1"}}}}, "yfov"},
      {{{"type", "perspective"}, {"perspective", {{"yfov", 0}}}}, "yfov"},
      {{{"type", "perspective"}, {"perspective", {{"yfov", -1}}}}, "yfov"},
      {{{"type", "perspective"}, {"perspective", {{"yfov", 3.2}}}}, "yfov"},
      {{{"type", "perspective"}, {"perspective", {{"yfov", 1e300}}}}, "yfov"}};
  for (const auto& [definition, fragment] : cases) {
    SCOPED_TRACE(definition.dump());
    gltf_ = gltf_of(cube());
    gltf_.camera(definition);
    expect_left_out({"camera 0 of node 1 ", fragment, "was left out"});
  }
}

TEST_F(Fixtures, MalformedLightsAreLeftOut) {
  const auto spot = [](const json& inner, const json& outer) {
    return json{{"type", "spot"}, {"spot", {{"innerConeAngle", inner}, {"outerConeAngle", outer}}}};
  };
  const std::vector<std::pair<json, std::string>> cases{
      {json::object(), "neither directional"},
      {json::array(), "neither directional"},
      {{{"type", "area"}}, "neither directional"},
      {{{"type", "point"}, {"color", 1}}, "three numbers"},
      {{{"type", "point"}, {"color", {1, 1}}}, "three numbers"},
      {{{"type", "point"}, {"color", {1, 1, "x"}}}, "three numbers"},
      {{{"type", "point"}, {"color", {1, -1, 1}}}, "three numbers"},
      {{{"type", "point"}, {"color", {1, 1e300, 1}}}, "three numbers"},
      {{{"type", "point"}, {"intensity", -1}}, "intensity"},
      {{{"type", "point"}, {"intensity", 1e300}}, "intensity"},
      {{{"type", "point"}, {"intensity", nullptr}}, "intensity"},
      {{{"type", "spot"}, {"spot", 4}}, "cone angles"},
      {spot(0.5, 0.4), "cone angles"},
      {spot(-0.1, 0.4), "cone angles"},
      {spot(0, 0), "cone angles"},
      {spot(0, 1.7), "cone angles"},
      {spot("0", 0.4), "cone angles"}};
  for (const auto& [definition, fragment] : cases) {
    SCOPED_TRACE(definition.dump());
    gltf_ = gltf_of(cube());
    gltf_.light(definition);
    expect_left_out({"light 0 of node 1 ", fragment, "was left out"});
  }
}

TEST_F(Fixtures, ReferencesToNothing) {
  const std::vector<json> references{7, -1, 0.5, "0", nullptr, 18446744073709551615u, json::array()};
  const Gltf plain = gltf_;
  for (const json& reference : references) {
    SCOPED_TRACE(reference.dump());
    gltf_ = plain;
    node({{"camera", reference}});
    expect_left_out({"node 1 uses a camera that does not exist"});
    gltf_ = plain;
    node({{"extensions", {{"KHR_lights_punctual", {{"light", reference}}}}}});
    expect_left_out({"node 1 uses a light that does not exist"});
  }
  for (const json& lists : std::vector<json>{5, "x", json::object(), nullptr}) {
    SCOPED_TRACE(lists.dump());
    gltf_ = plain;
    gltf_.json["cameras"] = lists;
    gltf_.json["extensions"]["KHR_lights_punctual"]["lights"] = lists;
    node({{"camera", 0}});
    expect_left_out({"uses a camera"});
    gltf_.json["extensions"] = lists;
    expect_left_out({"uses a camera"});
  }
}

TEST_F(Fixtures, AtInfinity) {
  gltf_.camera(kPerspective, {{"translation", {1e300, 0, 0}}});
  expect_left_out({"node 1 is placed at infinity"});
}

TEST_F(Fixtures, ManyFlawsMakeFewWarnings) {
  for (int i = 0; i < 1000; ++i) node({{"camera", 5}});
  const Scene scene = read();
  ASSERT_LT(scene.notes.size(), 30u);
  EXPECT_NE(scene.notes.back().text.find("980 more"), std::string::npos) << scene.notes.back().text;
}

TEST_F(Fixtures, LongNamesAreCut) {
  json definition = kPerspective;
  definition["name"] = "a";
  for (int i = 0; i < 1000; ++i) definition["name"].get_ref<std::string&>() += "ü";
  gltf_.camera(definition);
  const Scene scene = read();
  ASSERT_EQ(scene.cameras.size(), 1u);
  EXPECT_EQ(scene.cameras[0].name.size(), 127u);  // not cut within a character
  EXPECT_TRUE(scene.cameras[0].name.ends_with("ü"));
}

}  // namespace
}  // namespace nif::test
