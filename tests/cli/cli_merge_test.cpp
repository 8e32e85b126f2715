// `nif bake --merge` and the programs that read its assets: they merge the mesh file in the same way, or say
// why not.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "formats/base/status.hpp"
#include "formats/mesh/gltf/gltf_writer.hpp"
#include "tests/cli/mesh_text.hpp"
#include "tests/cli/program.hpp"
#include "tests/format/damaged.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

using nlohmann::json;

/// 100 cubes and small balls in a square, every fifth mirrored and stretched, and two rings of many triangles.
std::string field() {
  mesh::Scene scene;
  scene.meshes = {cube(), icosphere(1), torus(40, 20)};
  scene.meshes[1].name = "ball";
  for (uint32_t i = 0; i < 100; ++i) {
    mesh::Instance& instance = scene.instances.emplace_back();
    instance.mesh = i % 2;
    instance.name = scene.meshes[instance.mesh].name + "." + std::to_string(i);
    instance.transform = {0.7f, 0.1f, 0, 3 * float(i % 10), 0, 0.8f, 0, 0, 0.2f, 0, 0.6f, 3 * float(i / 10)};
    if (i % 5 == 0) instance.transform[0] = -1.3f;
  }
  scene.instances.push_back({"ring", 2, {9, 0, 0, 15, 0, 9, 0, 0, 0, 0, 9, 15}});
  scene.instances.push_back({"ring above", 2, {9, 0, 0, 15, 0, 9, 0, 5, 0, 0, 9, 15}});
  const std::vector<std::byte> bytes = mesh::encode_glb(scene);
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

class MergedAsset : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TempDir;
    glb_ = folder_->write("field.glb", field()).string();
    asset_ = path("field.nif");
    baked_ = bake(asset_, {"--merge"});
    ASSERT_EQ(baked_.code, 0) << baked_.err;
  }
  static void TearDownTestSuite() { delete folder_; }

  static std::string path(const std::string& name) { return (folder_->path() / name).string(); }
  static Outcome bake(const std::string& asset, std::vector<std::string> more) {
    more.insert(more.begin(), {"bake", glb_, "-o", asset, "--encoding", "bvh", "--rays", "0"});
    return nif(more);
  }
  static json info(const std::string& asset) { return json::parse(nif({"info", asset, "--json"}).out); }

  void refused(const std::vector<std::string>& options, const std::string& words) const {
    SCOPED_TRACE(testing::PrintToString(options));
    const std::vector<std::string> before = listing(folder_->path());
    const Outcome outcome = bake(path("none.nif"), options);
    EXPECT_EQ(outcome.code, int(Status::usage)) << outcome.err;
    EXPECT_NE(outcome.err.find(words), std::string::npos) << outcome.err;
    EXPECT_EQ(without_progress(outcome.err).size(), 1u) << outcome.err;
    EXPECT_EQ(listing(folder_->path()), before);
  }

  /// The asset with other metadata; the rest stays valid.
  std::string changed(const json& metadata) const { return changed(metadata.dump()); }
  std::string changed(const std::string& text) const {
    const std::string bytes = read_bytes(asset_);
    const auto as_bytes = [](const std::string& from) {
      const auto span = std::as_bytes(std::span(from));
      return Bytes(span.begin(), span.end());
    };
    std::vector<Part> parts = parts_of(as_bytes(bytes));
    std::ranges::find(parts, uint32_t(format::kMetadata), &Part::type)->content = as_bytes(text);
    const Bytes file = file_of(as_bytes(bytes), parts);
    return folder_->write("changed.nif", {reinterpret_cast<const char*>(file.data()), file.size()}).string();
  }

  static inline TempDir* folder_ = nullptr;
  static inline std::string glb_, asset_;
  static inline Outcome baked_;
};

TEST_F(MergedAsset, SaysWhatWasMerged) {
  EXPECT_NE(
      baked_.out.find("merged 100 of 102 instances, which do not move against each other, into 1 object; "
                      "2 stay: 2 share their meshes of 500 triangles or more\n"),
      std::string::npos)
      << baked_.out;
  const json described = info(asset_);
  ASSERT_EQ(described["objects"].size(), 2u);
  ASSERT_EQ(described["instances"].size(), 3u);
  EXPECT_EQ(described["instances"][0]["name"], "ring");
  EXPECT_EQ(described["instances"][2]["name"], "merged 1");
  const json& metadata = described["metadata"];
  EXPECT_EQ(metadata["hierarchy"]["instances"], json::parse("[100, 101, null]"));
  const json& merge = metadata["merge"];
  EXPECT_EQ(merge["added_triangles"], 1'000'000);
  EXPECT_EQ(merge["part_triangles"], 500);
  EXPECT_FALSE(merge.contains("nodes")) << "all";
  ASSERT_EQ(merge["objects"].size(), 1u);
  EXPECT_EQ(merge["objects"][0]["instance"], 2);
  ASSERT_EQ(merge["objects"][0]["names"].size(), 100u);
  EXPECT_EQ(merge["objects"][0]["names"][42], "cube.42");
  EXPECT_EQ(merge["objects"][0]["nodes"][42], 42);
  EXPECT_EQ(merge["objects"][0]["triangles"][42], 12);
  const std::string text = nif({"info", asset_}).out;
  EXPECT_NE(text.find("merged    'merged 1': 100 instances, which do not move against each other (cube.0, "
                      "ball.1, cube.2, ball.3, ...)\n"),
            std::string::npos)
      << text;
}

TEST_F(MergedAsset, JsonCountsWhatStays) {
  const Outcome outcome = bake(path("some.nif"), {"--merge", "--merge-nodes", "cube*", "--merge-triangles",
                                                  "0.5k", "--json", "-j", "1"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const json merge = json::parse(outcome.out)["merge"];
  EXPECT_EQ(merge["instances"], 102);
  EXPECT_EQ(merge["merged"], 0);
  EXPECT_EQ(merge["stay"]["over_budget"], 50);
  EXPECT_EQ(merge["stay"]["not_named"], 52);
  EXPECT_EQ(merge["settings"]["added_triangles"], 500);
  EXPECT_NE(outcome.err.find("--merge: nothing was merged; 102 stay: 52 are not named, 50 would exceed "
                             "--merge-triangles 500"),
            std::string::npos)
      << outcome.err;
  ASSERT_EQ(bake(path("plain.nif"), {}).code, 0);
  EXPECT_EQ(read_bytes(path("some.nif")), read_bytes(path("plain.nif"))) << "a scene as it is";
}

TEST_F(MergedAsset, WithoutCopiesOnlyWhatIsPlacedOnceMerges) {
  const Outcome outcome = bake(path("none.nif"), {"--merge", "--merge-triangles", "0"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_NE(
      outcome.err.find("nothing was merged; 102 stay: 102 share their meshes, and --merge-triangles allows "
                       "no copies"),
      std::string::npos)
      << outcome.err;
  std::filesystem::remove(path("none.nif"));
}

TEST_F(MergedAsset, TheSameBytesForAnyNumberOfThreads) {
  ASSERT_EQ(bake(path("one.nif"), {"--merge", "-j", "1"}).code, 0);
  EXPECT_EQ(read_bytes(path("one.nif")), read_bytes(asset_));
}

TEST_F(MergedAsset, IsMeasuredOnTheSceneAsItWasMerged) {
  const Outcome eval = nif({"eval", asset_, "--mesh", glb_, "--rays", "20000", "--json"});
  ASSERT_EQ(eval.code, 0) << eval.err;
  const json sets = json::parse(eval.out)["sets"];
  for (const auto& [name, set] : sets.items()) EXPECT_LT(set["error"].get<double>(), 1e-3) << name;
  const Outcome bench = nif({"bench", glb_, "--asset", asset_, "--rays", "3000", "--rounds", "2", "-j", "1",
                             "--moved", "0", "--json"});
  ASSERT_EQ(bench.code, 0) << bench.err;
  const json result = json::parse(bench.out);
  EXPECT_EQ(result["instances"], 3);
  for (const auto& [name, set] : result["sets"].items()) EXPECT_LT(set["error"].get<double>(), 2e-3) << name;
  const Outcome alone =
      nif({"bench", asset_, "--mesh", glb_, "--rays", "3000", "--rounds", "2", "-j", "1", "--quiet"});
  EXPECT_EQ(alone.code, 0) << alone.err;
  const std::string scene =
      folder_
          ->write("scene.toml",
                  "[[object]]\nmesh = \"field.glb\"\nnif = \"field.nif\"\n"
                  "[[camera]]\n[picture]\nwidth = 32\nheight = 24\nsamples = 4\n[[light]]\ntype = \"sky\"\n")
          .string();
  const Outcome render = nif({"render", scene, "-o", path("pictures"), "--json"});
  ASSERT_EQ(render.code, 0) << render.err;
  const json cameras = json::parse(render.out)["cameras"];
  for (const auto& [name, camera] : cameras.items()) EXPECT_LT(camera["error"].get<double>(), 1e-3) << name;
}

TEST_F(MergedAsset, IsNotThatOfAnotherMeshFile) {
  mesh::Scene scene;
  scene.meshes = {cube()};
  for (int i = 0; i < 3; ++i)
    scene.instances.push_back({"cube", 0, {1, 0, 0, 3 * float(i), 0, 1, 0, 0, 0, 0, 1, 0}});
  const std::vector<std::byte> bytes = mesh::encode_glb(scene);
  const std::string other =
      folder_->write("other.glb", {reinterpret_cast<const char*>(bytes.data()), bytes.size()}).string();
  const Outcome eval = nif({"eval", asset_, "--mesh", other});
  EXPECT_EQ(eval.code, int(Status::mesh_mismatch));
  EXPECT_NE(eval.err.find("was not baked from"), std::string::npos) << eval.err;
}

TEST_F(MergedAsset, MetadataMayBeAnything) {
  const json whole = info(asset_)["metadata"];
  const auto with = [&](const char* key, const json& value) {
    json metadata = whole;
    (key ? metadata["merge"][key] : metadata["merge"]) = value;
    return changed(metadata);
  };
  EXPECT_EQ(nif({"eval", changed(whole), "--mesh", glb_, "--rays", "10"}).code, 0);
  for (const auto& [key, value, words] :
       {std::tuple{"added_triangles", json(-1), "'added_triangles' is no count"},
        {"added_triangles", json("many"), "'added_triangles' is no count"},
        {"part_triangles", json(1.5), "'part_triangles' is no count"},
        {"object_triangles", json(nullptr), "'object_triangles' is no count"},
        {"nodes", json(5), "'nodes' is no array"},
        {"except", json::parse("[[]]"), "'except' has an entry that is no text"},
        {static_cast<const char*>(nullptr), json(5), "'merge' is no object"}}) {
    const std::string file = with(key, value);
    const Outcome eval = nif({"eval", file, "--mesh", glb_});
    EXPECT_EQ(eval.code, int(Status::mesh_mismatch)) << eval.err;
    EXPECT_NE(eval.err.find(words), std::string::npos) << eval.err;
    EXPECT_NE(eval.err.find(file), std::string::npos) << eval.err;
    EXPECT_EQ(nif({"info", file}).code, 0);
  }
  for (const char* key : {"added_triangles", "part_triangles", "object_triangles"})
    for (const json& value : {json(0), json(1), json(~uint64_t{0})}) {
      const Outcome eval = nif({"eval", with(key, value), "--mesh", glb_, "--rays", "10"});
      EXPECT_TRUE(eval.code == int(Status::mesh_mismatch) || eval.code == 0) << key << value << eval.err;
    }
}

/// Code that copies or writes a value recurses, so its depth is limited first.
TEST_F(MergedAsset, MetadataMayBeNestedDeeply) {
  const std::string nested = std::string(300'000, '[') + std::string(300'000, ']');
  for (const std::string& text :
       {nested, "{\"merge\":" + nested + '}', "{\"tool\":{\"name\":" + nested + "}}"}) {
    const std::string file = changed(text);
    EXPECT_EQ(nif({"info", file}).code, 0);
    const Outcome described = nif({"info", file, "--json"});
    EXPECT_EQ(described.code, 0) << described.err;
    EXPECT_TRUE(json::parse(described.out)["metadata"].is_null());
    const Outcome validated = nif({"validate", file});
    EXPECT_EQ(validated.code, int(Status::damaged_nif)) << validated.err;
    EXPECT_NE(validated.out.find("error 801"), std::string::npos) << validated.out;
    EXPECT_EQ(nif({"eval", file, "--mesh", glb_, "--rays", "10"}).code, int(Status::mesh_mismatch));
    EXPECT_EQ(nif({"attach", glb_, file, "-o", path("both.glb")}).code, int(Status::mesh_mismatch));
  }
}

TEST_F(MergedAsset, CannotBeAttached) {
  for (const std::vector<std::string>& more : {std::vector<std::string>{}, {"--force"}}) {
    std::vector<std::string> arguments{"attach", glb_, asset_, "-o", path("both.glb")};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Outcome outcome = nif(arguments);
    EXPECT_EQ(outcome.code, int(Status::usage));
    EXPECT_NE(outcome.err.find("bake it with --no-merge"), std::string::npos) << outcome.err;
    EXPECT_FALSE(std::filesystem::exists(path("both.glb")));
  }
}

TEST_F(MergedAsset, ContradictionsAreNamed) {
  refused({"--merge-below", "1k"}, "--merge-below needs --merge");
  refused({"--merge-triangles", "1M"}, "--merge-triangles needs --merge");
  refused({"--merge", "--merge-below", "0"}, "--merge-below 0 and --merge");
  refused({"--no-merge", "--merge"}, "--no-merge and --merge contradict each other");
  refused({"--no-merge", "--merge-except", "cube*"}, "--no-merge and --merge-except contradict each other");
  refused({"--no-merge", "--merge-below", "9"}, "--no-merge and --merge-below contradict each other");
  refused({"--merge-except", "cub"}, "no node has a name that matches 'cub'");
  refused({"--max-bytes", "1MB", "--merge-except", "cube*"},
          "--merge-except needs --merge here: with --max-bytes, nothing is merged by default");
  refused({"--merge", "--merge-triangles", "some"}, "--merge-triangles 'some' is not a number");
  refused({"--merge", "--merge-triangles", "1kB"}, "--merge-triangles '1kB' is not a count: write 500000");
  refused({"--merge", "--merge-nodes", "cub"}, "no node has a name that matches 'cub'");
  refused({"--merge", "--merge-nodes", "cube*", "--merge-except", "lamp"},
          "no node has a name that matches 'lamp'");
}

TEST_F(MergedAsset, ViewsAreOfTheSceneAsItIs) {
  const Outcome outcome =
      nif({"bake", glb_, "-o", path("none.nif"), "--preset", "paper", "--view", "scene.toml", "--merge"});
  EXPECT_EQ(outcome.code, int(Status::usage));
  EXPECT_NE(outcome.err.find("--merge and --view"), std::string::npos) << outcome.err;
}

TEST_F(MergedAsset, ManifestsHaveTheSameKeys) {
  const std::string manifest =
      folder_
          ->write("library.toml",
                  "[defaults]\nencoding = \"bvh\"\nrays = 0\nmerge = true\n"
                  "[[asset]]\nmesh = \"field.glb\"\noutput = \"out/all.nif\"\n"
                  "[[asset]]\nmesh = \"field.glb\"\noutput = \"out/some.nif\"\n"
                  "merge-nodes = [\"ball*\", \"cube.1?\"]\nmerge-except = \"ball.1\"\n"
                  "merge-triangles = \"900k\"\n")
          .string();
  const Outcome outcome = nif({"bake", "--manifest", manifest, "--json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(read_bytes(path("out/all.nif")), read_bytes(asset_));
  ASSERT_EQ(bake(path("some-here.nif"), {"--merge", "--merge-nodes", "ball*", "--merge-nodes", "cube.1?",
                                         "--merge-except", "ball.1", "--merge-triangles", "900k"})
                .code,
            0);
  EXPECT_EQ(read_bytes(path("out/some.nif")), read_bytes(path("some-here.nif")));
  const json merge = info(path("out/some.nif"))["metadata"]["merge"];
  EXPECT_EQ(merge["nodes"], json::parse(R"(["ball*", "cube.1?"])"));
  EXPECT_EQ(merge["objects"][0]["names"].size(), 49u + 5u);
}

/// What is merged if nothing is asked for.
class MergedByDefault : public testing::Test {
 protected:
  MergedByDefault() : town_(town("town.glb", icosphere(2))) {}

  /// A house, a tower and ground, placed once each, and three trees.
  std::string town(const char* name, const mesh::Mesh& tree) {
    mesh::Scene scene;
    scene.meshes = {icosphere(3), torus(40, 20), cube(), tree};
    scene.instances = {{"house", 0, {1, 0, 0, 5, 0, 1, 0, 0, 0, 0, 1, 0}},
                       {"tree.1", 3, {1, 0, 0, 0, 0, 1, 0, 5, 0, 0, 1, 0}},
                       {"tower", 1, {1, 0, 0, -5, 0, 1, 0, 0, 0, 0, 1, 0}},
                       {"tree.2", 3, {1, 0, 0, 3, 0, 1, 0, 5, 0, 0, 1, 0}},
                       {"ground", 2, {9, 0, 0, 0, 0, 9, 0, 0, 0, 0, 9, -12}},
                       {"tree.3", 3, {1, 0, 0, 6, 0, 1, 0, 5, 0, 0, 1, 0}}};
    const std::vector<std::byte> bytes = mesh::encode_glb(scene);
    return folder_.write(name, {reinterpret_cast<const char*>(bytes.data()), bytes.size()}).string();
  }

  std::string path(const std::string& name) const { return (folder_.path() / name).string(); }
  /// The report of a bake; null if it failed.
  static json bake(const std::string& mesh, const std::string& asset, std::vector<std::string> more) {
    more.insert(more.begin(), {"bake", mesh, "-o", asset, "--rays", "0", "--json"});
    const Outcome outcome = nif(more);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    return outcome.code == 0 ? json::parse(outcome.out) : json();
  }

  const TempDir folder_;
  const std::string town_;
};

TEST_F(MergedByDefault, FewCopiesAreMade) {
  const std::string small = town("small.glb", icosphere(1));
  const json report = bake(small, path("small.nif"), {"--encoding", "bvh"});
  EXPECT_EQ(report["instances"], 1);
  EXPECT_EQ(report["merge"]["added_triangles"], 160);
  const Outcome eval =
      nif({"eval", path("small.nif"), "--mesh", small, "--hits", "--rays", "5000", "--json"});
  ASSERT_EQ(eval.code, 0) << eval.err;
  EXPECT_NE(eval.out.find("\"wrong\": 0"), std::string::npos) << eval.out;
}

TEST_F(MergedByDefault, WhatIsPlacedOnceIsOneObject) {
  const json report = bake(town_, path("town.nif"), {});
  EXPECT_EQ(report["instances"], 4);
  ASSERT_EQ(report["objects"].size(), 2u);
  EXPECT_EQ(report["merge"]["merged"], 3);
  EXPECT_EQ(report["merge"]["stay"]["over_budget"], 3);
  const json metadata = json::parse(nif({"info", path("town.nif"), "--json"}).out)["metadata"];
  EXPECT_EQ(metadata["merge"]["objects"],
            json::parse(R"([{"instance": 3, "names": ["house", "tower", "ground"],
                                                          "nodes": [0, 2, 4], "triangles": [1280, 1600, 12]}])"));
  const Outcome text = nif({"bake", town_, "-o", path("again.nif"), "--rays", "0"});
  EXPECT_NE(
      text.out.find("merged 3 of 6 instances, which do not move against each other, into 1 object; 3 stay: "
                    "3 share their meshes\n"),
      std::string::npos)
      << text.out;
  EXPECT_EQ(read_bytes(path("again.nif")), read_bytes(path("town.nif")));
  bake(town_, path("asked.nif"), {"--merge", "--merge-triangles", "0"});
  EXPECT_EQ(read_bytes(path("asked.nif")), read_bytes(path("town.nif"))) << "the same, in other words";
  EXPECT_EQ(bake(town_, path("further.nif"), {"--merge"})["instances"], 1) << "the trees as well";
}

TEST_F(MergedByDefault, EvalFindsTheSameTrianglesAndTheirNumbers) {
  bake(town_, path("town.nif"), {"--encoding", "bvh"});
  const Outcome eval = nif({"eval", path("town.nif"), "--mesh", town_, "--hits", "--rays", "5000", "--json"});
  ASSERT_EQ(eval.code, 0) << eval.err;
  EXPECT_NE(eval.out.find("\"source_triangles\""), std::string::npos) << eval.out;
  EXPECT_NE(eval.out.find("\"wrong\": 0"), std::string::npos) << eval.out;
  for (const char* hits : {"", "--hits"}) {
    std::vector<std::string> bench{"bench", town_, "--asset", path("town.nif"), "--rays", "2000",  "--rounds",
                                   "1",     "-j",  "1",       "--moved",        "0",      "--json"};
    if (*hits) bench.emplace_back(hits);
    const Outcome outcome = nif(bench);
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_EQ(json::parse(outcome.out)["instances"], 4);
  }
}

TEST_F(MergedByDefault, NoMergeKeepsAllApart) {
  const json report = bake(town_, path("apart.nif"), {"--no-merge"});
  EXPECT_EQ(report["instances"], 6);
  EXPECT_EQ(report["objects"].size(), 4u);
  EXPECT_FALSE(report.contains("merge"));
  const std::string asset = path("apart.nif");
  EXPECT_EQ(nif({"attach", town_, asset, "-o", path("both.glb")}).code, 0);
  bake(town_, path("merged.nif"), {});
  const Outcome refused = nif({"attach", town_, path("merged.nif"), "-o", path("none.glb")});
  EXPECT_EQ(refused.code, int(Status::usage));
  EXPECT_NE(refused.err.find("bake it with --no-merge"), std::string::npos) << refused.err;
}

TEST_F(MergedByDefault, NamesKeepApartWithoutMerge) {
  bake(town_, path("some.nif"), {"--merge-except", "tow*"});
  const json info = json::parse(nif({"info", path("some.nif"), "--json"}).out);
  EXPECT_EQ(info["instances"].size(), 5u);
  EXPECT_EQ(info["metadata"]["merge"]["objects"][0]["names"], json::parse(R"(["house", "ground"])"));
  EXPECT_EQ(info["metadata"]["merge"]["except"], json::parse(R"(["tow*"])"));
  EXPECT_EQ(bake(town_, path("two.nif"), {"--merge-nodes", "house", "--merge-nodes", "tower"})["instances"],
            5);
}

/// --only and --except take the names of the file, before anything is merged.
TEST_F(MergedByDefault, ChoicesAreOfTheNamesInTheFile) {
  EXPECT_EQ(bake(town_, path("a.nif"), {"--except", "tower"})["merge"]["merged"], 2);
  EXPECT_EQ(bake(town_, path("b.nif"), {"--only", "tower"})["instances"], 1);
  const Outcome eval = nif({"eval", path("a.nif"), "--mesh", town_, "--rays", "100"});
  EXPECT_EQ(eval.code, 0) << eval.err;
}

TEST_F(MergedByDefault, ObjectsOfOtherFormatsAreMergedAsWell) {
  const std::string obj = folder_.write("two.obj",
                                        "o a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
                                        "o b\nv 2 0 0\nv 3 0 0\nv 2 1 1\nf 4 5 6\n");
  const json report = bake(obj, path("two.nif"), {});
  EXPECT_EQ(report["objects"].size(), 1u);
  EXPECT_EQ(report["objects"][0]["triangles"], 2);
  EXPECT_EQ(bake(obj, path("two.nif"), {"--no-merge"})["objects"].size(), 2u);
}

TEST_F(MergedByDefault, ASingleMeshIsAsItWas) {
  const std::string ring = folder_.write("ring.obj", obj_text(torus(24, 12)));
  EXPECT_FALSE(bake(ring, path("ring.nif"), {}).contains("merge"));
  bake(ring, path("apart.nif"), {"--no-merge"});
  EXPECT_EQ(read_bytes(path("ring.nif")), read_bytes(path("apart.nif")));
}

TEST_F(MergedByDefault, WhereVoxelsDecideOnQualityAllStayApart) {
  for (const std::vector<std::string>& options :
       {std::vector<std::string>{"--encoding", "proof"}, {"--colors"}, {"--max-bytes", "10MB"}}) {
    const json report = bake(town_, path("apart.nif"), options);
    EXPECT_EQ(report["objects"].size(), 4u) << options.front();
    EXPECT_FALSE(report.contains("merge"));
  }
  EXPECT_EQ(bake(town_, path("merged.nif"), {"--encoding", "proof", "--merge"})["objects"].size(), 1u);
  EXPECT_EQ(bake(town_, path("exact.nif"), {"--encoding", "exact"})["objects"].size(), 2u);
}

TEST_F(MergedByDefault, ManifestsMayKeepApart) {
  const std::string manifest =
      folder_
          .write("library.toml",
                 "[defaults]\nencoding = \"bvh\"\nrays = 0\n"
                 "[[asset]]\nmesh = \"town.glb\"\noutput = \"merged.nif\"\n"
                 "[[asset]]\nmesh = \"town.glb\"\noutput = \"apart.nif\"\nno-merge = true\n")
          .string();
  ASSERT_EQ(nif({"bake", "--manifest", manifest, "--quiet"}).code, 0);
  EXPECT_EQ(json::parse(nif({"info", path("merged.nif"), "--json"}).out)["objects"].size(), 2u);
  EXPECT_EQ(json::parse(nif({"info", path("apart.nif"), "--json"}).out)["objects"].size(), 4u);
}

}  // namespace
}  // namespace nif::test
