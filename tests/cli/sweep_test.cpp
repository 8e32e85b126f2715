// `nif sweep`: assets of several sizes, a table of them, and a plot.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "formats/base/status.hpp"
#include "tests/cli/mesh_text.hpp"
#include "tests/cli/program.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

using nlohmann::json;

TEST(Sweep, ComparesSizesOfAMesh) {
  TempDir folder;
  const std::string ball = folder.write("ball.obj", obj_text(icosphere(3))).string(),
                    out = (folder.path() / "sizes").string();
  const Outcome outcome = nif({"sweep", ball, "-o", out, "--preset", "fast", "--scale", "0.4", "--scale",
                               "0.2", "--rays", "20000", "--json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(listing(out), (std::vector<std::string>{"size-1.nif", "size-2.nif", "sweep.json", "sweep.svg"}));
  const json result = json::parse(outcome.out);
  EXPECT_EQ(result, json::parse(read_bytes(std::filesystem::path(out) / "sweep.json")));
  EXPECT_EQ(result["schema"], "nifkit.sweep/1");
  ASSERT_EQ(result["points"].size(), 2u);
  const json &small = result["points"][0], &large = result["points"][1];
  EXPECT_EQ(small["scale"], 0.2);
  EXPECT_LT(small["bytes"]["file"].get<uint64_t>(), large["bytes"]["file"].get<uint64_t>());
  for (const json& point : result["points"]) {
    EXPECT_EQ(point["bytes"]["file"], std::filesystem::file_size(point["file"].get<std::string>()));
    EXPECT_EQ(point["sets"]["sun"]["certain_wrong"], 0);
    EXPECT_GT(point["speed"]["inner-surface"]["ratio"].get<double>(), 0);
  }
  const std::string plot = read_bytes(std::filesystem::path(out) / "sweep.svg");
  EXPECT_NE(plot.find("certain answers"), std::string::npos);
  EXPECT_NE(plot.find("fastest Embree"), std::string::npos);
  EXPECT_TRUE(plot.ends_with("</svg>\n"));
}

TEST(Sweep, RefusesWhatItCannotDo) {
  TempDir folder;
  const std::string ball = folder.write("ball.obj", obj_text(icosphere(1))).string(),
                    out = (folder.path() / "sizes").string();
  for (const auto& [more, word] : std::vector<std::pair<std::vector<std::string>, std::string>>{
           {{"--scale", "9"}, "--scale"},
           {{"--preset", "paper"}, "spherical"},
           {{"--preset", "best"}, "choose fast, balanced or high"}}) {
    std::vector<std::string> arguments{"sweep", ball, "-o", out};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Outcome outcome = nif(arguments);
    EXPECT_EQ(outcome.code, int(Status::usage)) << word;
    EXPECT_NE(outcome.err.find(word), std::string::npos) << outcome.err;
  }
  EXPECT_EQ(nif({"sweep", ball}).code, int(Status::usage));
  EXPECT_EQ(nif({"sweep", (folder.path() / "none.obj").string(), "-o", out}).code,
            int(Status::file_not_found));
  EXPECT_EQ(nif({"sweep", ball, "-o", ball + "/below"}).code, int(Status::output_folder_missing));
}

}  // namespace
}  // namespace nif::test
