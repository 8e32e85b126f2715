// `nif mesh generate`: a mesh that the other subcommands take, or a refusal that leaves nothing.
#include <gtest/gtest.h>
#include <signal.h>

#include <nlohmann/json.hpp>

#include "formats/base/status.hpp"
#include "formats/mesh/read.hpp"
#include "tests/cli/program.hpp"

namespace nif::test {
namespace {

namespace fs = std::filesystem;

class MeshGenerate : public testing::Test {
 protected:
  std::string path(const std::string& name) const { return (folder_.path() / name).string(); }
  static Outcome generate(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"mesh", "generate"});
    return nif(arguments);
  }

  const TempDir folder_;
};

TEST_F(MeshGenerate, SaysWhatItMade) {
  const std::string file = path("torus.ply");
  const Outcome outcome = generate({"torus", "-o", file, "--triangles", "5000", "--seed", "7", "--json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  const auto result = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(result["schema"], "nifkit.mesh-generate/1");
  EXPECT_EQ(result["file"], file);
  EXPECT_EQ(result["shape"], "torus");
  EXPECT_EQ(result["seed"], 7);
  EXPECT_EQ(result["bytes"], fs::file_size(file));
  EXPECT_GE(result["seconds"], 0.0);
  EXPECT_EQ(result.size(), 9u) << result;

  const mesh::Scene scene = mesh::read(file);
  ASSERT_EQ(scene.meshes.size(), 1u);
  EXPECT_EQ(result["triangles"], scene.meshes[0].triangles.size());
  EXPECT_EQ(result["vertices"], scene.meshes[0].positions.size());
  mesh::Float3 low = scene.meshes[0].positions[0], high = low;
  for (const mesh::Float3& p : scene.meshes[0].positions)
    for (size_t axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], p[axis]);
      high[axis] = std::max(high[axis], p[axis]);
    }
  EXPECT_EQ(result["bounds"], (nlohmann::json{low, high}));
  EXPECT_EQ(listing(folder_.path()), std::vector<std::string>{"torus.ply"});

  const Outcome text = generate({"torus", "-o", file, "--triangles", "5000"});
  const std::string triangles = std::to_string(scene.meshes[0].triangles.size()) + " triangles";
  EXPECT_NE(text.out.find(triangles), std::string::npos) << text.out;
  EXPECT_EQ(generate({"torus", "-o", file, "--quiet"}).out, "");
}

TEST_F(MeshGenerate, MakesTheSameBytesOnAnyNumberOfThreads) {
  for (const char* threads : {"1", "3"})
    ASSERT_EQ(generate({"statue", "-o", path(threads), "--triangles", "30000", "-j", threads}).code, 0);
  EXPECT_TRUE(read_bytes(path("1")) == read_bytes(path("3")));
  ASSERT_EQ(generate({"statue", "-o", path("2"), "--triangles", "30000", "--seed", "2"}).code, 0);
  EXPECT_FALSE(read_bytes(path("1")) == read_bytes(path("2")));
}

TEST_F(MeshGenerate, GoesToStandardOutputAlone) {
  const std::string direct = path("direct.ply"), through = path("through.ply");
  ASSERT_EQ(generate({"tree", "-o", direct}).code, 0);
  const std::string command = R"("$0" mesh generate tree -o /dev/stdout | cat > "$1")";
  EXPECT_EQ(Process("/bin/sh", {"-c", command, nif_path().string(), through}).finish().code, 0);
  EXPECT_TRUE(read_bytes(direct) == read_bytes(through));
}

TEST_F(MeshGenerate, RefusesByName) {
  struct Refusal {
    std::vector<std::string> arguments;
    Status status;
    std::vector<std::string> named;
  };
  const std::string file = path("a.ply");
  for (const Refusal& refusal : {
           Refusal{{"teapot", "-o", file},
                   Status::usage,
                   {"teapot", "statue", "tori", "torus", "tree", "terrain", "chain-mail", "city", "forest"}},
           Refusal{{"-o", file}, Status::usage, {"SHAPE"}},
           Refusal{{"statue"}, Status::usage, {"--output"}},
           Refusal{{"statue", "-o", file, "--triangles", "99"}, Status::usage, {"--triangles", "100"}},
           Refusal{
               {"statue", "-o", file, "--triangles", "50000001"}, Status::usage, {"--triangles", "50000000"}},
           Refusal{{"statue", "-o", file, "--triangles", "many"}, Status::usage, {"--triangles"}},
           Refusal{{"chain-mail", "-o", file, "--triangles", "100"}, Status::usage, {"chain-mail", "144"}},
           Refusal{{"city", "-o", file}, Status::usage, {file, ".glb"}},
           Refusal{
               {"torus", "-o", path("a.OBJ")}, Status::usage, {path("a.OBJ"), ".ply", "nif mesh convert"}},
           Refusal{{"city", "-o", path("a.glb"), "--triangles", "5000"},
                   Status::usage,
                   {"--triangles", "city", "--instances"}},
           Refusal{
               {"city", "-o", path("a.glb"), "--instances", "2999"}, Status::usage, {"--instances", "3000"}},
           Refusal{{"tree", "-o", file, "--instances", "3000"}, Status::usage, {"--instances", "city"}},
           Refusal{{"forest", "-o", file}, Status::usage, {file, ".glb"}},
           Refusal{{"forest", "-o", path("a.glb"), "--triangles", "5000"},
                   Status::usage,
                   {"--triangles", "forest", "--instances"}},
           Refusal{
               {"forest", "-o", path("a.glb"), "--instances", "99"}, Status::usage, {"--instances", "100"}},
           Refusal{
               {"forest", "-o", path("a.glb"), "--cutout"}, Status::usage, {"--cutout", "tree", "forest"}},
           Refusal{{"torus", "-o", path("a.glb"), "--cutout"}, Status::usage, {"--cutout", "tree", "torus"}},
           Refusal{{"tree", "-o", file, "--cutout"}, Status::usage, {file, ".glb"}},
           Refusal{{"tree", "-o", path("a.glb"), "--cutout", "--triangles", "99"},
                   Status::usage,
                   {"--triangles"}},
           Refusal{{"tree", "-o", path("a.glb"), "--cutout", "--instances", "500"},
                   Status::usage,
                   {"--instances", "forest"}},
           Refusal{{"city", "-o", path("no/a.glb")}, Status::output_folder_missing, {path("no")}},
           Refusal{{"statue", "-o", path("no/a.ply")}, Status::output_folder_missing, {path("no")}},
           Refusal{{"statue", "-o", folder_.path().string()},
                   Status::output_not_writable,
                   {folder_.path().string()}},
       }) {
    SCOPED_TRACE(testing::PrintToString(refusal.arguments));
    const Outcome outcome = generate(refusal.arguments);
    EXPECT_EQ(outcome.code, int(refusal.status)) << outcome.err;
    EXPECT_EQ(outcome.out, "");
    EXPECT_EQ(lines_of(outcome.err).size(), 1u) << outcome.err;
    for (const std::string& word : refusal.named)
      EXPECT_NE(outcome.err.find(word), std::string::npos) << "'" << word << "' in: " << outcome.err;
    EXPECT_EQ(listing(folder_.path()), std::vector<std::string>());
  }
}

TEST_F(MeshGenerate, WritesACityAsAScene) {
  const std::string file = path("city.glb"), again = path("again.glb");
  const Outcome outcome = generate({"city", "-o", file, "--instances", "3000", "--seed", "7", "--json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  const auto result = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(result["schema"], "nifkit.mesh-generate/1");
  EXPECT_EQ(result["shape"], "city");
  EXPECT_EQ(result["seed"], 7);
  EXPECT_EQ(result["meshes"], 200);
  EXPECT_EQ(result["instances"], 3000);
  EXPECT_EQ(result["bytes"], fs::file_size(file));
  EXPECT_LT(result["bounds"][0][0], -100);
  EXPECT_GT(result["bounds"][1][0], 100);
  const mesh::Scene scene = mesh::read(file);
  EXPECT_EQ(scene.instances.size(), 3000u);
  uint64_t triangles = 0;
  for (const mesh::Mesh& mesh : scene.meshes) triangles += mesh.triangles.size();
  EXPECT_EQ(result["triangles"], triangles);

  const Outcome text = generate({"city", "-o", again, "--instances", "3000", "--seed", "7", "-j", "3"});
  EXPECT_NE(text.out.find("200 meshes in 3000 instances"), std::string::npos) << text.out;
  EXPECT_TRUE(read_bytes(file) == read_bytes(again));
}

// Of three thousand triangles most are cut; a bake drops none of them, because each shows leaves.
TEST_F(MeshGenerate, WritesATreeWhoseLeavesLetLightThrough) {
  const std::string file = path("tree.glb");
  const Outcome outcome = generate({"tree", "-o", file, "--cutout", "--triangles", "3000", "--json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const auto result = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(result["shape"], "tree");
  EXPECT_EQ(result["triangles"], 3000);
  EXPECT_EQ(result["bytes"], fs::file_size(file));
  EXPECT_EQ(result.size(), 9u) << result;
  const Outcome baked = nif({"bake", file, "-o", path("tree.nif"), "--rays", "1000", "--json"});
  ASSERT_EQ(baked.code, 0) << baked.err;
  const auto asset = nlohmann::json::parse(baked.out);
  EXPECT_EQ(asset["objects"][0]["encoding"], "cutout") << asset;
}

TEST_F(MeshGenerate, WritesAForestAsAScene) {
  const std::string file = path("forest.glb");
  const Outcome outcome = generate({"forest", "-o", file, "--instances", "200", "--json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const auto result = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(result["meshes"], 6);
  EXPECT_EQ(result["instances"], 200);
  EXPECT_EQ(result["bytes"], fs::file_size(file));
  EXPECT_EQ(mesh::read(file).instances.size(), 200u);
}

TEST_F(MeshGenerate, InterruptLeavesNothing) {
  const std::string old = folder_.write("old.ply", "what was there before").string();
  for (const int signal : {SIGINT, SIGTERM})
    for (const std::string& file : {path("new.ply"), old}) {
      Process process(nif_path(), {"mesh", "generate", "statue", "-o", file, "--triangles", "50000000"});
      ASSERT_TRUE(process.wait_for_error_text("writing"));
      process.send(signal);
      const Outcome outcome = process.finish(60);
      EXPECT_EQ(outcome.code, int(Status::interrupted)) << outcome.err;
      EXPECT_EQ(outcome.out, "");
      EXPECT_EQ(without_progress(outcome.err).size(), 1u) << outcome.err;
      EXPECT_EQ(listing(folder_.path()), std::vector<std::string>{"old.ply"});
    }
  EXPECT_EQ(read_bytes(old), "what was there before");
}

TEST_F(MeshGenerate, IsBakedLikeAnyMesh) {
  const std::string file = path("tori.ply"), asset = path("tori.nif");
  ASSERT_EQ(generate({"tori", "-o", file, "--triangles", "2000"}).code, 0);
  const Outcome outcome = nif({"bake", file, "-o", asset, "--encoding", "bvh", "--rays", "0", "--json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(nlohmann::json::parse(outcome.out)["objects"][0]["open_components"], 0) << outcome.out;
}

}  // namespace
}  // namespace nif::test
