// `nif export-shader`: what it writes, and what it says of objects that shaders cannot answer.
#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nif/nif.hpp>
#include <nlohmann/json.hpp>

#include "formats/nif/writer.hpp"
#include "tests/cli/program.hpp"
#include "tests/support/random_asset.hpp"
#include "tests/support/temp_dir.hpp"

namespace nif::test {
namespace {

namespace fs = std::filesystem;

class ExportShader : public testing::Test {
 protected:
  std::string write_asset(const RandomAssetOptions& options) {
    const auto bytes = format::encode(random_asset(5, options));
    return dir_.write("it.nif", {reinterpret_cast<const char*>(bytes.data()), bytes.size()}).string();
  }
  std::string folder() const { return (dir_.path() / "out").string(); }
  std::string read(const char* name) const {
    std::ifstream file(fs::path(folder()) / name, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  static std::string bytes_of(const std::vector<uint32_t>& words) {
    return {reinterpret_cast<const char*>(words.data()), 4 * words.size()};
  }

  TempDir dir_;
};

TEST_F(ExportShader, WritesTheTextAndTheWords) {
  const std::string asset = write_asset({.objects = 1, .instances = 2, .bvhs = 1, .features = 2});
  const Outcome outcome = nif({"export-shader", asset, "-o", folder(), "--whole"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  ASSERT_EQ(lines_of(outcome.out).size(), 8u) << outcome.out;
  EXPECT_EQ(lines_of(outcome.out)[7],
            "sections of the functions: planes, network, triangles, scenes, first hits");
  EXPECT_EQ(read("nif.glsl"), nifkit::shader_source(NIF_SHADER_GLSL));
  EXPECT_EQ(read("nif.hlsl"), nifkit::shader_source(NIF_SHADER_HLSL));
  EXPECT_EQ(read("nif.metal"), nifkit::shader_source(NIF_SHADER_METAL));
  EXPECT_EQ(read("nif.wgsl"), nifkit::shader_source(NIF_SHADER_WGSL));
  const auto loaded = nifkit::Asset::load(nifkit::Device("shaders=on"), asset);
  EXPECT_EQ(read("it.object-0.words"), bytes_of(loaded.shader_tables(0)));
  EXPECT_EQ(read("it.object-1.words"), bytes_of(loaded.shader_tables(1)));
  EXPECT_EQ(read("it.scene.words").substr(0, 4), "NIFC");
}

TEST_F(ExportShader, WritesOnlyTheSectionsThatTheWordsNeed) {
  const std::string asset =
      write_asset({.objects = 1, .instances = 2, .bvhs = 1, .proofs = 1, .features = 2});
  struct Case {
    std::vector<std::string> options, sections;
    std::vector<const char*> has, lacks;
  };
  const Case cases[] = {
      {{"--object", "0"},
       {"planes", "network"},
       {"nif_query(", "nif_evaluate"},
       {"nif_meet_triangle", "nif_first_hit", "nif_query_scene"}},
      {{"--object", "1"},
       {"triangles", "first hits"},
       {"nif_query(", "nif_first_hit("},
       {"nif_evaluate", "nif_next", "nif_first_hit_scene"}},
      {{"--object", "2"}, {"planes"}, {"nif_prove("}, {"nif_evaluate", "NIF_NETWORK_WORDS", "nif_first_hit"}},
      {{}, {"planes", "network", "triangles", "scenes", "first hits"}, {"nif_first_hit_scene"}, {}}};
  for (const Case& c : cases) {
    std::vector<std::string> arguments{"export-shader", asset, "-o", folder(), "--json"};
    arguments.insert(arguments.end(), c.options.begin(), c.options.end());
    const Outcome outcome = nif(arguments);
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_EQ(nlohmann::json::parse(outcome.out)["sections"].get<std::vector<std::string>>(), c.sections);
    for (const char* name : {"nif.glsl", "nif.hlsl", "nif.metal", "nif.wgsl"}) {
      const std::string text = read(name);
      for (const char* part : c.has) EXPECT_NE(text.find(part), std::string::npos) << name << ": " << part;
      for (const char* part : c.lacks) EXPECT_EQ(text.find(part), std::string::npos) << name << ": " << part;
      EXPECT_EQ(text.find("#if NIF_"), std::string::npos) << name;
      EXPECT_NE(lines_of(text)[1].find("nif export-shader"), std::string::npos) << lines_of(text)[1];
    }
  }
}

TEST_F(ExportShader, HasNoSceneOfOneObjectAsItIs) {
  for (const bool is_moved : {false, true}) {
    format::Asset made = random_asset(5, {.objects = 1, .instances = 1, .features = 2});
    made.instances[0].transform = {1, 0, 0, 0, 0, 1, 0, is_moved ? 2.0f : 0.0f, 0, 0, 1, 0};
    const auto bytes = format::encode(made);
    const std::string asset =
        dir_.write("it.nif", {reinterpret_cast<const char*>(bytes.data()), bytes.size()}).string();
    const Outcome outcome = nif({"export-shader", asset, "-o", folder()});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_EQ(fs::exists(fs::path(folder()) / "it.scene.words"), is_moved);
    EXPECT_EQ(read("nif.glsl").find("nif_query_scene") != std::string::npos, is_moved);
    fs::remove_all(folder());
  }
}

TEST_F(ExportShader, LeavesOutWhatShadersCannotAnswer) {
  const std::string asset = write_asset({.objects = 1, .instances = 1, .cutouts = 1, .features = 2});
  const Outcome outcome = nif({"export-shader", asset, "-o", folder(), "--json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const auto json = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(json["schema"], "nifkit.export_shader/1");
  ASSERT_EQ(json["files"].size(), 5u);
  EXPECT_EQ(json["files"][4]["bytes"], fs::file_size(json["files"][4]["path"].get<std::string>()));
  ASSERT_EQ(json["left_out"].size(), 1u);
  EXPECT_NE(json["left_out"][0].get<std::string>().find("has the encoding 'cutout'"), std::string::npos);
  EXPECT_FALSE(fs::exists(fs::path(folder()) / "it.scene.words"));
}

TEST_F(ExportShader, SaysWhyNothingIsWritten) {
  const std::string asset = write_asset({.objects = 0, .instances = 0, .cutouts = 2});
  for (const std::vector<std::string>& more : {std::vector<std::string>{}, {"--object", "1"}}) {
    std::vector<std::string> arguments{"export-shader", asset, "-o", folder()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Outcome outcome = nif(arguments);
    EXPECT_EQ(outcome.code, 2);
    EXPECT_NE(outcome.err.find(
                  "has the encoding 'cutout'; shaders answer 'segment', 'proof', 'bvh' and 'exact' only"),
              std::string::npos)
        << outcome.err;
    EXPECT_FALSE(fs::exists(folder()));
  }
  const Outcome none = nif({"export-shader", asset, "-o", folder(), "--object", "7"});
  EXPECT_EQ(none.code, 2);
  EXPECT_NE(none.err.find("no object 7"), std::string::npos) << none.err;
  EXPECT_EQ(nif({"export-shader", "/no/such.nif", "-o", folder()}).code, 10);
}

}  // namespace
}  // namespace nif::test
