// `nif bench SCENE` on tiny scenes: what it reports, and what it refuses.
#include <gtest/gtest.h>
#include <signal.h>

#include <nlohmann/json.hpp>

#include "formats/base/status.hpp"
#include "tests/cli/mesh_text.hpp"
#include "tests/cli/program.hpp"
#include "tests/cli/rings_and_balls.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

using nlohmann::json;

class BenchScene : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TempDir;
    glb_ = folder_->write("rows.glb", rings_and_balls(torus(24, 12), icosphere(2), 30)).string();
    ring_ = folder_->write("ring.obj", obj_text(torus(24, 12))).string();
    for (const std::string& mesh : {glb_, ring_})
      ASSERT_EQ(nif({"bake", mesh, "-o", mesh + ".nif", "--encoding", "bvh", "--rays", "0", "--quiet"}).code,
                0);
  }
  static void TearDownTestSuite() { delete folder_; }

  static Outcome bench(const std::string& scene, std::vector<std::string> more) {
    more.insert(more.begin(), {"bench", scene, "--rays", "3000", "--rounds", "2", "--quiet"});
    return nif(more);
  }
  static std::string toml(const std::string& text) { return folder_->write("scene.toml", text).string(); }

  static inline TempDir* folder_ = nullptr;
  static inline std::string glb_, ring_;
};

void check_move(const json& time) {
  EXPECT_GT(time["lowest"].get<double>(), 0);
  EXPECT_LE(time["lowest"], time["ms"]);
  EXPECT_LE(time["ms"], time["highest"]);
  EXPECT_GE(time["transforms_ms"].get<double>(), 0);
  EXPECT_GE(time["commit_ms"].get<double>(), 0);
}

void check_sets(const json& sets) {
  ASSERT_EQ(sets.size(), 3u);
  for (const auto& [name, set] : sets.items()) {
    SCOPED_TRACE(name);
    EXPECT_LE(set["rays"], 3000);
    EXPECT_GE(set["rays"], name == "sun" ? 2900 : 3000);
    EXPECT_LT(set["error"].get<double>(), 2e-3) << "a BVH is exact";
    EXPECT_EQ(set["certain_wrong"], 0);
    EXPECT_EQ(set["variants"].size(), 4u * 7);
    for (const json& variant : set["variants"]) {
      EXPECT_LT(variant["error"].get<double>(), 2e-3) << variant["variant"];
      EXPECT_EQ(variant["coherent"], false);
    }
    EXPECT_DOUBLE_EQ(set["ratio"].get<double>(),
                     set["nif"]["mrays_per_s"].get<double>() / set["embree"]["mrays_per_s"].get<double>());
  }
}

TEST_F(BenchScene, AsksTheWholeSceneBeforeAndAfterAMove) {
  const std::vector<std::string> files = listing(folder_->path());
  const Outcome outcome =
      bench(glb_, {"--asset", glb_ + ".nif", "--moved", "7", "-j", "1", "-j", "2", "--json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  const json result = json::parse(outcome.out);
  EXPECT_EQ(result["schema"], "nifkit.bench-scene/1");
  EXPECT_NE(nif({"bench", "--help"}).out.find("nifkit.bench-scene/1"), std::string::npos);
  EXPECT_EQ(result["file"], glb_);
  EXPECT_EQ(result["asset"], glb_ + ".nif");
  EXPECT_EQ(result["objects"], 2);
  EXPECT_EQ(result["instances"], 30);
  EXPECT_EQ(result["triangles"], 2 * 24 * 12 + 320);
  EXPECT_EQ(result["placed_triangles"], 15 * (2 * 24 * 12 + 320));
  EXPECT_EQ(result["bytes"]["file"], std::filesystem::file_size(glb_ + ".nif"));
  EXPECT_GT(result["bytes"]["scene"].get<uint64_t>(), 30u * 50);
  EXPECT_GT(result["bytes"]["resident"], result["bytes"]["scene"]);
  for (const char* build : {"default", "high", "compact", "robust"})
    EXPECT_GT(result["bytes"]["embree"][build].get<uint64_t>(), 1000u) << build;
  check_sets(result["sets"]);
  ASSERT_EQ(result["scaling"].size(), 2u);
  EXPECT_EQ(result["scaling"][0]["sets"], result["sets"]);

  const json& moved = result["moved"];
  EXPECT_EQ(moved["instances"], 7);
  ASSERT_EQ(moved["scaling"].size(), 2u);
  for (const json& run : moved["scaling"]) {
    check_move(run["nif"]);
    check_move(run["embree"]);
    ASSERT_EQ(run["builds"].size(), 4u);
    for (const json& build : run["builds"]) {
      check_move(build);
      EXPECT_LE(run["embree"]["ms"], build["ms"]);
    }
    EXPECT_DOUBLE_EQ(run["ratio"].get<double>(),
                     run["embree"]["ms"].get<double>() / run["nif"]["ms"].get<double>());
    check_sets(run["sets"]);
  }
  EXPECT_EQ(listing(folder_->path()), files);
}

TEST_F(BenchScene, RacesFirstHits) {
  const Outcome outcome = bench(
      glb_, {"--asset", glb_ + ".nif", "--moved", "3", "-j", "1", "--hits", "--embree", "all", "--json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const json result = json::parse(outcome.out);
  EXPECT_EQ(result["hits"], true);
  for (const json& sets : {result["sets"], result["moved"]["scaling"][0]["sets"]}) {
    ASSERT_EQ(sets.size(), 4u);
    for (const auto& [name, set] : sets.items()) {
      EXPECT_LT(set["error"].get<double>(), 2e-3) << name;
      EXPECT_EQ(set["variants"].size(), 4u * 5) << name;
      for (const json& variant : set["variants"]) {
        EXPECT_TRUE(variant["call"].get<std::string>().starts_with("rtcIntersect")) << variant["call"];
        EXPECT_LT(variant["error"].get<double>(), 2e-3) << variant["variant"];
      }
    }
  }
  const Outcome text =
      bench(glb_, {"--asset", glb_ + ".nif", "--moved", "0", "-j", "1", "--hits", "--set", "camera"});
  EXPECT_EQ(text.code, 0) << text.err;
  EXPECT_NE(text.out.find("First hits: nifIntersect"), std::string::npos) << text.out;
}

TEST_F(BenchScene, RacesAnotherAssetOfTheSameScene) {
  const std::string exact = glb_ + ".exact.nif";
  ASSERT_EQ(nif({"bake", glb_, "-o", exact, "--encoding", "exact", "--rays", "0", "--quiet"}).code, 0);
  const std::vector<std::string> words{"--asset", glb_ + ".nif", "--against", exact, "--moved", "3",
                                       "-j",      "1",           "-j",        "2",   "--set",   "sun"};
  std::vector<std::string> with_json = words;
  with_json.push_back("--json");
  const Outcome outcome = bench(glb_, with_json);
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const json result = json::parse(outcome.out);
  EXPECT_EQ(result["against"], exact);
  for (const json& run : result["scaling"]) {
    const json& set = run["sets"]["sun"];
    EXPECT_LT(set["against"]["error"].get<double>(), 2e-3);
    EXPECT_GT(set["against"]["bytes"], std::filesystem::file_size(exact));
    EXPECT_DOUBLE_EQ(set["against"]["ratio"].get<double>(),
                     set["nif"]["mrays_per_s"].get<double>() / set["against"]["mrays_per_s"].get<double>());
  }
  EXPECT_FALSE(result["moved"]["scaling"][0]["sets"]["sun"].contains("against"));
  const Outcome text = bench(glb_, words);
  EXPECT_NE(text.out.find("against " + exact), std::string::npos) << text.out;
  std::filesystem::remove(exact);
}

TEST_F(BenchScene, TakesSceneFilesThatNameTheirAssets) {
  // One file twice, another beside it, and a ground and a light that the bench ignores.
  const std::string scene = toml(R"([ground]
[[object]]
mesh = "ring.obj"
nif = "ring.obj.nif"
[[object]]
mesh = "ring.obj"
nif = "ring.obj.nif"
translate = [0, 3, 0]
rotate = [30, 0, 0]
[[object]]
mesh = "rows.glb"
nif = "rows.glb.nif"
scale = 0.5
translate = [4, 0, 0]
[[light]]
type = "sky"
)");
  const Outcome outcome = bench(scene, {"-j", "1", "--moved", "0", "--json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const json result = json::parse(outcome.out);
  EXPECT_FALSE(result.contains("moved"));
  EXPECT_FALSE(result.contains("asset"));
  EXPECT_EQ(result["objects"], 3);
  EXPECT_EQ(result["instances"], 32);
  check_sets(result["sets"]);

  // All named sets can be drawn from a scene.
  const Outcome all = bench(scene, {"-j", "1", "--moved", "3", "--set", "inner-volume", "--set", "segments"});
  ASSERT_EQ(all.code, 0) << all.err;
  for (const char* word : {"32 instances of 3 objects", "inner-volume", "segments", "3 instances moved",
                           "transforms", "commit", "Embree compact", "1 thread"})
    EXPECT_NE(all.out.find(word), std::string::npos) << word << " in:\n" << all.out;
}

TEST_F(BenchScene, RefusesByName) {
  struct Refusal {
    std::string scene;
    std::vector<std::string> options;
    Status status;
    std::vector<std::string> named;
  };
  const std::string asset = glb_ + ".nif", ring = ring_ + ".nif";
  const std::string
      whole =
          folder_->write("whole.toml", "[[object]]\nmesh = \"ring.obj\"\nnif = \"ring.obj.nif\"\n").string(),
      bare = folder_->write("bare.toml", "[[object]]\nmesh = \"ring.obj\"\n").string(),
      flat = folder_
                 ->write("flat.toml",
                         "[[object]]\nmesh = \"ring.obj\"\nnif = \"ring.obj.nif\"\n"
                         "transform = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0]\n")
                 .string(),
      none = (folder_->path() / "none.glb").string();
  for (const Refusal& refusal :
       {Refusal{glb_, {}, Status::usage, {glb_, "--asset"}},
        Refusal{glb_, {"--asset", ring}, Status::mesh_mismatch, {glb_, ring}},
        Refusal{glb_, {"--asset", none}, Status::file_not_found, {none}},
        Refusal{none, {"--asset", asset}, Status::file_not_found, {none}},
        Refusal{glb_, {"--asset", glb_}, Status::not_a_nif, {glb_}},
        Refusal{glb_, {"--asset", asset, "--mesh", ring_}, Status::usage, {"--mesh", "ASSET"}},
        Refusal{glb_, {"--asset", asset, "--against", ring}, Status::mesh_mismatch, {glb_, ring}},
        Refusal{whole, {"--against", ring}, Status::usage, {"--against", whole}},
        Refusal{glb_, {"--asset", asset, "--stages"}, Status::usage, {"--stages", "ASSET"}},
        Refusal{glb_, {"--asset", asset, "--fallback", "embree"}, Status::usage, {"--fallback", "ASSET"}},
        Refusal{glb_, {"--asset", asset, "--batches"}, Status::usage, {"--batches", "ASSET"}},
        Refusal{glb_, {"--asset", asset, "--precision", "half"}, Status::usage, {"--precision", "ASSET"}},
        Refusal{glb_, {"--asset", asset, "--plot", asset}, Status::usage, {"--plot", "overwrite"}},
        Refusal{glb_, {"--asset", asset, "--device", "gpu"}, Status::usage, {"--device", "ASSET"}},
        Refusal{whole, {"--asset", ring}, Status::usage, {"--asset", whole}},
        Refusal{bare, {}, Status::malformed_scene, {bare, "object 1", "ring.obj", "nif"}},
        Refusal{flat, {}, Status::malformed_scene, {flat, "instance"}},
        Refusal{ring, {"--mesh", ring_, "--moved", "5"}, Status::usage, {"--moved", "scene"}},
        Refusal{ring, {"--mesh", ring_, "--asset", ring}, Status::usage, {"--asset", "scene"}},
        Refusal{ring, {}, Status::usage, {ring, "--mesh"}}}) {
    SCOPED_TRACE(refusal.scene + " " + testing::PrintToString(refusal.options));
    const Outcome outcome = bench(refusal.scene, refusal.options);
    EXPECT_EQ(outcome.code, int(refusal.status)) << outcome.err;
    EXPECT_EQ(outcome.out, "");
    EXPECT_EQ(lines_of(outcome.err).size(), 1u) << outcome.err;
    for (const std::string& word : refusal.named)
      EXPECT_NE(outcome.err.find(word), std::string::npos) << "'" << word << "' in: " << outcome.err;
  }
}

TEST_F(BenchScene, InterruptedEndsAtOnce) {
  Process process(nif_path(), {"bench", glb_, "--asset", glb_ + ".nif", "--rounds", "1000"});
  ASSERT_TRUE(process.wait_for_error_text("outer-lines, 1 thread"));
  process.send(SIGINT);
  const Outcome outcome = process.finish(60);
  EXPECT_EQ(outcome.code, int(Status::interrupted)) << outcome.err;
  EXPECT_EQ(outcome.out, "");
  EXPECT_EQ(without_progress(outcome.err).size(), 1u) << outcome.err;
}

}  // namespace
}  // namespace nif::test
