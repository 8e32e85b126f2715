// Texts without the sections that an asset does not need: each combination compiles, has nothing that it cannot use, and answers
// what it is for as the whole text does.
#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <map>
#include <set>

#include "formats/nif/writer.hpp"
#include "tests/runtime/open_answers.hpp"
#include "tests/shader/shader_fixture.hpp"
#include "tests/support/query_object.hpp"
#include "tests/support/random_asset.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/support/to_world.hpp"
#include "tools/export_shader/shader_sections.hpp"

namespace nif::test {
namespace {

using tools::ShaderSections;

/// Those that make sense: a network needs planes, first hits need triangles, and an object has planes or triangles.
std::vector<ShaderSections> combinations() {
  std::vector<ShaderSections> all;
  for (int bits = 0; bits < 32; ++bits) {
    const ShaderSections sections{(bits & 1) != 0, (bits & 2) != 0, (bits & 4) != 0, (bits & 8) != 0,
                                  (bits & 16) != 0};
    if (sections.planes >= sections.network && sections.triangles >= sections.first_hits &&
        (sections.planes || sections.triangles))
      all.push_back(sections);
  }
  return all;
}

/// How often each name of ours stands in a text, without its comments.
std::map<std::string, int> names_in(const std::string& text) {
  std::map<std::string, int> names;
  for (size_t at = 0; at < text.size();) {
    size_t end = at + 1;
    if (text.compare(at, 2, "//") == 0) {
      end = std::min(text.find('\n', at), text.size());
    } else if (std::isalpha(static_cast<unsigned char>(text[at])) != 0) {
      while (end < text.size() &&
             (std::isalnum(static_cast<unsigned char>(text[end])) != 0 || text[end] == '_'))
        ++end;
      const std::string name = text.substr(at, end - at);
      if (name.starts_with("nif_") || name.starts_with("Nif") || name.starts_with("NIF_")) ++names[name];
    }
    at = end;
  }
  return names;
}

TEST(ShaderSections, HaveWhatTheyCallAndNoMore) {
  // What programs call, and what they may change.
  const std::set<std::string> of_callers = {
      "nif_query",     "nif_prove",           "nif_query_scene", "nif_prove_scene",
      "nif_first_hit", "nif_first_hit_scene", "NifTables",       "Nif"};
  for (const NifShaderLanguage language :
       {NIF_SHADER_GLSL, NIF_SHADER_HLSL, NIF_SHADER_METAL, NIF_SHADER_WGSL}) {
    const std::string whole = nifkit::shader_source(language);
    for (const ShaderSections& sections : combinations()) {
      const std::string text = cut_shader(whole, sections);
      EXPECT_EQ(text.find("#if NIF_"), std::string::npos) << sections.listed();
      EXPECT_EQ(text.find("\n\n\n"), std::string::npos) << sections.listed();
      for (const auto& [name, times] : names_in(text))
        EXPECT_TRUE(times > 1 || of_callers.contains(name))
            << name << " stands alone with: " << sections.listed();
      const auto has = [&](const char* name) { return names_in(text).contains(name); };
      EXPECT_TRUE(has("nif_query") && has("nif_prove"));
      EXPECT_EQ(has("nif_query_scene"), sections.scenes);
      EXPECT_EQ(has("nif_first_hit"), sections.first_hits);
      EXPECT_EQ(has("nif_first_hit_scene"), sections.first_hits && sections.scenes);
      EXPECT_EQ(has("nif_evaluate"), sections.network);
      EXPECT_EQ(has("nif_enter_grid"), sections.planes);
      EXPECT_EQ(has("nif_meet_triangle"), sections.triangles);
    }
  }
}

TEST(ShaderSections, AreMarkedInAWayThatIsKnown) {
  const ShaderSections planes{.planes = true};
  EXPECT_EQ(
      cut_shader("a\n#if NIF_PLANES\nb\n#endif\n// #if NIF_NETWORK && NIF_PLANES // why\nc\n// #endif\nd",
                 planes)
          .substr(0, 2),
      "a\n");
  const auto body = [&](const std::string& text) {
    const std::string cut = cut_shader("head\n" + text, planes);
    return cut.substr(cut.find('\n', 5) + 1);
  };
  EXPECT_EQ(body("#if NIF_PLANES\nb\n#endif\nc\n"), "b\nc\n");
  EXPECT_EQ(body("// #if NIF_NETWORK || NIF_PLANES // why\nb\n// #endif\n"), "b\n");
  EXPECT_EQ(body("#if NIF_NETWORK && NIF_PLANES\nb\n#endif\nc\n"), "c\n");
  EXPECT_EQ(body("#if NIF_NETWORK\n#if NIF_PLANES\nb\n#endif\n#ifndef MINE\nc\n#endif\n#endif\nd\n"), "d\n");
  EXPECT_EQ(body("#ifndef MINE\n#define MINE\n#endif\n#ifndef NIF_SCENES\n#define NIF_SCENES 1\n#endif\n"),
            "#ifndef MINE\n#define MINE\n#endif\n");
  EXPECT_EQ(body("b\n\n#if NIF_NETWORK\nc\n#endif\n\nd\n"), "b\n\nd\n");
  EXPECT_THROW(body("#if NIF_OTHER\n#endif\n"), std::logic_error);
  EXPECT_THROW(body("#if NIF_PLANES\n"), std::logic_error);
  EXPECT_THROW(body("#endif\n"), std::logic_error);
}

class ShaderSectionsRun : public ShaderTest {
 protected:
  /// A shader of tests/shader with the text that is cut, or with the whole text and macros that say the same.
  std::vector<uint32_t> compile(const std::string& shader, const ShaderSections& sections, bool by_macros,
                                const std::string& options) {
    std::string text = nifkit::shader_source(NIF_SHADER_GLSL), macros;
    if (by_macros) {
      for (const auto& [macro, wanted] : {std::pair("NIF_PLANES", sections.planes),
                                          {"NIF_NETWORK", sections.network},
                                          {"NIF_TRIANGLES", sections.triangles},
                                          {"NIF_SCENES", sections.scenes},
                                          {"NIF_FIRST_HITS", sections.first_hits}})
        if (!wanted) macros += std::string(" -D") + macro + "=0";
    } else {
      text = cut_shader(text, sections);
    }
    const std::filesystem::path folder = dir_.path() / "kernels" / "shader", to = dir_.path() / "made.spv";
    std::filesystem::create_directories(folder);
    std::ofstream(folder / "nif.glsl") << text;
    std::filesystem::remove(to);
    const std::string command = "\"" NIF_GLSLANG "\" --quiet -V " + options + macros + " -I\"" +
                                dir_.path().string() + "\" \"" NIF_SHADER_SOURCES "/" + shader +
                                ".comp\" -o \"" + to.string() +
                                "\" && \"" NIF_SPIRV_VAL "\" --target-env vulkan1.0 \"" + to.string() + "\"";
    EXPECT_EQ(std::system(command.c_str()), 0) << sections.listed() << ": " << command;
    std::ifstream file(to, std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(file), {}};
    std::vector<uint32_t> code(bytes.size() / 4);
    if (!code.empty()) std::memcpy(code.data(), bytes.data(), 4 * code.size());
    return code;
  }

  TempDir dir_;
};

TEST_F(ShaderSectionsRun, CompileToTheSameCodeByMacros) {
  for (const ShaderSections& sections : combinations()) {
    std::vector<std::pair<std::string, std::string>> shaders = {{"answer_rays", ""}};
    if (sections.scenes) shaders.emplace_back("answer_rays", "-DNIF_TEST_SCENE");
    if (sections.first_hits) shaders.emplace_back("first_hits", sections.scenes ? "-DNIF_TEST_SCENE" : "");
    for (const auto& [shader, options] : shaders) {
      const auto code = compile(shader, sections, false, options);
      EXPECT_GT(code.size(), 100u);
      EXPECT_EQ(code, compile(shader, sections, true, options))
          << sections.listed() << ", " << shader << ' ' << options;
    }
  }
}

TEST_F(ShaderSectionsRun, AnswerTheirObjectsAsTheWholeTextDoes) {
  const nifkit::Device device("shaders=on");
  const auto file = format::encode(
      random_asset(3, {.objects = 1, .instances = 0, .bvhs = 1, .exacts = 1, .proofs = 1, .features = 2}));
  const format::AssetView view = format::read_asset(file, "test");
  const nifkit::Asset asset = nifkit::Asset::load(device, std::span<const std::byte>(file));
  std::set<std::string> kinds;
  for (uint32_t i = 0; i < view.objects.size(); ++i) {
    const std::vector<uint32_t> words = asset.shader_tables(i);
    ShaderSections sections;
    sections.add_object(words[3]);
    kinds.insert(sections.listed());
    Random random(7 + i);
    std::vector<kernels::Segment> rays(4000);
    for (kernels::Segment& ray : rays) ray = random_segment(random, view.objects[i]);
    const auto same = [&](const std::string& shader, const std::string& options, const char* whole,
                          size_t each) {
      const auto answers =
          run_for_rays(*vulkan_, compile(shader, sections, false, options), words, 0, rays, 1, each);
      EXPECT_EQ(answers, run_for_rays(*vulkan_, shader_code(whole), words, 0, rays, 1, each))
          << sections.listed();
      EXPECT_GT(std::set(answers.begin(), answers.end()).size(), 3u);
    };
    same("answer_rays", "-DNIF_NETWORK_WORDS=34 -DNIF_CERTAIN_REACH=16384.0", "wide", 8);
    same("answer_rays", "-DNIF_CERTAIN_REACH=16384.0 -DNIF_TEST_PROVE", "prove", 8);
    if (sections.first_hits) same("first_hits", "", "hits", kHitWords);

    // What an object of another kind has is left open.
    ShaderSections others = ShaderSections::all();
    (sections.triangles ? others.triangles : others.planes) = false;
    if (!sections.triangles) others.network = false;
    if (sections.triangles) others.first_hits = false;
    for (const ShaderAnswer& answer :
         ask_shader(*vulkan_, compile("answer_rays", others, false, ""), words, 0, rays)) {
      ASSERT_FALSE(answer.visible || answer.certain);
      ASSERT_EQ(answer.logit, -1);
    }
  }
  EXPECT_EQ(kinds, (std::set<std::string>{"planes", "planes, network", "planes, triangles, first hits",
                                          "triangles, first hits"}));
}

TEST_F(ShaderSectionsRun, AnswerScenesAsTheWholeTextDoes) {
  const nifkit::Device device("shaders=on");
  for (const RandomAssetOptions& options : {RandomAssetOptions{.objects = 2, .instances = 6, .features = 2},
                                            RandomAssetOptions{.objects = 0, .instances = 6, .bvhs = 2}}) {
    const auto file = format::encode(random_asset(5, options));
    const format::AssetView view = format::read_asset(file, "test");
    const nifkit::Asset asset = nifkit::Asset::load(device, std::span<const std::byte>(file));
    ShaderSections sections;
    for (uint32_t i = 0; i < view.objects.size(); ++i) sections.add_object(asset.shader_tables(i)[3]);
    sections.scenes = true;
    nifkit::Scene scene(device);
    scene.add_asset(asset);
    scene.commit();
    const std::vector<uint32_t> words = scene.shader_tables();
    std::vector<kernels::Segment> rays;
    for (const NifRay& ray : rays_near(view, 5, 4000)) rays.push_back(to_segment(ray));
    const auto same = [&](const std::string& shader, const std::string& macros, const char* whole,
                          size_t each) {
      const auto code = compile(shader, sections, false, macros + " -DNIF_TEST_SCENE");
      const auto answers = run_for_rays(*vulkan_, code, words, 0, rays, 0xffffffffu, each);
      EXPECT_EQ(answers, run_for_rays(*vulkan_, shader_code(whole), words, 0, rays, 0xffffffffu, each));
      EXPECT_GT(std::set(answers.begin(), answers.end()).size(), 3u);
    };
    same("answer_rays", "-DNIF_NETWORK_WORDS=34 -DNIF_CERTAIN_REACH=16384.0", "query_scene", 8);
    if (sections.first_hits) same("first_hits", "", "hits_scene", kHitWords);
  }
}

}  // namespace
}  // namespace nif::test
