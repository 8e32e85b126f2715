// Merging: what merges and what stays, how far, and that every triangle is where it was.
#include "mesh/merge/merge.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <numeric>
#include <set>

#include "formats/base/status.hpp"
#include "formats/mesh/box.hpp"
#include "formats/mesh/flat_scene.hpp"
#include "formats/mesh/read.hpp"
#include "formats/mesh/transform.hpp"
#include "tests/support/gltf.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

using mesh::MergeOptions;
using mesh::Scene;
using mesh::Stays;

mesh::Transform at(float x, float y, float z) { return {1, 0, 0, x, 0, 1, 0, y, 0, 0, 1, z}; }

mesh::Instance instance(std::string name, uint32_t mesh, const mesh::Transform& transform) {
  return {std::move(name), mesh, transform};
}

/// `side` times `side` cubes in a square, each of 12 triangles, two units long, three apart.
Scene square_of_cubes(int side) {
  Scene scene;
  scene.meshes = {cube()};
  for (int x = 0; x < side; ++x)
    for (int y = 0; y < side; ++y)
      scene.instances.push_back(
          instance("cube " + std::to_string(x * side + y), 0, at(3 * float(x), 3 * float(y), 0)));
  return scene;
}

/// Merged meshes of at most this many triangles, and any number of copies.
MergeOptions objects_of(uint64_t triangles) {
  MergeOptions options;
  options.added_triangles = 1'000'000;
  options.part_triangles = options.object_triangles = triangles;
  return options;
}

/// The placed corners of all triangles, sorted: equal for a scene however it is split into meshes.
std::vector<std::array<mesh::Float3, 3>> triangles_of(const Scene& scene) {
  const mesh::Mesh all = mesh::flatten(scene, "");
  std::vector<std::array<mesh::Float3, 3>> triangles;
  for (const mesh::Triangle& t : all.triangles)
    triangles.push_back({all.positions[t[0]], all.positions[t[1]], all.positions[t[2]]});
  std::ranges::sort(triangles);
  return triangles;
}

uint64_t stay(const Scene& scene, Stays why) { return scene.merging->stay[size_t(why)]; }

/// Each instance of the file is in exactly one merged mesh, or counted as unmerged.
void expect_all_counted(const Scene& scene, size_t instances) {
  std::set<uint32_t> parts;
  for (const mesh::MergedInstance& merged : scene.merging->merged) {
    EXPECT_GE(merged.parts.size(), 2u);
    EXPECT_TRUE(std::ranges::is_sorted(merged.parts, {}, &mesh::MergedPart::instance));
    for (const mesh::MergedPart& part : merged.parts) EXPECT_TRUE(parts.insert(part.instance).second);
  }
  const auto& counts = scene.merging->stay;
  const uint64_t staying = std::accumulate(counts.begin(), counts.end(), uint64_t{0});
  EXPECT_EQ(scene.merging->instances, instances);
  EXPECT_EQ(parts.size() + staying, instances);
  EXPECT_EQ(scene.instances.size(), staying + scene.merging->merged.size());
}

TEST(Merge, GroupsBySpaceWithinTheMostTriangles) {
  const Scene before = square_of_cubes(8), after = mesh::merge(before, objects_of(4 * 12));
  expect_all_counted(after, 64);
  ASSERT_EQ(after.merging->merged.size(), 16u);
  ASSERT_EQ(after.meshes.size(), 16u) << "nothing places the cube itself";
  for (const mesh::MergedInstance& merged : after.merging->merged) {
    const mesh::Instance& placed = after.instances[merged.instance];
    EXPECT_EQ(placed.transform, mesh::kIdentity);
    EXPECT_EQ(placed.name, after.meshes[placed.mesh].name);
    const mesh::Mesh& mesh = after.meshes[placed.mesh];
    EXPECT_EQ(mesh.triangles.size(), 4u * 12);
    const mesh::Box box = mesh::bounds(mesh.positions, mesh.triangles);
    EXPECT_EQ(box.longest_side(), 5) << "two by two cubes, not four in a row";
    EXPECT_EQ(mesh.part_side, 2);
  }
  EXPECT_EQ(triangles_of(after), triangles_of(before));
  EXPECT_EQ(after.merging->added_triangles, 63u * 12);
  EXPECT_EQ(after.merging->merged[0].parts[1].name, "cube 1");
}

TEST(Merge, PlacesTurnsAndNamesWhatItMerges) {
  Scene scene;
  scene.meshes = {torus(24, 12), icosphere(1)};
  scene.instances = {instance("mirrored", 0, {-2, 0, 0, 5, 0, 1, 0, 0, 0, 0, 0.5f, 0}),
                     instance("turned", 1, {0, 1, 0, 3, -1, 0, 0, 0.1f, 0, 0, 3, 0}),
                     instance("as it is", 0, mesh::kIdentity)};
  const Scene after = mesh::merge(scene, objects_of(10'000));
  ASSERT_EQ(after.meshes.size(), 1u);
  EXPECT_EQ(after.meshes[0].triangles.size(),
            2 * scene.meshes[0].triangles.size() + scene.meshes[1].triangles.size());
  EXPECT_EQ(open_edges(after.meshes[0]), 0u);
  const double ring = signed_volume(scene.meshes[0]), ball = signed_volume(scene.meshes[1]);
  EXPECT_NEAR(signed_volume(after.meshes[0]), ring * (1 + 1) + ball * 3, 1e-4)
      << "mirrored ones face outwards, too";
  EXPECT_EQ(triangles_of(after), triangles_of(scene));
  ASSERT_EQ(after.merging->merged[0].parts.size(), 3u);
  EXPECT_EQ(after.merging->merged[0].parts[1].name, "turned");
}

TEST(Merge, OneAloneStaysAnInstance) {
  Scene scene = square_of_cubes(1);
  const Scene one = mesh::merge(scene, objects_of(1000));
  EXPECT_TRUE(one.merging->merged.empty());
  EXPECT_EQ(stay(one, Stays::alone), 1u);
  EXPECT_EQ(one.meshes.size(), 1u);
  EXPECT_EQ(one.instances[0].name, "cube 0");
  // Three that together exceed the limit: a pair and a single one.
  scene.instances.push_back(instance("near", 0, at(1, 0, 0)));
  scene.instances.push_back(instance("far", 0, at(100, 0, 0)));
  const Scene pair = mesh::merge(scene, objects_of(24));
  expect_all_counted(pair, 3);
  EXPECT_EQ(stay(pair, Stays::alone), 1u);
  ASSERT_EQ(pair.instances.size(), 2u);
  EXPECT_EQ(pair.instances[0].name, "far");
  EXPECT_EQ(pair.meshes.size(), 2u);
  EXPECT_EQ(triangles_of(pair), triangles_of(scene));
}

TEST(Merge, ManyAtOnePlaceAreHalvedAllTheSame) {
  Scene scene;
  scene.meshes = {cube()};
  for (int i = 0; i < 20'000; ++i) scene.instances.push_back(instance("same", 0, mesh::kIdentity));
  const Scene after = mesh::merge(scene, objects_of(1200));
  expect_all_counted(after, 20'000);
  EXPECT_GE(after.merging->merged.size(), 200u);
  EXPECT_LE(after.merging->merged.size(), 400u);
  for (const mesh::Mesh& mesh : after.meshes) EXPECT_LE(mesh.triangles.size(), 1200u);
}

TEST(Merge, UnevenWeightsEnd) {
  // Large and small meshes alternate, all on one line: no half is ever empty, and none too large.
  Scene scene;
  scene.meshes = {cube(), icosphere(2)};
  for (int i = 0; i < 3000; ++i)
    scene.instances.push_back(instance("thing", uint32_t(i % 7 == 0), at(0, 0, 0.01f * float(i * i % 997))));
  const Scene after = mesh::merge(scene, objects_of(330));
  expect_all_counted(after, 3000);
  for (const mesh::MergedInstance& merged : after.merging->merged)
    EXPECT_LE(after.meshes[after.instances[merged.instance].mesh].triangles.size(), 330u);
}

TEST(Merge, TheBudgetTakesMeshesOfFewTrianglesFirstAndEachWhole) {
  Scene scene;
  scene.meshes = {icosphere(1), cube(), icosphere(2), icosphere(2)};  // 80, 12, 320 and 320 triangles
  scene.meshes[3].positions[0][0] += 0.5f;
  for (uint32_t i = 0; i < 10; ++i)
    for (uint32_t mesh = 0; mesh < 3; ++mesh)
      scene.instances.push_back(
          instance("m" + std::to_string(mesh), mesh, at(3 * float(i), 3 * float(mesh), 0)));
  scene.instances.push_back(instance("only", 3, at(0, 20, 0)));
  const auto merged_names = [&](uint64_t budget) {
    MergeOptions options = objects_of(5000);
    options.added_triangles = budget;
    const Scene after = mesh::merge(scene, options);
    expect_all_counted(after, 31);
    EXPECT_LE(after.merging->added_triangles, budget);
    EXPECT_EQ(triangles_of(after), triangles_of(scene));
    std::map<std::string, size_t> names;
    for (const mesh::MergedInstance& merged : after.merging->merged)
      for (const mesh::MergedPart& part : merged.parts) ++names[part.name];
    return names;
  };
  using Names = std::map<std::string, size_t>;
  EXPECT_EQ(merged_names(0), Names{}) << "what is placed once has no neighbour";
  EXPECT_EQ(merged_names(9 * 12 - 1), Names{});
  EXPECT_EQ(merged_names(9 * 12), (Names{{"m1", 10}, {"only", 1}}));
  EXPECT_EQ(merged_names(9 * (12 + 80) - 1), (Names{{"m1", 10}, {"only", 1}}));
  EXPECT_EQ(merged_names(9 * (12 + 80)), (Names{{"m0", 10}, {"m1", 10}, {"only", 1}}));
  EXPECT_EQ(merged_names(9 * (12 + 80 + 320)), (Names{{"m0", 10}, {"m1", 10}, {"m2", 10}, {"only", 1}}));
}

TEST(Merge, EqualMeshesCountAsOne) {
  Scene scene;
  for (uint32_t i = 0; i < 10; ++i) {
    scene.meshes.push_back(cube());
    scene.instances.push_back(instance("copy", i, at(3 * float(i), 0, 0)));
  }
  MergeOptions options = objects_of(1000);
  options.added_triangles = 9 * 12 - 1;
  EXPECT_EQ(stay(mesh::merge(scene, options), Stays::over_budget), 10u)
      << "a bake would make one object of them";
  options.added_triangles = 9 * 12;
  EXPECT_EQ(mesh::merge(scene, options).merging->added_triangles, 9u * 12);
}

TEST(Merge, AMeshThatStaysElsewhereIsCopiedForEachThatMerges) {
  Scene scene = square_of_cubes(3);
  scene.instances[4].moves = true;
  MergeOptions options = objects_of(1000);
  options.added_triangles = 8 * 12 - 1;
  EXPECT_TRUE(mesh::merge(scene, options).merging->merged.empty());
  options.added_triangles = 8 * 12;
  const Scene after = mesh::merge(scene, options);
  EXPECT_EQ(after.merging->added_triangles, 8u * 12);
  ASSERT_EQ(after.instances.size(), 2u);
  EXPECT_EQ(after.instances[0].name, "cube 4") << "what moves stays apart";
  EXPECT_EQ(stay(after, Stays::moves), 1u);
}

TEST(Merge, ByDefaultAllCopiesOrNone) {
  MergeOptions options = objects_of(50'000);
  options.added_triangles = {};
  Scene scene = square_of_cubes(20);
  scene.meshes.push_back(icosphere(5));  // 20,480 triangles
  for (int i = 0; i < 49; ++i) scene.instances.push_back(instance("ball", 1, at(0, 0, 3 * float(i))));
  const Scene all = mesh::merge(scene, options);
  EXPECT_EQ(all.merging->options.added_triangles, mesh::kAddedTriangles);
  EXPECT_EQ(all.merging->added_triangles, 399u * 12 + 48 * 20'480);
  scene.instances.push_back(instance("one too many", 1, at(0, 3, 0)));
  scene.meshes.push_back(icosphere(0));
  scene.meshes.push_back(icosphere(1));
  scene.instances.push_back(instance("only", 2, at(0, 6, 0)));
  scene.instances.push_back(instance("only", 3, at(0, 9, 0)));
  const Scene none = mesh::merge(scene, options);
  EXPECT_EQ(none.merging->options.added_triangles, 0u);
  EXPECT_EQ(stay(none, Stays::over_budget), 450u);
  ASSERT_EQ(none.merging->merged.size(), 1u);
  EXPECT_EQ(none.merging->merged[0].parts.size(), 2u) << "what is placed once adds nothing";
}

TEST(Merge, WhatCannotBeMergedWellStays) {
  Scene scene = square_of_cubes(2);
  scene.instances.push_back(instance("flat", 0, {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0}));
  scene.instances.push_back(instance("far", 0, at(1e6f, 0, 0)));
  scene.instances.push_back(instance("farthest", 0, {3e38f, 0, 0, 3e38f, 0, 3e38f, 0, 0, 0, 0, 3e38f, 0}));
  scene.instances.push_back(instance("huge", 0, {1e15f, 0, 0, 0, 0, 1e15f, 0, 0, 0, 0, 1e15f, 0}));
  scene.instances.push_back(instance("just near enough", 0, at(8000, 0, 0)));
  const Scene after = mesh::merge(scene, objects_of(1000));
  expect_all_counted(after, 9);
  EXPECT_EQ(stay(after, Stays::flattened), 1u);
  EXPECT_EQ(stay(after, Stays::too_far), 3u);
  ASSERT_EQ(after.merging->merged.size(), 1u);
  EXPECT_EQ(after.merging->merged[0].parts.back().name, "just near enough");
}

TEST(Merge, MeshesThatAreNotSmallAreNotCopied) {
  Scene scene = square_of_cubes(3);
  scene.meshes.push_back(icosphere(0));
  scene.meshes.push_back(icosphere(2));  // 320 triangles
  scene.instances.push_back(instance("ball", 1, mesh::kIdentity));
  scene.instances.push_back(instance("ball", 1, at(9, 0, 0)));
  scene.instances.push_back(instance("placed once", 2, at(0, 9, 0)));
  MergeOptions options = objects_of(1000);
  options.part_triangles = 20;
  const Scene after = mesh::merge(scene, options);
  EXPECT_EQ(stay(after, Stays::large_copy), 2u);
  EXPECT_EQ(after.merging->merged[0].parts.size(), 10u);
  options.part_triangles = 21;
  EXPECT_EQ(mesh::merge(scene, options).merging->merged[0].parts.size(), 12u);
  options.object_triangles = 320;
  const Scene limited = mesh::merge(scene, options);
  EXPECT_EQ(stay(limited, Stays::too_large), 1u) << "an object of its own anyway";
  EXPECT_EQ(limited.merging->merged[0].parts.size(), 11u);
}

TEST(Merge, OnlyWhatIsPlacedOnceWhereCopiesAddMuch) {
  Scene scene = square_of_cubes(9);
  scene.meshes.insert(scene.meshes.end(), {icosphere(4), torus(40, 20), icosphere(2), icosphere(2)});
  scene.instances.push_back(instance("house", 1, at(0, 0, 9)));
  scene.instances.push_back(instance("road", 2, at(9, 0, 9)));
  scene.instances.push_back(instance("tree", 3, at(0, 9, 9)));
  scene.instances.push_back(instance("equal tree", 4, at(9, 9, 9)));
  const Scene after = mesh::merge(scene, mesh::few_copies());
  expect_all_counted(after, 85);
  EXPECT_EQ(after.merging->added_triangles, 0u);
  EXPECT_EQ(stay(after, Stays::over_budget), 83u);
  ASSERT_EQ(after.merging->merged.size(), 1u);
  EXPECT_EQ(after.merging->merged[0].parts[0].name, "house") << "of 5,120 triangles";
  EXPECT_EQ(after.merging->merged[0].parts[0].triangles, 5'120u);
  EXPECT_EQ(after.merging->merged[0].parts[1].name, "road");
  EXPECT_EQ(triangles_of(after), triangles_of(scene));
  scene.meshes[2].triangles.resize(mesh::kObjectTriangles, scene.meshes[2].triangles[0]);
  const Scene large = mesh::merge(scene, mesh::few_copies());
  EXPECT_TRUE(large.merging->merged.empty());
  EXPECT_EQ(stay(large, Stays::too_large), 1u);
  EXPECT_EQ(stay(large, Stays::alone), 1u);
}

TEST(Merge, FewCopiesAreMadeIfNothingIsAsked) {
  // 9 cubes of 12 triangles: 8 copies add 96.
  Scene scene = square_of_cubes(3);
  const auto with_road = [&](uint64_t triangles) {
    Scene all = scene;
    all.meshes.push_back(torus(40, 20));
    all.meshes.back().triangles.resize(triangles, all.meshes.back().triangles[0]);
    all.instances.push_back(instance("road", uint32_t(all.meshes.size() - 1), at(9, 0, 9)));
    return all;
  };
  const Scene few = mesh::merge(with_road(960), mesh::few_copies());
  expect_all_counted(few, 10);
  ASSERT_EQ(few.merging->merged.size(), 1u);
  EXPECT_EQ(few.merging->merged[0].parts.size(), 10u);
  EXPECT_EQ(few.merging->added_triangles, 96u);
  EXPECT_EQ(few.merging->options.added_triangles, 96u) << "which a file keeps";
  EXPECT_EQ(triangles_of(few), triangles_of(with_road(960)));
  const Scene repeated = mesh::merge(with_road(960), few.merging->options);
  EXPECT_EQ(repeated.merging->merged[0].parts.size(), 10u);

  const Scene many = mesh::merge(with_road(959), mesh::few_copies());
  EXPECT_TRUE(many.merging->merged.empty());
  EXPECT_EQ(stay(many, Stays::over_budget), 9u);
  EXPECT_EQ(stay(many, Stays::alone), 1u);
  EXPECT_EQ(many.merging->options.added_triangles, 0u);

  // All copies or none, and never those of large meshes.
  scene.meshes.push_back(icosphere(2));  // 320 triangles
  scene.meshes.push_back(icosphere(3));  // 1,280
  for (const uint32_t mesh : {1u, 1u, 2u, 2u}) scene.instances.push_back(instance("tree", mesh, at(0, 9, 9)));
  EXPECT_TRUE(mesh::merge(with_road(4150), mesh::few_copies()).merging->merged.empty());
  const Scene all = mesh::merge(with_road(4160), mesh::few_copies());
  EXPECT_EQ(all.merging->added_triangles, 96u + 320);
  EXPECT_EQ(stay(all, Stays::large_copy), 2u);
}

TEST(Merge, VerticesThatNoTriangleUsesCountInTheBudget) {
  Scene scene = square_of_cubes(3);
  scene.meshes[0].positions.resize(30'000);
  MergeOptions options = objects_of(1'000'000);
  options.added_triangles = 8 * 10'000 - 1;
  EXPECT_EQ(stay(mesh::merge(scene, options), Stays::over_budget), 9u);
}

TEST(Merge, ABudgetWithoutEndIsRefusedBeforeMemoryIs) {
  Scene scene;
  scene.meshes = {cube()};
  scene.meshes[0].triangles.resize(1'000'000, {0, 1, 2});
  for (int i = 0; i < 500'000; ++i) scene.instances.push_back(instance("same", 0, mesh::kIdentity));
  MergeOptions options = objects_of(~uint64_t{0});
  options.added_triangles = ~uint64_t{0};
  try {
    mesh::merge(scene, options);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.status(), Status::too_large) << error.what();
  }
}

/// A room with two lamps, one below a lever, a door with an animated handle, and a skinned and a morphing
/// mesh.
Gltf room() {
  Gltf gltf;
  const mesh::Mesh box = cube();
  std::vector<uint32_t> corners;
  for (const auto& t : box.triangles) corners.insert(corners.end(), t.begin(), t.end());
  const int shape = gltf.mesh(gltf.positions(box.positions), gltf.indices(corners), "shape");
  gltf.node({{"name", "room"}, {"children", {1, 2, 4, 6, 7, 8}}});
  gltf.node({{"name", "lamp 1"}, {"mesh", shape}});
  gltf.node({{"name", "lever"}, {"children", {3}}});
  gltf.node({{"name", "lamp 2"}, {"mesh", shape}, {"translation", {3, 0, 0}}});
  gltf.node({{"name", "door"}, {"mesh", shape}, {"translation", {6, 0, 0}}, {"children", {5}}});
  gltf.node({{"name", "handle"}, {"mesh", shape}, {"translation", {0, 3, 0}}});
  gltf.node({{"name", "guard"}, {"mesh", shape}, {"skin", 0}, {"translation", {9, 0, 0}}});
  gltf.node({{"name", "flag"}, {"mesh", shape}, {"translation", {12, 0, 0}}});
  gltf.node({{"mesh", shape}, {"translation", {15, 0, 0}}});
  gltf.json["skins"] = {{{"joints", {0}}}};
  const auto channel = [](nlohmann::json target) {
    return nlohmann::json{{"sampler", 0}, {"target", target}};
  };
  gltf.json["animations"] = {
      {{"samplers", nlohmann::json::array()},
       {"channels",
        {channel({{"node", 5}, {"path", "rotation"}}), channel({{"node", 7}, {"path", "weights"}})}}}};
  return gltf;
}

std::vector<std::string> merged_of(const Gltf& gltf, const MergeOptions& options) {
  const TempDir folder;
  const Scene after = mesh::merge(mesh::read(folder.write("room.glb", gltf.glb())), options);
  std::vector<std::string> names;
  for (const mesh::MergedInstance& merged : after.merging->merged)
    for (const mesh::MergedPart& part : merged.parts) names.push_back(part.name);
  std::ranges::sort(names);
  return names;
}

using Words = std::vector<std::string>;

TEST(Merge, WhatAFileAnimatesOrSkinsMoves) {
  EXPECT_EQ(merged_of(room(), objects_of(1000)), (Words{"door", "lamp 1", "lamp 2", "shape"}));
  Gltf lever = room();
  const nlohmann::json pointer = {{"pointer", "/nodes/2/rotation"}};
  lever.json["animations"][0]["channels"][0]["target"] = {
      {"path", "pointer"}, {"extensions", {{"KHR_animation_pointer", pointer}}}};
  EXPECT_EQ(merged_of(lever, objects_of(1000)), (Words{"door", "handle", "lamp 1", "shape"}))
      << "lamp 2 is below the lever";
}

/// A crane: a base and ground that stand still; an arm with a hook that turns with it; a wheel below the arm
/// that turns by itself, of a tyre and a rim; and a pulley that moves alone. All meshes differ.
struct Crane {
  Gltf gltf;
  Crane() {
    gltf.node({{"name", "base"}, {"mesh", box()}, {"children", {2, 8}}});
    gltf.node({{"name", "ground"}, {"mesh", box()}, {"translation", {0, -4, 0}}});
    gltf.node({{"name", "arm"},
               {"mesh", box()},
               {"translation", {2, 8, 0}},
               {"scale", {2, 2, 2}},
               {"children", {3, 5}}});
    gltf.node({{"name", "rope"}, {"children", {4}}, {"translation", {4, 0, 0}}});
    gltf.node({{"name", "hook"}, {"mesh", box()}, {"translation", {0, -0.5, 0}}});
    gltf.node({{"name", "wheel"}, {"children", {6, 7}}, {"translation", {0, 0, 3}}});
    gltf.node({{"name", "tyre"}, {"mesh", box()}, {"scale", {-1, 1, 1}}});
    gltf.node({{"name", "rim"}, {"mesh", box()}, {"translation", {1, 0, 0}}});
    gltf.node({{"name", "pulley"}, {"mesh", box()}, {"translation", {0, 0, 7}}});
    gltf.scene({0, 1});
    nlohmann::json channels = nlohmann::json::array();
    for (const int node : {2, 5, 8})
      channels.push_back({{"sampler", 0}, {"target", {{"node", node}, {"path", "rotation"}}}});
    gltf.json["animations"] = {{{"samplers", nlohmann::json::array()}, {"channels", channels}}};
  }

  int box() {
    mesh::Mesh shape = cube();
    ++count_;
    for (mesh::Float3& p : shape.positions)  // sums of these are exact
      for (float& x : p) x *= 1 + 0.125f * float(count_);
    std::vector<uint32_t> corners;
    for (const auto& t : shape.triangles) corners.insert(corners.end(), t.begin(), t.end());
    return gltf.mesh(gltf.positions(shape.positions), gltf.indices(corners));
  }
  Scene read() const {
    const TempDir folder;
    return mesh::read(folder.write("crane.glb", gltf.glb()));
  }

 private:
  int count_ = 0;
};

/// The names of the parts of each merged mesh.
std::vector<std::vector<std::string>> parts_of(const Scene& scene) {
  std::vector<std::vector<std::string>> all;
  for (const mesh::MergedInstance& merged : scene.merging->merged)
    std::ranges::transform(merged.parts, std::back_inserter(all.emplace_back()), &mesh::MergedPart::name);
  std::ranges::sort(all);
  return all;
}

using Parts = std::vector<std::vector<std::string>>;

TEST(Merge, WhatMovesTogetherIsOneObjectInThePlaceOfItsFirst) {
  const Scene before = Crane().read(), after = mesh::merge(before, mesh::few_copies());
  expect_all_counted(after, 7);
  EXPECT_EQ(parts_of(after), (Parts{{"arm", "hook"}, {"base", "ground"}, {"tyre", "rim"}}));
  EXPECT_EQ(stay(after, Stays::moves), 1u) << "the pulley";
  EXPECT_EQ(triangles_of(after), triangles_of(before));
  for (const mesh::MergedInstance& merged : after.merging->merged) {
    const mesh::Instance& placed = after.instances[merged.instance];
    const std::string& first = merged.parts.front().name;
    const mesh::Instance& part = *std::ranges::find(before.instances, first, &mesh::Instance::name);
    EXPECT_EQ(placed.moves, first != "base");
    EXPECT_EQ(placed.transform, first == "base" ? mesh::kIdentity : part.transform) << first;
    EXPECT_EQ(placed.node, first == "base" ? mesh::kNoNode : part.node) << first;
  }
}

TEST(Merge, WhatAnAnimationBelowSeparatesStays) {
  Crane crane;
  auto& channels = crane.gltf.json["animations"][0]["channels"];
  channels.push_back({{"sampler", 0}, {"target", {{"node", 3}, {"path", "translation"}}}});  // the rope
  channels.push_back({{"sampler", 0}, {"target", {{"node", 1}, {"path", "scale"}}}});        // the ground
  const Scene after = mesh::merge(crane.read(), mesh::few_copies());
  EXPECT_EQ(parts_of(after), (Parts{{"tyre", "rim"}}));
  EXPECT_EQ(stay(after, Stays::moves), 4u) << "arm, hook, ground and pulley";
  EXPECT_EQ(stay(after, Stays::alone), 1u) << "the base";
}

TEST(Merge, WithoutAnimationsAllIsOneObject) {
  Crane crane;
  crane.gltf.json.erase("animations");
  EXPECT_EQ(parts_of(mesh::merge(crane.read(), mesh::few_copies())),
            (Parts{{"base", "arm", "hook", "tyre", "rim", "pulley", "ground"}}));
}

/// Files keep the number of triangles that may be added, and scenes are merged by it again.
TEST(Merge, WhatIsNotCopiedHasNoPartInTheSpaceOfOthers) {
  Crane crane;
  auto& nodes = crane.gltf.json["nodes"];
  const nlohmann::json arm = nodes[2]["mesh"];
  const int copy = crane.gltf.node({{"name", "spare arm"}, {"mesh", arm}, {"translation", {0, 0, 50}}});
  nodes[1]["children"] = {copy};
  nodes[3]["mesh"] = crane.box();
  const Scene before = crane.read(), once = mesh::merge(before, mesh::few_copies()),
              again = mesh::merge(before, once.merging->options);
  EXPECT_EQ(once.merging->options.added_triangles, 0u);
  EXPECT_EQ(stay(once, Stays::over_budget), 2u) << "both arms";
  EXPECT_EQ(parts_of(once), (Parts{{"base", "ground"}, {"rope", "hook"}, {"tyre", "rim"}}));
  EXPECT_EQ(parts_of(again), parts_of(once));
  EXPECT_EQ(again.merging->stay, once.merging->stay);
  ASSERT_EQ(again.instances.size(), once.instances.size());
  for (size_t i = 0; i < once.instances.size(); ++i) {
    EXPECT_EQ(again.instances[i].transform, once.instances[i].transform) << once.instances[i].name;
    EXPECT_EQ(again.meshes[again.instances[i].mesh].positions, once.meshes[once.instances[i].mesh].positions);
  }
}

TEST(Merge, WhatDeformsStays) {
  Crane crane;
  crane.gltf.json.erase("animations");
  auto& meshes = crane.gltf.json["meshes"];
  meshes[1]["primitives"][0]["targets"] = {
      {{"POSITION", meshes[1]["primitives"][0]["attributes"]["POSITION"]}}};
  crane.gltf.json["nodes"][4]["skin"] = 0;
  crane.gltf.json["skins"] = {{{"joints", {0}}}};
  const Scene after = mesh::merge(crane.read(), mesh::few_copies());
  EXPECT_EQ(parts_of(after), (Parts{{"base", "arm", "tyre", "rim", "pulley"}}))
      << "ground morphs, hook is skinned";
  EXPECT_EQ(stay(after, Stays::deforms), 2u);
}

TEST(Merge, WhatIsInstancedStays) {
  Crane crane;
  crane.gltf.json.erase("animations");
  const int places = crane.gltf.positions({{0, 0, 0}, {0, 0, 5}});
  crane.gltf.json["nodes"][7]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]["TRANSLATION"] = places;
  const Scene after = mesh::merge(crane.read(), mesh::few_copies());
  EXPECT_EQ(parts_of(after), (Parts{{"base", "arm", "hook", "tyre", "pulley", "ground"}}));
  EXPECT_EQ(stay(after, Stays::over_budget), 2u) << "both rims";
}

TEST(Merge, BodiesOfPhysicsMove) {
  const auto with = [](const char* name, const char* body) {
    Crane crane;
    crane.gltf.json.erase("animations");
    crane.gltf.json["nodes"][2]["extensions"][name] = nlohmann::json::parse(body);
    return parts_of(mesh::merge(crane.read(), mesh::few_copies()));
  };
  const Parts apart{{"arm", "hook", "tyre", "rim"}, {"base", "pulley", "ground"}};
  EXPECT_EQ(with("KHR_physics_rigid_bodies", R"({"motion": {"mass": 3}})"), apart);
  EXPECT_EQ(with("OMI_physics_body", R"({"motion": {"type": "dynamic"}})"), apart);
  EXPECT_EQ(with("OMI_physics_body", R"({"motion": {"type": "kinematic"}})"), apart);
  for (const auto& [name, body] : {std::pair{"OMI_physics_body", R"({"motion": {"type": "static"}})"},
                                   {"OMI_physics_body", R"({"collider": {"shape": 0}})"},
                                   {"OMI_physics_body", "5"},
                                   {"KHR_physics_rigid_bodies", R"({"collider": {}})"},
                                   {"KHR_physics_rigid_bodies", "[]"}})
    EXPECT_EQ(with(name, body).size(), 1u) << name << body;
}

TEST(Merge, MalformedAnimationsMoveNothing) {
  for (const char* text :
       {"5", "[5]", "[{}]", R"([{"channels": 5}])", R"([{"channels": [5]}])",
        R"([{"channels": [{"target": 5}]}])", R"([{"channels": [{"target": {"node": -1}}]}])",
        R"([{"channels": [{"target": {"node": 1e99}}]}])", R"([{"channels": [{"target": {"node": 99999}}]}])",
        R"([{"channels": [{"target": {"extensions": {"KHR_animation_pointer": {"pointer": "/nodes/"}}}}]}])",
        R"([{"channels": [{"target": {"extensions": {"KHR_animation_pointer": {"pointer": 5}}}}]}])"}) {
    Gltf gltf = room();
    gltf.json["animations"] = nlohmann::json::parse(text);
    EXPECT_EQ(merged_of(gltf, objects_of(1000)),
              (Words{"door", "flag", "handle", "lamp 1", "lamp 2", "shape"}))
        << text;
  }
}

TEST(Merge, NamesCountForAllThatIsBelowANode) {
  MergeOptions options = objects_of(1000);
  options.nodes = {"lamp 1", "door"};
  EXPECT_EQ(merged_of(room(), options), (Words{"door", "lamp 1"})) << "the handle moves";
  options.nodes = {"lamp*", "sh?pe"};
  EXPECT_EQ(merged_of(room(), options), (Words{"lamp 1", "lamp 2", "shape"}));
  options.except = {"lever"};
  EXPECT_EQ(merged_of(room(), options), (Words{"lamp 1", "shape"}));
  options.nodes = {};
  EXPECT_EQ(merged_of(room(), options), (Words{"door", "lamp 1", "shape"}));
}

TEST(Merge, TellsWhichNamesNobodyHas) {
  Scene scene = square_of_cubes(3);
  scene.instances[5].name = "a[1]";
  MergeOptions options = objects_of(1000);
  options.nodes = {"cube*", "cubes", "cube 1"};
  options.except = {"a[1]", "b*"};
  const Scene after = mesh::merge(scene, options);
  EXPECT_EQ(after.merging->unmatched, (Words{"cubes", "b*"})) << "a[1] is also taken as it is written";
  EXPECT_EQ(stay(after, Stays::not_named), 1u);
}

}  // namespace
}  // namespace nif::test
