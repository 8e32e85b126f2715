// glTF: what of a file blocks, and where. Nodes that flatten their meshes or are hidden, instances by
// accessors, skins in a pose, materials that let light through, names of collision shapes; and sparse and
// empty accessors.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "formats/mesh/box.hpp"
#include "formats/mesh/read.hpp"
#include "formats/mesh/transform.hpp"
#include "tests/support/gltf.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

using mesh::NoteKind;
using mesh::Scene;
using nlohmann::json;

/// A cube from 0 to 1 as mesh `number` of the file.
int add_cube(Gltf& gltf, const char* name = "cube") {
  const mesh::Mesh shape = cube();
  std::vector<mesh::Float3> positions = shape.positions;
  for (mesh::Float3& p : positions)
    for (float& x : p) x = x > 0 ? 1 : 0;
  std::vector<uint32_t> flat;
  for (const mesh::Triangle& t : shape.triangles) flat.insert(flat.end(), t.begin(), t.end());
  return gltf.mesh(gltf.positions(positions), gltf.indices(flat), name);
}

Scene read_of(const Gltf& gltf, const mesh::Choice& choice = {}) {
  mesh::ReadLimits limits;
  limits.choice = choice;
  return mesh::read("shown.glb", gltf.glb(), limits);
}

std::vector<NoteKind> kinds_of(const Scene& scene) {
  std::vector<NoteKind> kinds;
  for (const mesh::Note& note : scene.notes) kinds.push_back(note.kind);
  return kinds;
}
using Kinds = std::vector<NoteKind>;

/// The world-space box of an instance.
mesh::Box box_of(const Scene& scene, size_t instance) {
  const mesh::Instance& placed = scene.instances[instance];
  const mesh::Mesh& mesh = scene.meshes[placed.mesh];
  mesh::Mesh moved = mesh;
  for (mesh::Float3& p : moved.positions) p = mesh::transformed(placed.transform, p);
  return mesh::bounds(moved.positions, moved.triangles);
}

void expect_box(const mesh::Box& box, const mesh::Float3& least, const mesh::Float3& most) {
  for (size_t a = 0; a < 3; ++a) {
    EXPECT_NEAR(box.min[a], least[a], 1e-5) << a;
    EXPECT_NEAR(box.max[a], most[a], 1e-5) << a;
  }
}

Gltf with_nodes(const std::vector<json>& nodes) {
  Gltf gltf;
  add_cube(gltf);
  std::vector<int> roots;
  for (const json& node : nodes) roots.push_back(gltf.node(node));
  gltf.scene(roots);
  return gltf;
}

TEST(GltfShown, WhatANodeFlattensKeepsItsArea) {
  const Scene scene = read_of(with_nodes({{{"mesh", 0}, {"scale", {2, 3, 0}}, {"translation", {30, 0, 5}}},
                                          {{"mesh", 0}, {"scale", {2, 3, 0}}, {"translation", {0, 0, 1}}},
                                          {{"mesh", 0}, {"name", "solid"}}}));
  EXPECT_EQ(kinds_of(scene), Kinds{});
  ASSERT_EQ(scene.instances.size(), 3u);
  ASSERT_EQ(scene.meshes.size(), 2u) << "equal ones are shared";
  EXPECT_EQ(scene.instances[0].mesh, scene.instances[1].mesh);
  EXPECT_EQ(scene.instances[0].transform, (mesh::Transform{1, 0, 0, 30, 0, 1, 0, 0, 0, 0, 1, 5}));
  expect_box(box_of(scene, 0), {30, 0, 5}, {32, 3, 5});
  expect_box(box_of(scene, 1), {0, 0, 1}, {2, 3, 1});
  expect_box(box_of(scene, 2), {0, 0, 0}, {1, 1, 1});
}

/// Rounding makes the transform invertible, and leaves a needle with a tiny area.
TEST(GltfShown, TurnedTransformsFlattenToo) {
  const json turned = {{"rotation", {0.2, 0.4, 0.6, 0.66332495807108}}, {"children", {1}}};
  const auto scene_of = [&](const json& scale) {
    Gltf gltf;
    add_cube(gltf);
    gltf.node(turned);
    gltf.node({{"scale", scale}, {"children", {2}}});
    gltf.node({{"mesh", 0}, {"rotation", {0.5, 0.5, -0.5, 0.5}}, {"name", "part"}});
    gltf.node({{"mesh", 0}, {"name", "other"}});
    gltf.scene({0, 3});
    return read_of(gltf);
  };
  const Scene flat = scene_of({1, 1, 0});
  ASSERT_EQ(flat.instances.size(), 2u);
  EXPECT_EQ(kinds_of(flat), Kinds{});
  EXPECT_FALSE(mesh::flattens(flat.instances[0].transform));
  const Scene line = scene_of({1, 0, 0});
  ASSERT_EQ(line.instances.size(), 1u);
  EXPECT_EQ(kinds_of(line), Kinds{NoteKind::flattened});
  EXPECT_NE(line.notes[0].text.find("'part'"), std::string::npos) << line.notes[0].text;
  EXPECT_EQ(scene_of({0, 0, 0}).instances.size(), 1u);
  EXPECT_EQ(scene_of({1e-30, 1e-30, 1e-30}).instances.size(), 2u);
  EXPECT_EQ(scene_of({1e-40, 1e-40, 1e-40}).instances.size(), 1u) << "too small to be baked";
}

TEST(GltfShown, AFileThatPlacesNothingKeepsItsMeshes) {
  const Scene scene = read_of(with_nodes({{{"mesh", 0}, {"scale", {0, 0, 0}}}}));
  EXPECT_TRUE(scene.instances.empty());
  EXPECT_EQ(scene.meshes.size(), 1u);
  EXPECT_EQ(kinds_of(scene), Kinds{NoteKind::flattened});
}

/// A small file may have many nodes that flatten one large mesh in many ways.
TEST(GltfShown, BoundsWhatIsFlattened) {
  Gltf gltf;
  add_cube(gltf);
  std::vector<int> roots;
  for (int i = 1; i <= 100; ++i) roots.push_back(gltf.node({{"mesh", 0}, {"scale", {i, 1, 0}}}));
  gltf.scene(roots);
  EXPECT_EQ(mesh::read("a.glb", gltf.glb(), {.max_triangles = 1200}).meshes.size(), 100u);
  EXPECT_THROW(mesh::read("a.glb", gltf.glb(), {.max_triangles = 1199}), Error);
}

TEST(GltfShown, HiddenNodesAndAllBelowThemAreLeftOut) {
  const json hidden = {{"KHR_node_visibility", {{"visible", false}}}};
  Gltf gltf;
  add_cube(gltf), add_cube(gltf, "ghost");
  gltf.node({{"mesh", 0}, {"name", "seen"}});
  gltf.node({{"mesh", 1}, {"children", {2}}, {"extensions", hidden}});
  gltf.node({{"mesh", 0}, {"extensions", {{"KHR_node_visibility", {{"visible", true}}}}}});
  gltf.scene({0, 1});
  gltf.json["extensionsUsed"] = gltf.json["extensionsRequired"] = {"KHR_node_visibility"};
  const Scene scene = read_of(gltf);
  ASSERT_EQ(scene.instances.size(), 1u);
  EXPECT_EQ(scene.instances[0].name, "seen");
  EXPECT_EQ(scene.meshes.size(), 1u);
  EXPECT_EQ(kinds_of(scene), Kinds{NoteKind::hidden});
  EXPECT_FALSE(mesh::is_loss(NoteKind::hidden));
  EXPECT_NE(scene.notes[0].text.find("2 nodes"), std::string::npos) << scene.notes[0].text;

  gltf.json["nodes"][0]["extensions"] = hidden;
  try {
    read_of(gltf);
    ADD_FAILURE() << "nothing is shown";
  } catch (const Error& error) {
    EXPECT_EQ(error.status(), Status::no_triangles);
    EXPECT_NE(std::string(error.what()).find("hidden"), std::string::npos) << error.what();
  }
  // Cycles are also found among hidden nodes.
  gltf.json["nodes"][2]["children"] = {1};
  EXPECT_THROW(read_of(gltf), Error);
}

TEST(GltfShown, LightsOfHiddenNodesAreOffAndCamerasStay) {
  Gltf gltf = with_nodes({{{"mesh", 0}}});
  const json hidden = {{"extensions", {{"KHR_node_visibility", {{"visible", false}}}}}};
  gltf.camera({{"type", "perspective"}, {"perspective", {{"yfov", 1.0}, {"znear", 0.1}}}}, hidden);
  gltf.light({{"type", "point"}}, hidden);
  const Scene scene = read_of(gltf);
  EXPECT_EQ(scene.cameras.size(), 1u);
  EXPECT_EQ(scene.lights.size(), 0u);
}

Gltf instanced(const json& attributes) {
  return with_nodes({{{"mesh", 0},
                      {"name", "crate"},
                      {"translation", {100, 0, 0}},
                      {"extensions", {{"EXT_mesh_gpu_instancing", {{"attributes", attributes}}}}}}});
}

TEST(GltfShown, InstancesByAccessorsComeAfterTheirNode) {
  Gltf gltf = instanced({});
  const int places = gltf.positions({{0, 0, 0}, {5, 0, 0}}),
            turns =
                gltf.accessor(raw(std::vector<int16_t>{0, 0, 0, 32767, 0, 0, 23170, 23170}), 5122, "VEC4", 2),
            scales = gltf.positions({{1, 1, 1}, {2, 3, 1}});
  gltf.json["accessors"][turns]["normalized"] = true;
  json& attributes = gltf.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"];
  attributes = {{"TRANSLATION", places}, {"ROTATION", turns}, {"SCALE", scales}, {"_ID", scales}};
  gltf.json["extensionsUsed"] = gltf.json["extensionsRequired"] = {"EXT_mesh_gpu_instancing"};
  const Scene scene = read_of(gltf);
  ASSERT_EQ(scene.instances.size(), 2u);
  EXPECT_EQ(kinds_of(scene), Kinds{});
  EXPECT_EQ(scene.instances[1].name, "crate");
  EXPECT_EQ(scene.instances[1].node, scene.instances[0].node);
  expect_box(box_of(scene, 0), {100, 0, 0}, {101, 1, 1});
  // Scaled, then rotated by a quarter turn about z, then moved.
  const mesh::Box box = box_of(scene, 1);
  expect_box(box, {102, 0, 0}, {105, 2, 1});

  attributes = {{"TRANSLATION", places}, {"SCALE", gltf.positions({{1, 1, 1}})}};
  EXPECT_THROW(read_of(gltf), Error) << "of different lengths";
  for (const json& wrong : {json(), json::object(), json{{"TRANSLATION", 99}}, json{{"TRANSLATION", "all"}},
                            json{{"ROTATION", places}}, json{{"TRANSLATION", -1}}}) {
    attributes = wrong;
    EXPECT_THROW(read_of(gltf), Error) << wrong;
  }
}

/// Accessors without a buffer view take no bytes in a file.
TEST(GltfShown, BoundsInstancesByAccessors) {
  for (const uint64_t count : {uint64_t{4'000'000'000}, uint64_t{9'000'000}}) {
    Gltf gltf = instanced({});
    gltf.json["accessors"].push_back({{"componentType", 5126}, {"type", "VEC3"}, {"count", count}});
    gltf.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = {{"SCALE", 2}};
    try {
      read_of(gltf);
      ADD_FAILURE() << count;
    } catch (const Error& error) {
      EXPECT_EQ(error.status(), Status::too_large) << error.what();
    }
  }
}

/// A cube whose lower and upper corners follow two joints, under a node of scale 0.
Gltf skinned(float moved) {
  Gltf gltf = with_nodes({});
  gltf.json["nodes"] = json::array();
  gltf.json["scenes"] = json::array();
  const mesh::Mesh shape = cube();
  std::vector<uint8_t> joints;
  std::vector<float> weights, inverses;
  for (const mesh::Float3& p : shape.positions) {
    joints.insert(joints.end(), {0, 1, 0, 0});
    const bool upper = p[2] > 0;
    weights.insert(weights.end(), {upper ? 0.0f : 2.0f, upper ? 2.0f : 0.0f, 0, 0});
  }
  for (int i = 0; i < 2; ++i)
    inverses.insert(inverses.end(), {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, -10, 0, 0, 1});
  json& attributes = gltf.json["meshes"][0]["primitives"][0]["attributes"];
  attributes["JOINTS_0"] = gltf.accessor(raw(joints), 5121, "VEC4", shape.positions.size());
  attributes["WEIGHTS_0"] = gltf.accessor(raw(weights), 5126, "VEC4", shape.positions.size());
  gltf.json["skins"] = {
      {{"joints", {0, 1}}, {"inverseBindMatrices", gltf.accessor(raw(inverses), 5126, "MAT4", 2)}}};
  gltf.node({{"translation", {1010, 0, 0}}});
  gltf.node({{"translation", {1010 + moved, 0, 0}}});
  gltf.node({{"mesh", 0}, {"skin", 0}, {"scale", {0, 0, 0}}});
  gltf.scene({0, 1, 2});
  return gltf;
}

TEST(GltfShown, JointsPlaceSkinsUnderAScaleOfZero) {
  const Scene bound = read_of(skinned(0));
  ASSERT_EQ(bound.instances.size(), 1u);
  EXPECT_EQ(kinds_of(bound), Kinds{NoteKind::bind_pose});
  expect_box(box_of(bound, 0), {1000, 0, 0}, {1001, 1, 1});

  const Scene posed = read_of(skinned(4));
  ASSERT_EQ(posed.instances.size(), 1u);
  EXPECT_EQ(kinds_of(posed), Kinds{NoteKind::pose});
  EXPECT_TRUE(posed.instances[0].moves);
  expect_box(box_of(posed, 0), {1000, 0, 0}, {1005, 1, 1});
  for (const mesh::Float3& p : posed.meshes[0].positions) {
    const float x = p[0] + posed.instances[0].transform[3];
    EXPECT_TRUE(p[2] > 0.5f ? x >= 1004 : x <= 1001) << x;
  }
}

TEST(GltfShown, SkinsThatCannotBeReadAreNotLost) {
  Gltf far_joint = skinned(4);  // the second joint is not in the skin
  far_joint.json["skins"][0]["joints"] = {0};
  far_joint.json["skins"][0].erase("inverseBindMatrices");
  EXPECT_EQ(read_of(far_joint).instances.size(), 1u);
  Gltf no_joints = skinned(4);
  no_joints.json["skins"][0]["joints"] = {99};
  const Scene scene = read_of(no_joints);
  ASSERT_EQ(scene.instances.size(), 1u);
  EXPECT_EQ(kinds_of(scene), Kinds{NoteKind::posed_skin});
  expect_box(box_of(scene, 0), {0, 0, 0}, {1, 1, 1});
  Gltf wrong = skinned(4);
  wrong.json["meshes"][0]["primitives"][0]["attributes"]["WEIGHTS_0"] = 0;  // VEC3
  EXPECT_EQ(kinds_of(read_of(wrong)), (Kinds{NoteKind::pose, NoteKind::posed_skin}));
}

TEST(GltfShown, NotesMaterialsThatLetLightThrough) {
  Gltf gltf = with_nodes({{{"mesh", 0}}});
  json& primitive = gltf.json["meshes"][0]["primitives"][0];
  primitive["material"] = 0;
  const auto is_noted = [&](const json& material) {
    gltf.json["materials"] = {material};
    const Scene scene = read_of(gltf);
    EXPECT_EQ(scene.instances.size(), 1u);
    return kinds_of(scene) == Kinds{NoteKind::see_through};
  };
  const auto colour = [](double alpha) { return json{{"baseColorFactor", {1, 1, 1, alpha}}}; };
  EXPECT_FALSE(is_noted({{"name", "wall"}}));
  EXPECT_FALSE(is_noted({{"alphaMode", "BLEND"}})) << "alpha is 1 everywhere";
  EXPECT_TRUE(is_noted({{"alphaMode", "BLEND"}, {"pbrMetallicRoughness", colour(0.1)}}));
  EXPECT_TRUE(
      is_noted({{"alphaMode", "BLEND"}, {"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}}));
  EXPECT_TRUE(is_noted({{"alphaMode", "MASK"}, {"pbrMetallicRoughness", colour(0.4)}}));
  EXPECT_FALSE(
      is_noted({{"alphaMode", "MASK"}, {"alphaCutoff", 0.3}, {"pbrMetallicRoughness", colour(0.4)}}));
  const auto glossy = [](const json& said) { return json{{"KHR_materials_pbrSpecularGlossiness", said}}; };
  EXPECT_TRUE(
      is_noted({{"alphaMode", "BLEND"}, {"extensions", glossy({{"diffuseTexture", {{"index", 0}}}})}}));
  EXPECT_TRUE(
      is_noted({{"alphaMode", "BLEND"}, {"extensions", glossy({{"diffuseFactor", {1, 1, 1, 0.1}}})}}));
  EXPECT_FALSE(is_noted({{"alphaMode", "BLEND"},
                         {"extensions", glossy(json::object())},
                         {"pbrMetallicRoughness", colour(0.1)}}));
  EXPECT_TRUE(is_noted({{"extensions", {{"KHR_materials_transmission", {{"transmissionFactor", 0.5}}}}}}));
  EXPECT_FALSE(is_noted({{"extensions", {{"KHR_materials_transmission", json::object()}}}}));
  EXPECT_TRUE(is_noted({{"name", "glass"}, {"alphaMode", "BLEND"}, {"pbrMetallicRoughness", colour(0)}}));
  const std::string text = read_of(gltf).notes[0].text;
  EXPECT_NE(text.find("'glass'"), std::string::npos) << text;
  EXPECT_NE(text.find("12 triangles"), std::string::npos) << text;
}

TEST(GltfShown, RemarksOnNamesOfCollisionShapesAndLevels) {
  const auto is_noted = [](const std::string& name, const std::string& other = "other") {
    const Scene scene = read_of(with_nodes({{{"mesh", 0}, {"name", name}}, {{"mesh", 0}, {"name", other}}}));
    EXPECT_EQ(scene.instances.size(), 2u);
    return kinds_of(scene) == Kinds{NoteKind::helpers};
  };
  for (const char* name : {"UCX_crate_01", "ubx_a", "wall-col", "wall-colonly", "Wall_Collider",
                           "x_collision", "Collision", "wall-col.001"})
    EXPECT_TRUE(is_noted(name)) << name;
  for (const char* name : {"column", "protocol", "collisions of cars", "crate_LOD1", "lod"})
    EXPECT_FALSE(is_noted(name)) << name;
  EXPECT_TRUE(is_noted("crate_LOD1", "crate_LOD0"));
  EXPECT_FALSE(is_noted("crate_LOD1", "barrel_LOD0"));
  EXPECT_FALSE(mesh::is_loss(NoteKind::helpers));
}

/// Indices of two triangles; sparse values replace one.
TEST(GltfShown, SparseAccessorsOfAnything) {
  Gltf gltf;
  const int points = gltf.positions({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}});
  const int indices = gltf.indices16({0, 1, 2, 0, 2, 2});
  const auto sparse = [&](const std::string& values, uint16_t at) {
    return json{{"count", 1},
                {"indices", {{"bufferView", gltf.view(raw(std::vector{at}))}, {"componentType", 5123}}},
                {"values", {{"bufferView", gltf.view(values)}}}};
  };
  gltf.json["accessors"][indices]["sparse"] = sparse(raw(std::vector<uint16_t>{3}), 5);
  const int colors = gltf.positions({{1, 1, 1}, {1, 1, 1}, {1, 1, 1}, {1, 1, 1}});
  gltf.json["accessors"][colors]["sparse"] = sparse(raw(std::vector{1.0f, 0.0f, 0.0f}), 2);
  gltf.mesh(points, indices);
  gltf.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = colors;
  mesh::ReadLimits limits;
  limits.colors = true;
  const Scene scene = mesh::read("a.glb", gltf.glb(), limits);
  EXPECT_EQ(scene.meshes[0].triangles, (std::vector<mesh::Triangle>{{0, 1, 2}, {0, 2, 3}}));
  EXPECT_EQ(scene.meshes[0].look.colors[2], (std::array<float, 3>{1, 0, 0}));
  EXPECT_EQ(scene.meshes[0].look.colors[1], (std::array<float, 3>{1, 1, 1}));

  // Without a buffer view, all values are 0 except for the sparse ones.
  gltf.json["accessors"][indices].erase("bufferView");
  EXPECT_EQ(read_of(gltf).meshes[0].triangles, (std::vector<mesh::Triangle>{{0, 0, 0}, {0, 0, 3}}));
  for (const json& count : {json(7), json(-1), json(3'000'000'000)}) {
    gltf.json["accessors"][indices]["sparse"]["count"] = count;
    EXPECT_THROW(read_of(gltf), Error) << count;
  }
  gltf.json["accessors"][indices]["sparse"] = sparse(raw(std::vector<uint16_t>{3}), 6);
  EXPECT_THROW(read_of(gltf), Error) << "beyond the last element";
}

TEST(GltfShown, EmptyAccessorsCostOnlyTheirPrimitive) {
  Gltf gltf;
  add_cube(gltf);
  gltf.json["accessors"].push_back({{"componentType", 5123}, {"type", "SCALAR"}, {"count", 0}});
  gltf.mesh(gltf.json["meshes"][0]["primitives"][0]["attributes"]["POSITION"], 2, "zero");
  gltf.scene({gltf.node({{"mesh", 0}}), gltf.node({{"mesh", 1}})});
  const Scene scene = read_of(gltf);
  EXPECT_EQ(scene.instances.size(), 1u);
  EXPECT_EQ(kinds_of(scene), Kinds{NoteKind::empty_primitives});
}

}  // namespace
}  // namespace nif::test
