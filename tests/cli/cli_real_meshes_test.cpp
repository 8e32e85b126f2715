// Each real mesh bakes, or is refused with a reason: scans, CAD and simulation meshes with all their usual
// defects. They are not part of the repository: NIF_TEST_MESHES names their folder. Training takes as long for
// any mesh, so only the smallest files get networks, and the others only the planes in front of them, unless
// NIF_TEST_LARGEST is set.
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "tests/cli/program.hpp"
#include "tests/support/real_meshes.hpp"

namespace nif::test {
namespace {

using nlohmann::json;

TEST(RealMeshes, BakeOrSayWhyNot) {
  if (!real_mesh_folder()) GTEST_SKIP() << "NIF_TEST_MESHES is not set";
  const std::vector<std::filesystem::path> meshes = real_meshes(2'500'000);
  ASSERT_FALSE(meshes.empty()) << *real_mesh_folder();

  TempDir out;
  for (size_t i = 0; i < 2 * meshes.size(); ++i) {
    const std::filesystem::path& mesh = meshes[i / 2];
    const bool learned = std::filesystem::file_size(mesh) < 1'000'000 || std::getenv("NIF_TEST_LARGEST");
    const std::vector<std::string> grid{
        "--encoding", learned ? "segment" : "proof", "--preset", "fast", "--resolution", "32"},
        way = i % 2 ? std::vector<std::string>{"--encoding", "bvh"} : grid;
    SCOPED_TRACE(mesh.string() + ' ' + way[1]);
    const std::string asset = (out.path() / "out.nif").string();
    std::vector<std::string> arguments{"bake", mesh.string(), "-o", asset, "--rays", "20000", "--json"};
    arguments.insert(arguments.end(), way.begin(), way.end());
    const Outcome outcome = nif(arguments);
    const std::vector<std::string> lines = without_progress(outcome.err);
    std::string result;
    if (outcome.code == 0) {
      const json bake = json::parse(outcome.out);
      for (const auto& [name, accuracy] : bake["sets"].items())
        EXPECT_EQ(accuracy["certain_wrong"], 0) << name;
      char text[128];
      std::snprintf(text, sizeof(text), "%9lld triangles, %6.1f s, %8lld bytes, outer-lines %6.3f %% wrong",
                    bake["triangles"].get<long long>(), bake["seconds"].get<double>(),
                    bake["bytes"]["file"].get<long long>(),
                    100 * bake["sets"]["outer-lines"]["error"].get<double>());
      result = text;
      std::filesystem::remove(asset);
    } else {
      EXPECT_GE(outcome.code, 10) << outcome.err;
      EXPECT_LT(outcome.code, 60) << outcome.err;
      ASSERT_EQ(lines.size(), 1u) << outcome.err;
      EXPECT_NE(lines[0].find(mesh.string()), std::string::npos) << lines[0];
      result = lines[0];
    }
    EXPECT_EQ(listing(out.path()), std::vector<std::string>{});
    std::printf("%-48s %-8s %s\n", mesh.filename().c_str(), way[1].c_str(), result.c_str());
    std::fflush(stdout);
  }
}

}  // namespace
}  // namespace nif::test
