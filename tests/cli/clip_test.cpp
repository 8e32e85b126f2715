// What bends, from `nif bake --deforms` to `--clip` of nif eval, nif bench and nif render.
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "formats/base/status.hpp"
#include "tests/cli/mesh_text.hpp"
#include "tests/cli/program.hpp"
#include "tests/support/character.hpp"
#include "tests/support/pictures.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

using nlohmann::json;

class Clips : public testing::Test {
 protected:
  void SetUp() override {
    mesh_ = folder_.write("tube.glb", tube_character(12, 20).glb()).string();
    asset_ = path("tube.nif");
    const Outcome bake = nif({"bake", mesh_, "-o", asset_, "--deforms", "--rays", "2000", "--json"});
    ASSERT_EQ(bake.code, 0) << bake.err;
    baked_ = json::parse(bake.out);
  }
  std::string path(const char* name) const { return (folder_.path() / name).string(); }
  static json parsed(const std::vector<std::string>& words) {
    const Outcome outcome = nif(words);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    return json::parse(outcome.out);
  }
  static void expect_refused(const std::vector<std::string>& words, Status status, const std::string& why) {
    const Outcome outcome = nif(words);
    EXPECT_EQ(outcome.code, int(status)) << outcome.err;
    EXPECT_NE(outcome.err.find(why), std::string::npos) << outcome.err;
  }

  const TempDir folder_;
  std::string mesh_, asset_;
  json baked_;
};

TEST_F(Clips, BakeKeepsVerticesAndSkin) {
  json info = parsed({"info", asset_, "--json"});
  size_t bending = 0;
  for (const json& object : info["objects"]) {
    if (!object.contains("source_vertices")) continue;
    ++bending;
    EXPECT_EQ(object["encoding"], "bvh");
    EXPECT_EQ(object["joints"], 8);
    EXPECT_EQ(object["influences"], 8);
    EXPECT_EQ(object["targets"], 1);
  }
  EXPECT_EQ(bending, 1u);
  EXPECT_EQ(info["objects"].size(), 2u) << "the cube on the last joint is rigid";
  EXPECT_TRUE(info["metadata"]["options"]["deforms"].get<bool>());
  EXPECT_EQ(nif({"validate", asset_}).code, 0);
  // What bends keeps all triangles, also those without an area.
  const std::string cloth =
      folder_.write("cloth.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 1 0\nf 1 2 3\nf 2 4 3\nf 1 2 4\n").string();
  const Outcome baked = nif({"bake", cloth, "-o", path("cloth.nif"), "--deforms", "--strict", "--rays", "0"});
  ASSERT_EQ(baked.code, 0) << baked.err;
  EXPECT_EQ(baked.err.find("dropped"), std::string::npos) << baked.err;
  info = parsed({"info", path("cloth.nif"), "--json"});
  EXPECT_EQ(info["objects"][0]["source_vertices"], 4);
  EXPECT_EQ(info["objects"][0]["triangles"], 3);
  EXPECT_EQ(nif({"eval", path("cloth.nif"), "--mesh", cloth, "--rays", "100"}).code, 0) << "it is that mesh";
  // And their coordinates count, which a vertex that no triangle has does not.
  const std::string far = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1e18 0 0\nf 1 2 3\n";
  const std::string unused = folder_.write("unused.obj", far).string();
  EXPECT_EQ(nif({"bake", unused, "-o", path("far.nif"), "--deforms", "--rays", "0"}).code, 0);
  const std::string line = folder_.write("line.obj", far + "f 1 2 4\n").string();
  EXPECT_EQ(nif({"bake", line, "-o", path("far.nif"), "--rays", "0"}).code, 0) << "it is dropped";
  expect_refused({"bake", line, "-o", path("none.nif"), "--deforms", "--rays", "0"}, Status::too_large,
                 "too large for a BVH");
  EXPECT_FALSE(std::filesystem::exists(path("none.nif")));
}

TEST_F(Clips, EvalAndBenchMeasureFrames) {
  const json eval = parsed({"eval", asset_, "--mesh", mesh_, "--clip", "all", "--frames", "5", "--rays",
                            "5000", "--reference", "--hits", "--json"});
  EXPECT_EQ(eval["objects"].size(), 5u);
  EXPECT_EQ(eval["reference"]["different"], 0);
  EXPECT_EQ(eval["reference"]["different_hits"], 0);
  uint64_t rays = 0;
  for (const auto& [name, set] : eval["sets"].items()) {
    EXPECT_EQ(set["certain_wrong"], 0) << name;
    EXPECT_LE(set["error"].get<double>(), 1e-3) << name;
    rays += set["rays"].get<uint64_t>();
  }
  EXPECT_GT(rays, 20'000u);
  const json bench = parsed({"bench", asset_, "--mesh", mesh_, "--clip", "sway", "--frames", "3", "--rays",
                             "3000", "--rounds", "1", "--json"});
  EXPECT_EQ(bench["schema"], "nifkit.bench-clip/1");
  EXPECT_EQ(bench["frames"], 3);
  EXPECT_EQ(bench["bending"], 480);
  for (const auto& [name, set] : bench["sets"].items()) {
    EXPECT_EQ(set["wrong"], 0) << name;
    for (const char* kind : {"visibility", "first_hits"})
      for (const char* who : {"nif", "embree_refitted", "embree_rebuilt"})
        EXPECT_GT(set[kind][who].get<double>(), 0) << name;
  }
  for (const char* what : {"pose", "commit", "embree_refit", "embree_rebuild"})
    for (const char* of : {"median", "first"}) EXPECT_GT(bench["seconds"][what][of].get<double>(), 0) << what;
}

TEST_F(Clips, RenderShowsThePose) {
  const auto scene = [&](const char* more) {
    return folder_
        .write("scene.toml",
               "[picture]\nwidth = 48\nheight = 48\nsamples = 4\n[[light]]\ntype = \"sky\"\n"
               "[[camera]]\n[[object]]\nmesh = \"tube.glb\"\nnif = \"tube.nif\"\n" +
                   std::string(more))
        .string();
  };
  const auto picture = [&](const char* folder) {
    return read_bytes(folder_.path() / folder / "camera1-reference.png");
  };
  const json posed = parsed(
      {"render", scene("clip = \"sway\"\ntime = 0.6\n"), "-o", path("a"), "--primary", "asset", "--json"});
  const json psnr = posed["cameras"]["camera1"]["pictures"]["asset"]["psnr"];  // null: the pictures are equal
  EXPECT_TRUE(psnr.is_null() || psnr.get<double>() > 45) << posed;
  ASSERT_EQ(nif({"render", scene(""), "-o", path("b"), "--primary", "asset"}).code, 0);
  EXPECT_NE(picture("a"), picture("b"));
  ASSERT_EQ(nif({"render", mesh_, "-o", path("c"), "--clip", "sway", "--time", "0.6", "--width", "32",
                 "--height", "32", "--samples", "1"})
                .code,
            0);
  expect_refused({"render", scene("clip = \"none\"\n"), "-o", path("d")}, Status::usage, "none");
  expect_refused({"render", scene("time = 1\n"), "-o", path("d")}, Status::malformed_scene, "clip");
  expect_refused({"render", mesh_, "-o", path("d"), "--time", "1"}, Status::usage, "--clip");
}

TEST_F(Clips, BadInput) {
  const std::string stiff = path("stiff.nif");
  ASSERT_EQ(nif({"bake", mesh_, "-o", stiff, "--encoding", "bvh", "--rays", "0"}).code, 0);
  expect_refused({"eval", stiff, "--mesh", mesh_, "--clip", "sway"}, Status::usage, "--deforms");
  expect_refused({"eval", asset_, "--mesh", mesh_, "--clip", "walk"}, Status::usage, "'walk'");
  expect_refused({"eval", asset_, "--mesh", mesh_, "--clip", "sway", "--bvh"}, Status::usage, "--bvh");
  expect_refused({"eval", asset_, "--mesh", mesh_, "--clip", "sway", "--frames", "0"}, Status::usage,
                 "--frames");
  expect_refused({"bench", asset_, "--mesh", mesh_, "--clip", "sway", "--fallback", "embree"}, Status::usage,
                 "--fallback");
  for (const std::vector<std::string>& more :
       {std::vector<std::string>{"--encoding", "segment"}, {"--colors"}, {"--open-rays"}}) {
    std::vector<std::string> words{"bake", mesh_, "-o", path("x.nif"), "--deforms"};
    words.insert(words.end(), more.begin(), more.end());
    expect_refused(words, Status::usage, "--deforms");
  }
  expect_refused({"bake", mesh_, "-o", path("x.nif"), "--carry-props"}, Status::usage, "needs --deforms");
  expect_refused({"bake", mesh_, "-o", path("x.nif"), "--deforms", "--carry-props", "--no-merge"},
                 Status::usage, "--no-merge and --carry-props");
  expect_refused({"bake", mesh_, "-o", path("x.nif"), "--deforms", "--carry-props", "--max-bytes", "9999"},
                 Status::usage, "--carry-props needs --merge");
}

/// Of three meshes of one skin, one has holes: it stays apart and does not bend, and a note says so. The others do.
TEST_F(Clips, HolesStayApartAndAreSaid) {
  Gltf gltf = tube_character(12, 20);
  json& tube = gltf.json["meshes"][0];
  tube.erase("weights");
  tube["primitives"][0].erase("targets");
  gltf.json["animations"].erase(1);  // moves targets
  std::vector<float> places;
  for (int i = 0; i < 12 * 21; ++i) places.insert(places.end(), {float(i % 7) / 7, float(i % 5) / 5});
  const int coordinates = gltf.accessor(raw(places), 5126, "VEC2", 12 * 21);
  for (const char* name : {"coat", "hair"}) {
    json mesh = gltf.json["meshes"][0];
    mesh["name"] = name;
    const uint32_t first = name[0] == 'c' ? 24 : 48;
    json& primitive = mesh["primitives"][0];
    primitive["indices"] = gltf.indices({first, first + 5, first + 12, first + 1, first + 6, first + 13});
    if (name[0] == 'h') {
      primitive["attributes"]["TEXCOORD_0"] = coordinates;
      primitive["material"] = 0;
    }
    const auto number = int(gltf.json["meshes"].size());
    gltf.json["meshes"].push_back(mesh);
    gltf.json["scenes"][0]["nodes"].push_back(gltf.node({{"mesh", number}, {"skin", 0}, {"name", name}}));
  }
  std::vector<std::array<uint8_t, 4>> texels;
  for (int i = 0; i < 64; ++i) texels.push_back({255, 255, 255, uint8_t(i % 3 ? 255 : 0)});
  gltf.json["images"] = {{{"bufferView", gltf.view(png(8, 8, texels))}, {"mimeType", "image/png"}}};
  gltf.json["textures"] = {{{"source", 0}}};
  gltf.json["materials"] = {{{"name", "hair"},
                             {"alphaMode", "MASK"},
                             {"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}}};
  const std::string mesh = folder_.write("hair.glb", gltf.glb()).string(), asset = path("hair.nif");

  const Outcome baked = nif({"bake", mesh, "-o", asset, "--deforms", "--rays", "0"});
  ASSERT_EQ(baked.code, 0) << baked.err;
  EXPECT_NE(baked.err.find("'hair' has holes, so it does not bend; --ignore-alpha makes it solid"),
            std::string::npos)
      << baked.err;
  const auto bending = [&] {
    std::vector<std::string> names;
    const json info = parsed({"info", asset, "--json"});
    for (const json& object : info["objects"])
      if (object.contains("source_vertices")) names.push_back(object["name"]);
    return names;
  };
  EXPECT_EQ(bending(), std::vector<std::string>{"merged 1"});
  expect_refused({"bake", mesh, "-o", path("x.nif"), "--deforms", "--rays", "0", "--strict"},
                 Status::needs_repair, "'hair' has holes, so it does not bend");
  expect_refused({"eval", asset, "--mesh", mesh, "--clip", "sway", "--frames", "2", "--rays", "500"},
                 Status::usage, "its object 'hair' has holes, so no clip can pose it");

  // Solid, it is one with the others.
  ASSERT_EQ(nif({"bake", mesh, "-o", asset, "--deforms", "--rays", "0", "--ignore-alpha"}).code, 0);
  const json merged = parsed({"info", asset, "--json"})["metadata"]["merge"]["objects"];
  ASSERT_EQ(merged.size(), 1u);
  EXPECT_EQ(merged[0]["names"], (json{"tube", "coat", "hair"}));
  const json judged =
      parsed({"eval", asset, "--mesh", mesh, "--clip", "sway", "--frames", "2", "--rays", "500", "--json"});
  for (const auto& set : judged["sets"].items()) EXPECT_EQ(set.value()["certain_wrong"], 0) << set.key();
}

}  // namespace
}  // namespace nif::test
