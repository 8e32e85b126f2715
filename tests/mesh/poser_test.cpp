// Poses of a scene by Poser, compared with files that are read at a moment.
#include "formats/mesh/poser.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>

#include "formats/base/status.hpp"
#include "mesh/merge/merge.hpp"
#include "tests/support/character.hpp"

namespace nif::test {
namespace {

using mesh::Moment;
using mesh::Poser;
using mesh::Scene;
using nlohmann::json;

constexpr const char* kTube = "tube.glb";

mesh::ReadLimits keeping_skins() { return {.skins = true}; }

/// At what a fixture says.
std::string error_of(const auto& work, Status status) {
  try {
    work();
  } catch (const Error& error) {
    EXPECT_EQ(error.status(), status) << error.what();
    return error.what();
  }
  ADD_FAILURE() << "nothing was thrown";
  return {};
}

TEST(PoserTest, BendsATubeAsTheReaderDoes) {
  const std::string bytes = tube_character().glb();
  for (const char* clip : {"sway", "swell"})
    for (const double time : {-1.0, 0.0, 0.2, 0.5, 0.7, 1.0, 1.2, 3.0})
      expect_posed_as_read(kTube, bytes, {clip, time});
}

TEST(PoserTest, HasJointsAndWeightsOfWhatBends) {
  const std::string bytes = tube_character(5, 8).glb();
  const Scene scene = mesh::read(kTube, bytes, keeping_skins());
  const Poser poser(kTube, bytes, scene, keeping_skins());
  ASSERT_EQ(poser.clips().size(), 2u);
  EXPECT_EQ(poser.clips()[1].name, "swell");
  EXPECT_EQ(poser.clips()[1].number, 1u);
  EXPECT_EQ(poser.clips()[0].end, 1.25);
  const auto posed = poser.at({"1", 1});
  ASSERT_EQ(posed.size(), 2u);
  EXPECT_TRUE(posed[0].joints.empty());
  EXPECT_TRUE(posed[0].weights.empty());
  EXPECT_EQ(posed[1].joints.size(), 8u);
  EXPECT_EQ(posed[1].weights, std::vector{1.0f});
  for (size_t i = 0; i < 12; ++i) {
    EXPECT_EQ(float(posed[1].transform[i]), scene.instances[1].transform[i]);
    EXPECT_NEAR(posed[1].joints[0][i], mesh::kIdentity[i], 1e-6) << "the first joint is where it was bound";
  }
  EXPECT_EQ(poser.at({"sway", 0.1})[1].weights, std::vector{0.25f}) << "of the mesh";
  EXPECT_EQ(poser.rest()[1].weights, std::vector{0.25f});
}

TEST(PoserTest, RestsAsTheSceneWasRead) {
  const std::string bytes = tube_character(5, 8).glb();
  mesh::ReadLimits limits = keeping_skins();
  limits.moment = Moment{"sway", 0.5};
  const Scene scene = mesh::read(kTube, bytes, limits);
  const Poser poser(kTube, bytes, scene, limits);
  const auto rest = poser.rest(), then = poser.at(*limits.moment);
  for (size_t i = 0; i < rest.size(); ++i) EXPECT_EQ(rest[i].joints, then[i].joints);
  for (size_t k = 0; k < 12; ++k)
    EXPECT_NEAR(rest[0].transform[k], scene.instances[0].transform[k], 1e-5) << "of the hat";
  // Another clip begins with the file, not with the moment.
  const Scene plain = mesh::read(kTube, bytes, keeping_skins());
  EXPECT_EQ(poser.at({"swell", 0})[0].transform,
            Poser(kTube, bytes, plain, keeping_skins()).at({"swell", 0})[0].transform);
}

TEST(PoserTest, MovesInstancesOfOneNode) {
  Gltf gltf = tube_character(5, 8);
  gltf.json["nodes"][8]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]["TRANSLATION"] =
      gltf.positions({{0, 0, 0}, {3, 0, 0}, {0, 4, 5}});
  expect_posed_as_read(kTube, gltf.glb(), {"sway", 0.7});
  expect_posed_as_read(kTube, gltf.glb(), {"swell", 0.3});
}

TEST(PoserTest, MovesWhatIsFlat) {
  Gltf gltf = tube_character(5, 8);
  gltf.json["nodes"][8]["scale"] = {1, 1e-5, 1};  // the reader moves its vertices
  const std::string bytes = gltf.glb();
  const Scene scene = mesh::read(kTube, bytes, keeping_skins());
  const auto posed = Poser(kTube, bytes, scene, keeping_skins()).at({"sway", 0});
  for (const mesh::Float3& p : scene.meshes[scene.instances[0].mesh].positions)
    for (size_t row = 0; row < 3; ++row) {
      double moved = posed[0].transform[4 * row + 3];
      for (size_t k = 0; k < 3; ++k) moved += posed[0].transform[4 * row + k] * double{p[k]};
      EXPECT_NEAR(moved, mesh::placed(scene.instances[0], p)[row], 1e-5);
    }
  // Without an inverse, only the origin moves.
  gltf.json["nodes"][8]["scale"] = {1, 0, 1};
  const std::string none = gltf.glb();
  const Scene flat = mesh::read(kTube, none, keeping_skins());
  const auto moved = Poser(kTube, none, flat, keeping_skins()).at({"sway", 0.5});
  EXPECT_EQ(moved[0].transform[0], 1);
  EXPECT_NE(float(moved[0].transform[3]), flat.instances[0].transform[3]);
}

TEST(PoserTest, NeedsNoNodesNorClips) {
  Gltf gltf = gltf_of({"m", {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}});
  gltf.json.erase("nodes");
  gltf.json.erase("scenes");
  gltf.json.erase("scene");
  gltf.json["meshes"][0]["primitives"][0]["targets"] = {{{"POSITION", 0}}};
  gltf.json["meshes"][0]["weights"] = {0.5};
  const std::string bytes = gltf.glb();
  const Scene scene = mesh::read(kTube, bytes, keeping_skins());
  EXPECT_EQ(Poser(kTube, bytes, scene, keeping_skins()).rest()[0].weights, std::vector{0.5f});

  const std::string obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  const Scene other = mesh::read("a.obj", obj, keeping_skins());
  const Poser still("a.obj", obj, other, keeping_skins());
  EXPECT_TRUE(still.clips().empty());
  EXPECT_EQ(still.rest().size(), 1u);
  error_of([&] { still.at({"go", 0}); }, Status::usage);
}

TEST(PoserTest, RefusesWhatDoesNotFit) {
  const std::string bytes = tube_character(5, 8).glb(), other = tube_character(5, 9).glb();
  const Scene scene = mesh::read(kTube, bytes, keeping_skins());
  error_of([&] { Poser(kTube, other, scene, keeping_skins()); }, Status::mesh_mismatch);
  error_of([&] { Poser(kTube, bytes, scene, {}); }, Status::usage);
  Scene strange = scene;
  strange.nodes[strange.instances[0].node].number = 99;
  error_of([&] { Poser(kTube, bytes, strange, keeping_skins()); }, Status::mesh_mismatch);
  const Poser poser(kTube, bytes, scene, keeping_skins());
  EXPECT_NE(error_of(
                [&] {
                  poser.at({"walk", 0});
                },
                Status::usage)
                .find("has no clip 'walk'"),
            std::string::npos);
}

TEST(PoserTest, RefusesPosesThatAreNotFinite) {
  Gltf gltf = tube_character(5, 8);
  const auto refused = [&](const std::string& clip, double time) {
    const std::string bytes = gltf.glb();
    const Scene scene = mesh::read(kTube, bytes, keeping_skins());
    const Poser poser(kTube, bytes, scene, keeping_skins());
    return error_of([&] { poser.at({clip, time}); }, Status::malformed_mesh);
  };
  const float large = 3e38f;
  add_channel(gltf, 0, "translation", {0, 1}, {0, 0, 0, large, large, large}, 3);
  EXPECT_NE(refused("swell", 1).find("is placed at infinity"), std::string::npos);
  add_channel(gltf, 10, "weights", {0, 1}, {0, std::numeric_limits<float>::infinity()}, 1);
  EXPECT_NE(refused("swell", 1).find("not finite"), std::string::npos);
  gltf.json["animations"][0]["samplers"][0]["interpolation"] = "WOBBLE";
  EXPECT_NE(refused("sway", 0).find("clip 'sway' has channels that cannot be read"), std::string::npos);
  EXPECT_EQ(mesh::read(kTube, gltf.glb(), keeping_skins()).meshes.size(), 2u) << "the file is read";
}

/// Expects that parts of a merged mesh bend as they do alone.
void expect_merged_alike(const Scene& whole, const std::vector<mesh::PosedInstance>& apart,
                         const Scene& merged, const std::vector<mesh::PosedInstance>& together) {
  ASSERT_EQ(together.size(), merged.instances.size());
  for (const mesh::MergedInstance& record : merged.merging->merged) {
    if (!merged.instances[record.instance].deforms) continue;
    const mesh::PosedInstance& posed = together[record.instance];
    EXPECT_EQ(posed.transform, apart[record.parts[0].instance].transform);
    std::vector<mesh::Float3> all;
    for (const mesh::MergedPart& part : record.parts) {
      const mesh::PosedInstance& alone = apart[part.instance];
      EXPECT_EQ(posed.joints, alone.joints);
      const auto bent = mesh::bent(whole.meshes[whole.instances[part.instance].mesh], alone.joints, {});
      all.insert(all.end(), bent.begin(), bent.end());
    }
    EXPECT_EQ(mesh::bent(merged.meshes[merged.instances[record.instance].mesh], posed.joints, {}), all);
  }
}

mesh::MergeOptions with_skins() {
  mesh::MergeOptions options = mesh::few_copies();
  options.skins = true;
  return options;
}

TEST(PoserTest, MovesWhatIsMergedBySkin) {
  Gltf gltf = tube_character(5, 8);
  json plain = gltf.json["meshes"][0];
  plain.erase("weights");
  plain["primitives"][0].erase("targets");
  json narrow = plain;
  narrow["primitives"][0]["attributes"].erase("JOINTS_1");
  narrow["primitives"][0]["attributes"].erase("WEIGHTS_1");
  gltf.json["skins"].push_back(gltf.json["skins"][0]);
  const auto add = [&](const json& shape, int skin, const char* name) {
    gltf.json["meshes"].push_back(shape);
    const int node = gltf.node({{"mesh", gltf.json["meshes"].size() - 1}, {"skin", skin}, {"name", name}});
    gltf.json["scenes"][0]["nodes"].push_back(node);
  };
  add(narrow, 0, "narrow");
  add(plain, 1, "of another skin");
  add(plain, 0, "plain");
  const std::string bytes = gltf.glb();
  const Scene whole = mesh::read(kTube, bytes, keeping_skins());
  ASSERT_EQ(whole.instances.size(), 5u);
  EXPECT_EQ(mesh::merge(whole, mesh::few_copies()).instances.size(), 5u) << "only if asked for";
  const Scene merged = mesh::merge(whole, with_skins());
  ASSERT_EQ(merged.instances.size(), 4u);
  ASSERT_EQ(merged.merging->merged.size(), 1u);
  EXPECT_EQ(merged.merging->stay[size_t(mesh::Stays::deforms)], 2u) << "targets, and another skin";
  const auto& parts = merged.merging->merged[0].parts;
  ASSERT_EQ(parts.size(), 2u);
  EXPECT_EQ(parts[0].name, "narrow");
  EXPECT_EQ(parts[1].name, "plain");
  const mesh::Mesh& both = merged.meshes[merged.instances[3].mesh];
  EXPECT_EQ(both.triangles.size(), parts[0].triangles + parts[1].triangles);
  ASSERT_TRUE(both.skin);
  EXPECT_EQ(both.skin->influences, 8u);
  EXPECT_EQ(both.skin->number, 0u);
  EXPECT_EQ(both.skin->weights.size(), 8 * both.positions.size());
  EXPECT_TRUE(merged.instances[3].deforms);
  const Poser apart(kTube, bytes, whole, keeping_skins()), together(kTube, bytes, merged, keeping_skins());
  for (const char* clip : {"sway", "swell"})
    expect_merged_alike(whole, apart.at({clip, 0.6}), merged, together.at({clip, 0.6}));
  mesh::MergeOptions small = with_skins();
  small.object_triangles = parts[0].triangles;
  EXPECT_EQ(mesh::merge(whole, small).instances.size(), 5u) << "too large";
}

/// The tube, and a second one with its skin, but without its target.
Gltf tube_with_plain() {
  Gltf gltf = tube_character(5, 8);
  json plain = gltf.json["meshes"][0];
  plain.erase("weights");
  plain["primitives"][0].erase("targets");
  gltf.json["meshes"].push_back(plain);
  gltf.json["scenes"][0]["nodes"].push_back(
      gltf.node({{"mesh", gltf.json["meshes"].size() - 1}, {"skin", 0}, {"name", "plain"}}));
  return gltf;
}

mesh::MergeOptions with_carried() {
  mesh::MergeOptions options = with_skins();
  options.carried = true;
  return options;
}

/// Expects that what joints carry is where it is without merging, but for rounding. Returns how many of its vertices were
/// compared.
size_t expect_carried_alike(const Scene& whole, const std::vector<mesh::PosedInstance>& apart,
                            const Scene& merged, const std::vector<mesh::PosedInstance>& together,
                            double within) {
  size_t compared = 0;
  for (const mesh::MergedInstance& record : merged.merging->merged) {
    const mesh::Mesh& own = merged.meshes[merged.instances[record.instance].mesh];
    if (!own.skin) continue;
    const mesh::PosedInstance& posed = together[record.instance];
    const std::vector<mesh::Float3> all = mesh::bent(own, posed.joints, {});
    const auto placed = [](const mesh::PosedInstance& instance, const mesh::Float3& p) {
      Double3 at;
      for (size_t row = 0; row < 3; ++row) {
        at[row] = instance.transform[4 * row + 3];
        for (size_t k = 0; k < 3; ++k) at[row] += instance.transform[4 * row + k] * double{p[k]};
      }
      return at;
    };
    size_t first = 0;
    for (const mesh::MergedPart& part : record.parts) {
      const mesh::Mesh& alone = whole.meshes[whole.instances[part.instance].mesh];
      for (size_t v = 0; !alone.skin && v < alone.positions.size(); ++v, ++compared) {
        const Double3 is = placed(posed, all[first + v]),
                      was = placed(apart[part.instance], alone.positions[v]);
        for (size_t a = 0; a < 3; ++a) EXPECT_NEAR(is[a], was[a], within) << part.name << " " << v;
      }
      first += alone.positions.size();
    }
    EXPECT_EQ(first, all.size());
  }
  return compared;
}

TEST(PoserTest, MovesWhatJointsCarry) {
  Gltf gltf = tube_with_plain();
  const auto joints = gltf.json["skins"][0]["joints"];
  const auto hang = [&](size_t joint, json node) {
    node["mesh"] = 1;
    const int number = gltf.node(node);
    gltf.json["nodes"][joints[joint].get<size_t>()]["children"].push_back(number);
    return number;
  };
  hang(3, {{"name", "badge"}, {"translation", {0.5, 0.25, 0}}, {"scale", {0.5, -0.25, 0.5}}});
  const int spinning = hang(4, {{"name", "wheel"}, {"translation", {1, 0, 0}}});
  add_channel(gltf, size_t(spinning), "rotation", {0, 1}, {0, 0, 0, 1, 0, 1, 0, 0}, 4);
  const std::string bytes = gltf.glb();
  const Scene whole = mesh::read(kTube, bytes, keeping_skins());
  ASSERT_EQ(whole.instances.size(), 5u) << "two tubes, a cube, a badge and a wheel";
  ASSERT_EQ(whole.skins.size(), 1u);
  EXPECT_EQ(whole.skins[0].joints.size(), 8u);
  EXPECT_EQ(mesh::merge(whole, with_skins()).merging->merged.size(), 0u) << "only if asked for";

  const Scene merged = mesh::merge(whole, with_carried());
  ASSERT_EQ(merged.merging->merged.size(), 1u);
  std::vector<std::string> names;
  for (const mesh::MergedPart& part : merged.merging->merged[0].parts) names.push_back(part.name);
  std::ranges::sort(names);
  EXPECT_EQ(names.size(), 3u) << "not the wheel, which turns by itself, nor what has targets";
  EXPECT_TRUE(std::ranges::count(names, "badge") == 1 && std::ranges::count(names, "plain") == 1);
  const mesh::Instance& instance = merged.instances[merged.merging->merged[0].instance];
  EXPECT_TRUE(instance.deforms);
  const Poser apart(kTube, bytes, whole, keeping_skins()), together(kTube, bytes, merged, keeping_skins());
  EXPECT_EQ(expect_carried_alike(whole, apart.rest(), merged, together.rest(), 1e-5), 16u);
  for (const char* clip : {"sway", "swell"})
    for (const double time : {0.0, 0.3, 0.9})
      EXPECT_EQ(expect_carried_alike(whole, apart.at({clip, time}), merged, together.at({clip, time}), 1e-5),
                16u);
  mesh::MergeOptions apart_by_name = with_carried();
  apart_by_name.except = {"badge"};
  EXPECT_EQ(mesh::merge(whole, apart_by_name).merging->merged[0].parts.size(), 2u);
  mesh::MergeOptions small = with_carried();
  small.object_triangles = 86;  // the tube has 80, and each cube 12
  EXPECT_EQ(mesh::merge(whole, small).merging->merged.size(), 0u) << "too large together";
}

/// Names of what merged with the tube, sorted.
std::vector<std::string> carried_with(const Gltf& gltf) {
  const Scene merged = mesh::merge(mesh::read(kTube, gltf.glb(), keeping_skins()), with_carried());
  std::vector<std::string> names;
  for (const mesh::MergedInstance& record : merged.merging->merged)
    for (const mesh::MergedPart& part : record.parts)
      if (merged.instances[record.instance].deforms) names.push_back(part.name);
  std::ranges::sort(names);
  return names;
}

TEST(PoserTest, LeavesWhatNoJointCanCarry) {
  Gltf gltf = tube_with_plain();
  const size_t count = carried_with(gltf).size();
  ASSERT_EQ(count, 2u) << "the tube and its cube";
  const auto joints = gltf.json["skins"][0]["joints"];
  const auto hang = [](Gltf& to, size_t parent, json node) {
    node["mesh"] = 1;
    const int number = to.node(node);
    to.json["nodes"][parent]["children"].push_back(number);
    return size_t(number);
  };
  Gltf root = gltf;
  root.json["scenes"][0]["nodes"].push_back(root.node({{"mesh", 1}, {"name", "ground"}}));
  EXPECT_EQ(carried_with(root).size(), count) << "no joint is above it";
  Gltf hinged = gltf;
  const size_t hinge = hang(hinged, joints[3].get<size_t>(), {{"name", "hinge"}});
  hang(hinged, hinge, {{"name", "lid"}, {"translation", {1, 0, 0}}});
  EXPECT_EQ(carried_with(hinged).size(), count + 2) << "a node that stays between them";
  add_channel(hinged, hinge, "rotation", {0, 1}, {0, 0, 0, 1, 0, 1, 0, 0}, 4);
  EXPECT_EQ(carried_with(hinged).size(), count) << "a node that moves between them";
  Gltf flat = gltf;
  json& joint = flat.json["nodes"][joints[4].get<size_t>()];
  joint["scale"] = {1, 0, 1};
  hang(flat, joints[4].get<size_t>(), {{"name", "badge"}});
  for (const std::string& name : carried_with(flat)) EXPECT_NE(name, "badge") << "its joint has no inverse";
}

/// Six skinned meshes and props on joints.
TEST(PoserTest, BendsTheKnightAsTheReaderDoes) {
  const char* games = std::getenv("NIF_TEST_GAMES");
  if (!games) GTEST_SKIP() << "NIF_TEST_GAMES is not set";
  const std::filesystem::path file = std::filesystem::path(games) / "knight/knight.glb";
  std::ifstream in(file, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(in), {}};
  const mesh::ReadLimits limits{.clips = true, .skins = true};
  const Scene scene = mesh::read(file, bytes, limits);
  const Poser poser(file, scene, limits);
  ASSERT_EQ(poser.clips().size(), 76u);
  ASSERT_EQ(scene.clips.size(), 76u);
  const Scene merged = mesh::merge(scene, with_skins());
  uint64_t bending = 0;
  for (const mesh::Instance& instance : merged.instances)
    if (instance.deforms) bending = bending * 1'000'000 + merged.meshes[instance.mesh].triangles.size();
  EXPECT_EQ(bending, 4148u) << "one mesh";
  const Poser of_merged(file, merged, limits);
  const Scene carried = mesh::merge(scene, with_carried());
  EXPECT_EQ(carried.instances.size(), 1u) << "with all that it holds and wears";
  const Poser of_carried(file, carried, limits);
  for (const mesh::Clip& clip : poser.clips()) {
    const double part = double(clip.number % 5) / 4;
    const Moment moment{clip.name, clip.begin + part * (clip.end - clip.begin)};
    expect_posed_as_read(scene, poser.at(moment), mesh::read(file, bytes, {.moment = moment}));
    expect_merged_alike(scene, poser.at(moment), merged, of_merged.at(moment));
    EXPECT_GT(expect_carried_alike(scene, poser.at(moment), carried, of_carried.at(moment), 1e-5), 1000u);
    if (HasFailure()) FAIL() << clip.name;
  }
}

}  // namespace
}  // namespace nif::test
