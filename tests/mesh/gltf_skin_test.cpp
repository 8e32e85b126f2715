// Skins and morph targets that are kept while a glTF is read: ReadLimits::skins.
#include "formats/mesh/skin.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "formats/base/status.hpp"
#include "formats/mesh/alike.hpp"
#include "formats/mesh/read.hpp"
#include "tests/support/gltf.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

using mesh::Float3;
using mesh::NoteKind;
using mesh::Scene;
using nlohmann::json;

Scene read_kept(const Gltf& gltf) { return mesh::read("a.glb", gltf.glb(), {.skins = true}); }

std::vector<NoteKind> kinds_of_notes(const Scene& scene) {
  std::vector<NoteKind> kinds;
  for (const mesh::Note& note : scene.notes) kinds.push_back(note.kind);
  return kinds;
}

/// A triangle with the skin of node 3, whose joints are the nodes 0, 1 and 2: one that does not move, one that is moved by `moved`
/// from where the triangle was bound to it, and one at the first.
class KeptSkins : public testing::Test {
 protected:
  explicit KeptSkins(float moved = 5) {
    for (const float x : {0.0f, 2 + moved, 0.0f}) gltf_.node({{"translation", {x, 0, 0}}});
    gltf_.positions(kCorners);  // accessor 0
    gltf_.indices({0, 1, 2});   // accessor 1
    gltf_.node({{"mesh", gltf_.mesh(0, 1, "skin")}, {"skin", 0}, {"translation", {50, 50, 50}}});
    std::vector<float> inverses;
    for (const float x : {0.0f, 2.0f, 0.0f})
      inverses.insert(inverses.end(), {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, -x, 0, 0, 1});
    gltf_.json["skins"] = {
        {{"joints", {0, 1, 2}}, {"inverseBindMatrices", gltf_.accessor(raw(inverses), 5126, "MAT4", 3)}}};
    gltf_.scene({0, 1, 2, 3});
  }

  json& primitive() { return gltf_.json["meshes"][0]["primitives"][0]; }
  void weigh(int set, const std::vector<uint16_t>& joints, const std::vector<float>& weights) {
    json& attributes = primitive()["attributes"];
    attributes["JOINTS_" + std::to_string(set)] =
        gltf_.accessor(raw(joints), 5123, "VEC4", joints.size() / 4);
    attributes["WEIGHTS_" + std::to_string(set)] =
        gltf_.accessor(raw(weights), 5126, "VEC4", weights.size() / 4);
  }
  void expect_refused(Status status, const std::string& part) const {
    try {
      read_kept(gltf_);
      ADD_FAILURE() << "was read; expected: " << part;
    } catch (const Error& error) {
      EXPECT_EQ(error.status(), status) << error.what();
      EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
    }
  }

  const std::vector<Float3> kCorners{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  Gltf gltf_;
};

TEST_F(KeptSkins, HaveJointsAndWeightsOfAVertex) {
  weigh(0, {7, 1, 0, 7, 2, 2, 2, 0, 1, 0, 0, 0}, {0, 3, 1, 0, 0, 0, 0, 0.5f, 1, 0, 0, 0});
  const Scene scene = read_kept(gltf_);
  ASSERT_EQ(scene.meshes.size(), 1u);
  EXPECT_TRUE(scene.notes.empty());
  EXPECT_EQ(scene.meshes[0].positions, kCorners);
  ASSERT_TRUE(scene.meshes[0].skin);
  const mesh::Skin& skin = *scene.meshes[0].skin;
  EXPECT_EQ(skin.influences, 4u);
  EXPECT_EQ(skin.joint_count, 3u);
  EXPECT_EQ(skin.number, 0u);
  EXPECT_EQ(skin.joints, (std::vector<uint16_t>{1, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0}));
  EXPECT_EQ(skin.weights, (std::vector<float>{0.75f, 0.25f, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0}));
  EXPECT_TRUE(skin.targets.empty());
  EXPECT_TRUE(scene.instances[0].deforms);
  EXPECT_FALSE(mesh::read("a.glb", gltf_.glb()).meshes[0].skin) << "only if asked for";
}

TEST_F(KeptSkins, ArePlacedWhereTheirJointsAgreeOrNearTheFirst) {
  const Scene posed = read_kept(gltf_);
  EXPECT_EQ(posed.instances[0].transform, mesh::kIdentity);
  gltf_.json["nodes"][1]["translation"] = {2, 0, 0};
  EXPECT_EQ(read_kept(gltf_).instances[0].transform, mesh::kIdentity);
  for (const int joint : {0, 1, 2}) gltf_.json["nodes"][joint]["scale"] = {0, 0, 0};
  gltf_.json["nodes"][0]["translation"] = {7, 8, 9};
  const Scene flat = read_kept(gltf_);
  ASSERT_EQ(flat.instances.size(), 1u) << "a clip may give it an area";
  EXPECT_EQ(flat.instances[0].transform, (mesh::Transform{1, 0, 0, 7, 0, 1, 0, 8, 0, 0, 1, 9}));
  EXPECT_EQ(flat.meshes[0].positions, kCorners);
}

TEST_F(KeptSkins, HaveUpToEightJointsForAVertex) {
  weigh(0, {0, 1, 2, 0, 1, 0, 0, 0, 1, 0, 0, 0}, {1, 1, 1, 1, 1, 0, 0, 0, 1, 0, 0, 0});
  weigh(1, {1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}, std::vector<float>(12));
  EXPECT_EQ(read_kept(gltf_).meshes[0].skin->influences, 4u) << "no vertex has more";
  weigh(1, {1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}, {4, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0});
  const Scene scene = read_kept(gltf_);
  const mesh::Skin& skin = *scene.meshes[0].skin;
  ASSERT_EQ(skin.influences, 8u);
  EXPECT_EQ(std::vector(skin.joints.begin(), skin.joints.begin() + 8),
            (std::vector<uint16_t>{0, 1, 2, 0, 1, 0, 0, 0}));
  EXPECT_EQ(std::vector(skin.weights.begin(), skin.weights.begin() + 8),
            (std::vector<float>{0.125f, 0.125f, 0.125f, 0.125f, 0.5f, 0, 0, 0}));
  EXPECT_EQ(skin.joints[8], 1);
  EXPECT_EQ(skin.weights[8], 1);
  EXPECT_TRUE(scene.notes.empty());

  weigh(1, {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}, {4, 4, 4, 4, 0, 0, 0, 0, 0, 0, 0, 0});
  weigh(2, {1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}, {12, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0});
  const Scene many = read_kept(gltf_);
  EXPECT_EQ(kinds_of_notes(many), std::vector{NoteKind::posed_skin});
  const mesh::Skin& largest = *many.meshes[0].skin;
  EXPECT_EQ(std::vector(largest.joints.begin(), largest.joints.begin() + 8),
            (std::vector<uint16_t>{1, 2, 0, 0, 0, 0, 0, 1}));
  EXPECT_EQ(largest.weights[7], 12.0f / 31);
}

TEST_F(KeptSkins, WithoutWeightsFollowTheFirstJoint) {
  weigh(0, {1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0}, {1, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0});
  const Scene loose = read_kept(gltf_);
  EXPECT_EQ(kinds_of_notes(loose), std::vector{NoteKind::pose});
  EXPECT_NE(loose.notes[0].text.find("a vertex without weights"), std::string::npos) << loose.notes[0].text;
  EXPECT_EQ(loose.meshes[0].skin->joints[4], 0);
  EXPECT_EQ(loose.meshes[0].skin->weights[4], 1);

  const float nan = std::numeric_limits<float>::quiet_NaN();
  const auto lost = [&](const std::string& why) {
    const Scene scene = read_kept(gltf_);
    EXPECT_EQ(kinds_of_notes(scene), std::vector{NoteKind::posed_skin}) << why;
    ASSERT_TRUE(scene.meshes[0].skin) << why;
    EXPECT_EQ(scene.meshes[0].skin->joints, std::vector<uint16_t>(12)) << why;
    for (size_t i = 0; i < 12; ++i)
      EXPECT_EQ(scene.meshes[0].skin->weights[i], i % 4 == 0 ? 1 : 0) << why << ' ' << i;
  };
  weigh(0, {1, 0, 0, 0, 3, 0, 0, 0, 1, 0, 0, 0}, {1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0});
  lost("joint 3 of 3");
  weigh(0, {1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0}, {1, 0, 0, 0, nan, 0, 0, 0, 1, 0, 0, 0});
  lost("a weight that is not a number");
  weigh(0, {1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0}, {1, 0, 0, 0, -1, 2, 0, 0, 1, 0, 0, 0});
  lost("a negative weight");
  weigh(0, {1, 0, 0, 0, 1, 0, 0, 0}, {1, 0, 0, 0, 1, 0, 0, 0});
  lost("too few");
  primitive()["attributes"]["WEIGHTS_0"] = 0;
  lost("not weights");
  primitive()["attributes"].erase("WEIGHTS_0");
  lost("none");
}

TEST_F(KeptSkins, AreLostIfTheirJointsCannotBeRead) {
  weigh(0, {1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0}, {1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0});
  std::vector<float> broken(48, std::numeric_limits<float>::quiet_NaN());
  const int matrices = gltf_.accessor(raw(broken), 5126, "MAT4", 3);
  for (const json& skin : {json{{"joints", {0, 99, 1}}}, json{{"joints", json::array()}},
                           json{{"inverseBindMatrices", matrices}}, json(5),
                           json{{"joints", {0, 1, 2}}, {"inverseBindMatrices", matrices}}}) {
    gltf_.json["skins"][0] = skin;
    const Scene scene = read_kept(gltf_);
    EXPECT_EQ(kinds_of_notes(scene), std::vector{NoteKind::posed_skin}) << skin;
    ASSERT_EQ(scene.meshes.size(), 1u);
    EXPECT_FALSE(scene.meshes[0].skin) << skin;
    EXPECT_EQ(scene.instances[0].transform, (mesh::Transform{1, 0, 0, 50, 0, 1, 0, 50, 0, 0, 1, 50})) << skin;
  }
}

TEST_F(KeptSkins, OfOneMeshMakeAMeshOfEach) {
  weigh(0, {1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0}, {1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0});
  json other = gltf_.json["skins"][0];
  gltf_.json["skins"].push_back(other);
  const json targets = {{{"POSITION", 0}}};
  primitive()["targets"] = targets;
  gltf_.json["scenes"][0]["nodes"].push_back(
      gltf_.node({{"mesh", 0}, {"skin", 0}, {"weights", {0.5}}, {"name", "the same skin"}}));
  gltf_.json["scenes"][0]["nodes"].push_back(gltf_.node({{"mesh", 0}, {"skin", 1}}));
  gltf_.json["scenes"][0]["nodes"].push_back(gltf_.node({{"mesh", 0}, {"name", "no skin"}}));
  const Scene scene = read_kept(gltf_);
  ASSERT_EQ(scene.meshes.size(), 3u);
  ASSERT_EQ(scene.instances.size(), 4u);
  EXPECT_EQ(scene.instances[0].mesh, scene.instances[1].mesh);
  EXPECT_EQ(scene.meshes[scene.instances[2].mesh].skin->number, 1u);
  const mesh::Skin& bare = *scene.meshes[scene.instances[3].mesh].skin;
  EXPECT_EQ(bare.number, mesh::kNoSkin);
  EXPECT_EQ(bare.influences, 0u);
  EXPECT_EQ(bare.targets, (std::vector<std::vector<Float3>>{kCorners}));
  EXPECT_EQ(mesh::first_alike(scene.meshes), (std::vector<uint32_t>{0, 0, 2}))
      << "skins with the same joints bend alike";
}

TEST_F(KeptSkins, HaveTheTargetsOfAllPrimitives) {
  gltf_.json["skins"] = json::array();
  gltf_.json["nodes"][3].erase("skin");
  const std::vector<Float3> up(3, {0, 4, 0}), square{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  primitive()["targets"] = {{{"POSITION", gltf_.positions(up)}}, {{"NORMAL", 0}}};
  // Of the second primitive, the last target is sparse, and without a buffer view.
  gltf_.json["accessors"].push_back(
      {{"componentType", 5126},
       {"type", "VEC3"},
       {"count", 4},
       {"sparse",
        {{"count", 1},
         {"indices", {{"bufferView", gltf_.view(raw(std::vector<uint16_t>{2}))}, {"componentType", 5123}}},
         {"values", {{"bufferView", gltf_.view(raw(std::vector<float>{7, 8, 9}))}}}}}});
  const size_t sparse = gltf_.json["accessors"].size() - 1;
  json second = {{"attributes", {{"POSITION", gltf_.positions(square)}}}, {"indices", 1}};
  second["targets"] = {json::object(), json::object(), {{"POSITION", sparse}}};
  gltf_.json["meshes"][0]["primitives"].push_back(second);
  gltf_.json["meshes"][0]["weights"] = {0.25, 0, 0.5, 9, 9};
  const Scene scene = read_kept(gltf_);
  EXPECT_TRUE(scene.notes.empty());
  ASSERT_EQ(scene.meshes[0].positions.size(), 7u);
  const mesh::Skin& skin = *scene.meshes[0].skin;
  EXPECT_EQ(skin.rest_weights, (std::vector<float>{0.25f, 0, 0.5f}));
  ASSERT_EQ(skin.targets.size(), 3u);
  for (size_t v = 0; v < 7; ++v) {
    EXPECT_EQ(skin.targets[0][v], v < 3 ? up[v] : Float3{}) << v;
    EXPECT_EQ(skin.targets[1][v], Float3{}) << v;
    EXPECT_EQ(skin.targets[2][v], (v == 5 ? Float3{7, 8, 9} : Float3{})) << v;
  }
  const std::vector<Float3> moved = mesh::bent(scene.meshes[0], {}, skin.rest_weights);
  EXPECT_EQ(moved, mesh::read("a.glb", gltf_.glb()).meshes[0].positions);
  EXPECT_EQ(moved[5], (Float3{4.5f, 5, 4.5f}));
}

TEST_F(KeptSkins, TargetsAreFlattenedWithTheirMesh) {
  gltf_.json["skins"] = json::array();
  gltf_.json["nodes"][3] = {{"mesh", 0}, {"scale", {2, 3, 0}}};
  primitive()["targets"] = {{{"POSITION", gltf_.positions({{1, 1, 1}, {0, 0, 0}, {0, 0, 2}})}}};
  const Scene scene = read_kept(gltf_);
  ASSERT_EQ(scene.instances.size(), 1u);
  const mesh::Mesh& flat = scene.meshes[scene.instances[0].mesh];
  EXPECT_EQ(flat.positions, (std::vector<Float3>{{0, 0, 0}, {2, 0, 0}, {0, 3, 0}}));
  EXPECT_EQ(flat.skin->targets[0], (std::vector<Float3>{{2, 3, 0}, {0, 0, 0}, {0, 0, 0}}));
}

TEST_F(KeptSkins, RefuseTargetsThatDoNotFit) {
  primitive()["targets"] = {{{"POSITION", gltf_.positions({{0, 0, 1}})}}};
  expect_refused(Status::malformed_mesh, "has 3 positions, but a morph target of 1");
  const float infinite = std::numeric_limits<float>::infinity();
  primitive()["targets"] = {{{"POSITION", gltf_.positions({{0, 0, 1}, {0, infinite, 0}, {0, 0, 0}})}}};
  expect_refused(Status::malformed_mesh, "morph target 0 with numbers that are not finite");
  primitive()["targets"] = {{{"POSITION", 0}}};
  gltf_.json["meshes"][0]["weights"] = {1e300};
  expect_refused(Status::malformed_mesh, "has the weight 1e+300");
  // A small file may have very many.
  gltf_.json["meshes"][0].erase("weights");
  primitive()["targets"] = std::vector<json>(1000, json{{"POSITION", 0}});
  EXPECT_EQ(read_kept(gltf_).meshes[0].skin->targets.size(), 1000u);
  EXPECT_THROW(mesh::read("a.glb", gltf_.glb(), {.max_triangles = 999, .skins = true}), Error);
}

}  // namespace
}  // namespace nif::test
