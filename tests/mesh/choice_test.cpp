// Names that fit patterns, and parts of files that are chosen by them.
#include <gtest/gtest.h>

#include <set>

#include "formats/base/glob.hpp"
#include "formats/mesh/read.hpp"
#include "tests/support/gltf.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

using mesh::Choice;
using Words = std::vector<std::string>;

TEST(Glob, Patterns) {
  for (const auto& [name, pattern] :
       std::vector<std::pair<std::string, std::string>>{{"", ""},
                                                        {"", "*"},
                                                        {"abc", "abc"},
                                                        {"abc", "*"},
                                                        {"abc", "a?c"},
                                                        {"abc", "*c"},
                                                        {"abc", "a**"},
                                                        {"abcbc", "a*bc"},
                                                        {"a[1]", "a[1]"},
                                                        {"a1", "a[1]"},
                                                        {"a-", "a[b-]"},
                                                        {"b", "[a-c]"},
                                                        {"z", "[!a-c]"},
                                                        {"]", "[]]"},
                                                        {"a*", "a\\*"},
                                                        {"[", "["},
                                                        {"gr\u00fcn", "gr?n"},
                                                        {"\u00fc", "[\u00e4-\u00ff]"},
                                                        {"\xff", "?"},
                                                        {"a]", "a]"}})
    EXPECT_TRUE(fits(name, pattern)) << name << ' ' << pattern;
  for (const auto& [name, pattern] : std::vector<std::pair<std::string, std::string>>{{"a", ""},
                                                                                      {"", "?"},
                                                                                      {"abc", "ab"},
                                                                                      {"abc", "b*"},
                                                                                      {"abc", "*b"},
                                                                                      {"d", "[a-c]"},
                                                                                      {"b", "[!a-c]"},
                                                                                      {"ab", "a\\*"},
                                                                                      {"Abc", "abc"},
                                                                                      {"ab", "a[b"}})
    EXPECT_FALSE(fits(name, pattern)) << name << ' ' << pattern;
}

/// One stack frame, or a constant factor of time, per star would make this fail.
TEST(Glob, ManyStars) {
  const std::string name(100'000, 'a');
  std::string pattern;
  for (int i = 0; i < 50'000; ++i) pattern += "*a";
  EXPECT_TRUE(fits(name, pattern));
  EXPECT_FALSE(fits(std::string(2000, 'a'), pattern.substr(0, 2000) + "b"));
}

/// The remaining meshes by name, each with its number of triangles.
std::string chosen(const std::filesystem::path& file, const std::string& bytes, const Choice& choice) {
  mesh::ReadLimits limits;
  limits.choice = choice;
  try {
    const mesh::Scene scene = mesh::read(file, bytes, limits);
    EXPECT_EQ(scene.choice, choice);
    std::string text;
    for (const mesh::Instance& instance : scene.instances)
      text += (text.empty() ? "" : " ") + instance.name + ":" +
              std::to_string(scene.meshes[instance.mesh].triangles.size());
    return text;
  } catch (const Error& error) {
    return std::to_string(int(error.status())) + ": " + error.what();
  }
}

/// house { door, wall (2 primitives: brick, glass) }, tree (mesh "oak")
std::string garden() {
  Gltf gltf = gltf_of(cube());
  const nlohmann::json plain = gltf.json["meshes"][0];
  gltf.json["materials"] = {{{"name", "brick"}}, {{"name", "glass"}}};
  nlohmann::json wall = plain;
  wall["name"] = "wall";
  wall["primitives"].push_back(wall["primitives"][0]);
  wall["primitives"][0]["material"] = 0;
  wall["primitives"][1]["material"] = 1;
  nlohmann::json oak = plain;
  oak["name"] = "oak";
  gltf.json["meshes"] = {plain, wall, oak};
  gltf.json["nodes"] = {{{"name", "house"}, {"children", {1, 2}}},
                        {{"name", "door"}, {"mesh", 0}},
                        {{"name", "wall"}, {"mesh", 1}},
                        {{"name", "tree"}, {"mesh", 2}}};
  gltf.json["scenes"] = {{{"nodes", {0, 3}}}};
  gltf.json["scene"] = 0;
  return gltf.glb();
}

TEST(Choice, NodesMeshesAndMaterialsOfGltf) {
  const auto of = [](const Words& only, const Words& except) {
    return chosen("garden.glb", garden(), {only, except});
  };
  EXPECT_EQ(of({}, {}), "door:12 wall:24 tree:12");
  EXPECT_EQ(of({"house"}, {}), "door:12 wall:24");
  EXPECT_EQ(of({"house"}, {"d*"}), "wall:24");
  EXPECT_EQ(of({"oak"}, {}), "tree:12") << "a mesh";
  EXPECT_EQ(of({"glass"}, {}), "wall:12") << "a material";
  EXPECT_EQ(of({"glass", "tree"}, {}), "wall:12 tree:12");
  EXPECT_EQ(of({}, {"glass"}), "door:12 wall:12 tree:12");
  EXPECT_EQ(of({"house"}, {"glass", "oak"}), "door:12 wall:12");
  EXPECT_NE(of({"shed*"}, {}).find("no node, mesh or material has a name that matches 'shed*'"),
            std::string::npos);
  EXPECT_NE(of({"house"}, {"house"}).find("no chosen triangles"), std::string::npos);
}

TEST(Choice, ObjectsGroupsAndMaterialsOfObj) {
  const std::string file =
      "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"
      "f 1 2 3\no box\ng left side\nusemtl red\nf 1 2 3\nusemtl blue\nf 1 2 4\ng right\nf 1 3 4\no ball\nf 2 "
      "3 4\n";
  const auto of = [&](const Words& only, const Words& except) {
    return chosen("a.obj", file, {only, except});
  };
  EXPECT_EQ(of({}, {}), "a:1 box:3 ball:1");
  EXPECT_EQ(of({"box"}, {}), "box:3");
  EXPECT_EQ(of({"side"}, {}), "box:2");
  EXPECT_EQ(of({"right"}, {}), "box:1 ball:1") << "a group goes on into the next object";
  EXPECT_EQ(of({}, {"blue"}), "a:1 box:1");
  EXPECT_EQ(of({"red"}, {"box"}).substr(0, 3), std::to_string(int(Status::no_triangles)) + ":");
  EXPECT_NE(of({"green"}, {}).find("'green'"), std::string::npos);
}

TEST(Choice, SolidsOfStl) {
  const std::string facet =
      "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n";
  const std::string file =
      "solid one\n" + facet + "endsolid one\nsolid two\n" + facet + facet + "endsolid two\n";
  EXPECT_EQ(chosen("a.stl", file, {{"two"}, {}}), "two:2");
  EXPECT_EQ(chosen("a.stl", file, {{}, {"t*"}}), "one:1");
}

TEST(Choice, FormatsWithoutNamesHaveNothingToChoose) {
  const std::string off = "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
  EXPECT_NE(chosen("a.off", off, {{}, {"x"}}).find("matches 'x'"), std::string::npos);
}

}  // namespace
}  // namespace nif::test
