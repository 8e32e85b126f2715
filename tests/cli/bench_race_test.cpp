// `nif bench --export` and `--compare`, with a program that takes part by brute force: what is exported, that
// right answers are found right and wrong ones wrong, and what is refused.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>

#include <cmath>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>

#include "formats/base/status.hpp"
#include "tests/cli/brute_racer.hpp"
#include "tests/cli/mesh_text.hpp"
#include "tests/cli/program.hpp"
#include "tests/cli/rings_and_balls.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

class BenchRace : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TempDir;
    size_t base = 0;
    std::string two = obj_object(torus(16, 8), "ring", base);
    two += obj_object(icosphere(2), "ball", base);
    mesh_ = folder_->write("two.obj", two).string();
    glb_ = folder_->write("rows.glb", rings_and_balls(torus(12, 6), icosphere(1), 6)).string();
    for (const std::string& mesh : {mesh_, glb_})
      ASSERT_EQ(nif({"bake", mesh, "-o", mesh + ".nif", "--encoding", "bvh", "--no-merge", "--rays", "0",
                     "--quiet"})
                    .code,
                0);
    ASSERT_EQ(of_mesh({"--export", path("export")}).code, 0);
    ASSERT_EQ(of_scene({"--export", path("scene export")}).code, 0);
  }
  static void TearDownTestSuite() { delete folder_; }

  static Outcome of_mesh(std::vector<std::string> more) {
    more.insert(more.begin(), {"bench", mesh_ + ".nif", "--mesh", mesh_, "--rays", "2000", "--quiet"});
    return nif(more);
  }
  static Outcome of_scene(std::vector<std::string> more) {
    more.insert(more.begin(), {"bench", glb_, "--asset", glb_ + ".nif", "--rays", "1500", "--quiet"});
    return nif(more);
  }
  /// Races on one thread, with these results.
  static Outcome compare(const std::string& results, std::vector<std::string> more = {}, bool scene = false) {
    more.insert(more.end(), {"--compare", results, "-j", "1", "--rounds", "1"});
    if (scene) more.insert(more.end(), {"--moved", "0"});
    return scene ? of_scene(more) : of_mesh(more);
  }
  static std::string path(const std::string& name) { return (folder_->path() / name).string(); }
  static std::map<std::string, std::string> files_of(const std::string& folder) {
    std::map<std::string, std::string> files;
    for (const std::string& name : listing(folder)) files[name] = read_bytes(fs::path(folder) / name);
    return files;
  }

  static inline TempDir* folder_ = nullptr;
  static inline std::string mesh_, glb_;
};

TEST_F(BenchRace, ExportsWhatThePageSays) {
  std::map<std::string, std::string> files = files_of(path("export"));
  const json race = json::parse(files["race.json"]);
  EXPECT_EQ(race["schema"], "nifkit.race/1");
  const std::string help = nif({"bench", "--help"}).out;
  for (const char* schema : {"nifkit.race/1", "nifkit.entrant/1"})
    EXPECT_NE(help.find(schema), std::string::npos) << schema;
  EXPECT_EQ(race["mesh"], mesh_);
  EXPECT_EQ(race["instanced"], false);
  ASSERT_EQ(race["objects"].size(), 2u);
  EXPECT_EQ(race["objects"][0]["name"], "ring");
  EXPECT_EQ(race["objects"][1]["first_triangle"], race["objects"][0]["triangles"]);
  EXPECT_EQ(race["triangles"]["shape"], json({16 * 8 * 2 + 320, 3}));
  EXPECT_EQ(race["transforms"]["shape"], json({2, 3, 4}));
  ASSERT_EQ(race["scenes"].size(), 2u);
  EXPECT_EQ(race["scenes"][1], json({{"first_instance", 1}, {"instances", 1}}));
  EXPECT_EQ(race["sets"].size(), 4u);
  size_t arrays = 1;
  const auto check = [&](const json& array, size_t size) {
    for (const json& side : array["shape"]) size *= side.get<size_t>();
    EXPECT_EQ(files[array["file"]].size(), size) << array["file"];
    ++arrays;
  };
  for (const char* name : {"positions", "triangles", "transforms", "placed"}) check(race[name], 4);
  for (const auto& [name, set] : race["sets"].items()) {
    check(set, 4);
    EXPECT_EQ(set["coherent"], name == "sun" || name == "camera");
    EXPECT_EQ(set["scenes"][1]["first_ray"], set["scenes"][0]["rays"]);
  }
  EXPECT_EQ(files.size(), arrays);

  // Another export takes the place of the first. What hashes are of shows in them.
  ASSERT_EQ(of_mesh({"--export", path("again")}).code, 0);
  EXPECT_TRUE(files_of(path("again")) == files);
  const Outcome other = of_mesh({"--export", path("again"), "--seed", "9", "--set", "sun", "--json"});
  ASSERT_EQ(other.code, 0) << other.err;
  EXPECT_EQ(listing(path("again")),
            (std::vector<std::string>{"placed.u32", "positions.f32", "race.json", "sun.rays.f32",
                                      "transforms.f32", "triangles.u32"}));
  EXPECT_EQ(json::parse(other.out), json::parse(read_bytes(path("again/race.json"))));
  EXPECT_NE(json::parse(other.out)["sets"]["sun"]["hash"], race["sets"]["sun"]["hash"]);
  for (const std::string& name : listing(folder_->path())) EXPECT_EQ(name.find(".tmp-"), name.npos) << name;
  fs::remove_all(path("again"));

  const json scene = json::parse(read_bytes(path("scene export/race.json")));
  EXPECT_EQ(scene["instanced"], true);
  EXPECT_EQ(scene["scenes"], json::array({{{"first_instance", 0}, {"instances", 6}}}));
}

TEST_F(BenchRace, AnotherProgramTakesPart) {
  const BruteRacer racer(path("export"));
  const std::string results = racer.write(path("brute"));
  const Outcome outcome = compare(results, {"--json", "--plot", path("speed.svg")});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  const json report = json::parse(outcome.out);
  EXPECT_EQ(report["compare"], json::array({results}));
  ASSERT_EQ(report["sets"].size(), 3u);
  for (const auto& [name, set] : report["sets"].items()) {
    SCOPED_TRACE(name);
    ASSERT_EQ(set["entrants"].size(), 1u);
    const json& entrant = set["entrants"][0];
    EXPECT_EQ(entrant["program"], "brute <&> force 1.0");
    EXPECT_EQ(entrant["file"], results);
    EXPECT_EQ(entrant["passes"], 3);
    EXPECT_DOUBLE_EQ(entrant["mrays_per_s"].get<double>(), set["rays"].get<double>() / 0.5 * 1e-6);
    EXPECT_DOUBLE_EQ(entrant["lowest"].get<double>(), set["rays"].get<double>() / 1.0 * 1e-6);
    EXPECT_DOUBLE_EQ(entrant["highest"].get<double>(), set["rays"].get<double>() / 0.25 * 1e-6);
    EXPECT_DOUBLE_EQ(entrant["ratio"].get<double>(),
                     set["nif"]["mrays_per_s"].get<double>() / entrant["mrays_per_s"].get<double>());
    EXPECT_EQ(entrant["wrong"], 0);
    EXPECT_LT(entrant["differing"].get<double>(), 5);
    EXPECT_FALSE(entrant.contains("hits") || entrant.contains("bytes") || entrant.contains("variant"));
  }
  const std::string picture = read_bytes(path("speed.svg"));
  EXPECT_NE(picture.find("brute &lt;&amp;&gt; force 1.0"), std::string::npos);
  const Outcome text = compare(results);
  EXPECT_NE(text.out.find("Other programs"), std::string::npos) << text.out;
  EXPECT_NE(text.out.find("brute <&> force 1.0"), std::string::npos) << text.out;
  for (const char* name : {"speed.svg", "brute"}) fs::remove_all(path(name));
}

TEST_F(BenchRace, FirstHitsOfScenesOfInstances) {
  BruteRacer racer(path("scene export"));
  for (json& result : racer.results["results"]) {
    result["variant"] = "all \"triangles\"";
    result["bytes"] = 123456;
  }
  racer.results["processor"] = "an abacus";
  const std::string results = racer.write(path("brute"));
  const Outcome outcome = compare(results, {"--hits", "--json"}, true);
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const json report = json::parse(outcome.out);
  ASSERT_EQ(report["sets"].size(), 4u);
  for (const auto& [name, set] : report["sets"].items()) {
    SCOPED_TRACE(name);
    const json& entrant = set["entrants"][0];
    EXPECT_EQ(entrant["variant"], "all \"triangles\"");
    EXPECT_EQ(entrant["bytes"], 123456);
    EXPECT_EQ(entrant["wrong"], 0);
    EXPECT_LT(entrant["differing"].get<double>(), 5);
    EXPECT_GT(entrant["hits"]["compared"].get<double>(), 100);
    EXPECT_EQ(entrant["hits"]["misplaced"], 0);
    EXPECT_LT(entrant["hits"]["displaced"].get<double>(), 5);
    EXPECT_LT(entrant["hits"]["other"].get<double>(), 5);
  }
  // Each object by itself, too, and as tables and a picture of a scene.
  const std::string alone = BruteRacer(path("export")).write(path("brute alone"));
  const Outcome objects = compare(alone, {"--hits", "--set", "inner-surface", "--json"});
  ASSERT_EQ(objects.code, 0) << objects.err;
  const json hits = json::parse(objects.out)["sets"]["inner-surface"]["entrants"][0]["hits"];
  EXPECT_EQ(hits["misplaced"], 0);
  EXPECT_LT(hits["other"].get<double>(), 5);
  std::vector<std::string> words{"bench",    glb_,        "--asset", glb_ + ".nif", "--rays",         "1500",
                                 "--rounds", "1",         "-j",      "1",           "--moved",        "0",
                                 "--hits",   "--compare", results,   "--plot",      path("scene.svg")};
  const Outcome loud = nif(words);
  ASSERT_EQ(loud.code, 0) << loud.err;
  EXPECT_NE(loud.err.find("another processor, an abacus"), std::string::npos) << loud.err;
  EXPECT_NE(loud.out.find("t differs"), std::string::npos) << loud.out;
  EXPECT_NE(read_bytes(path("scene.svg")).find("6 instances of"), std::string::npos);
  for (const char* name : {"brute", "brute alone", "scene.svg"}) fs::remove_all(path(name));
}

TEST_F(BenchRace, WrongAnswersAreCounted) {
  BruteRacer racer(path("scene export"));
  for (auto& [name, answers] : racer.answers) {
    size_t hits = 0;
    for (size_t i = 0; i < answers.t.size(); ++i) {
      if (i % 10 == 0) answers.visible[i] ^= 1;
      if (std::isinf(answers.t[i])) continue;
      switch (hits++ % 8) {
        case 0:
          answers.t[i] = std::numeric_limits<float>::infinity();
          break;
        case 1:
          answers.t[i] = answers.t[i] * 1.01f + 0.1f;
          break;
        case 2:
          answers.instance[i] = (answers.instance[i] + 2) % 6;
          break;
      }
    }
  }
  const std::string results = racer.write(path("wrong"));
  for (const bool first_hits : {false, true}) {
    std::vector<std::string> more{"--json"};
    if (first_hits) more.push_back("--hits");
    const Outcome outcome = compare(results, more, true);
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    for (const auto& [name, set] : json::parse(outcome.out)["sets"].items()) {
      SCOPED_TRACE(name);
      const json& entrant = set["entrants"][0];
      const double rays = set["rays"], differing = entrant["differing"], wrong = entrant["wrong"];
      EXPECT_GT(wrong, 0.95 * differing);
      if (!first_hits) {
        EXPECT_NEAR(differing, rays / 10, 5);
        continue;
      }
      const json& hits = entrant["hits"];
      const double compared = hits["compared"];
      EXPECT_NEAR(differing, compared / 7, 6);
      EXPECT_NEAR(hits["displaced"].get<double>(), compared / 7, 6);
      EXPECT_GT(hits["misplaced"].get<double>(), 0.8 * hits["displaced"].get<double>());
      EXPECT_NEAR(hits["other"].get<double>(), compared / 7, 12);
    }
  }
  fs::remove_all(path("wrong"));
}

TEST_F(BenchRace, RefusesResultsByFileAndMember) {
  const BruteRacer racer(path("export"));
  const std::string folder = path("bad"), results = racer.write(folder);
  struct Refusal {
    std::string patch;  ///< of results.json (RFC 6902)
    std::string named;
    Status status = Status::malformed_results;
  };
  const std::string with_nul = R"([{"op":"replace","path":"/results/2/answers/visible","value":"a\u0000b"}])";
  const auto replace = [](const std::string& pointer, const std::string& value) {
    return fmt::format(R"([{{"op":"replace","path":"{}","value":{}}}])", pointer, value);
  };
  const auto remove = [](const std::string& pointer) {
    return fmt::format(R"([{{"op":"remove","path":"{}"}}])", pointer);
  };
  // The first result for a set of the race; camera is raced only with --hits.
  const std::string first = "/results/2";
  std::vector<Refusal> refusals{
      {replace("/schema", R"("nifkit.entrant/9")"), "/schema: must be nifkit.entrant/1"},
      {remove("/schema"), "/schema: is missing"},
      {remove("/program"), "/program: is missing"},
      {replace("/program", R"("\u001b[2J")"), "/program: must be text"},
      {replace("/program", "\"" + std::string(61, 'x') + "\""), "/program: must be text"},
      {replace("/version", "3"), "/version: must be text"},
      {replace("/processor", "7"), "/processor: must be text"},
      {replace("/results", "[]"), "/results: must be an array of 1 to 1000"},
      {replace("/results", "7"), "/results: must be an array"},
      {replace("/results", "[[]]"), "/results/0: must be an object"},
      {replace(first + "/set", R"("moon")"), "/results/2/set: must be one of outer-lines"},
      {replace(first + "/hash", R"("xxh3-64:0000000000000000")"),
       "/results/2/hash: xxh3-64:0000000000000000"},
      {remove(first + "/hash"), "/results/2/hash: is missing"},
      {replace(first + "/threads", "0"), "/results/2/threads: must be a whole number from 1 to 1024"},
      {replace(first + "/threads", "-1"), "/results/2/threads"},
      {replace(first + "/threads", "1.5"), "/results/2/threads"},
      {replace(first + "/query", R"("any")"), "/results/2/query: must be one of visibility, hits"},
      {replace(first + "/seconds", "[]"), "/results/2/seconds: must be an array of 1 to 1000"},
      {replace(first + "/seconds", "[0.1, 0]"), "/results/2/seconds/1: must be a number of seconds"},
      {replace(first + "/seconds", "[-3]"), "/results/2/seconds/0"},
      {replace(first + "/seconds", "[1e300]"), "/results/2/seconds/0"},
      {replace(first + "/seconds", "\"fast\""), "/results/2/seconds"},
      {replace(first + "/answers", "{}"), "/results/2/answers/visible: is missing"},
      {replace(first + "/answers", "[]"), "/results/2/answers: must be an object"},
      {replace(first + "/answers/visible", R"("../outer-lines.visible")"), "/results/2/answers/visible"},
      {replace(first + "/answers/visible", "\"" + folder + "/sun.visible\""), "/results/2/answers/visible"},
      {replace(first + "/answers/visible", R"("")"), "/results/2/answers/visible"},
      {with_nul, "/results/2/answers/visible"},
      {replace(first + "/answers/visible", R"("none")"), "none", Status::file_not_found},
      {replace(first + "/answers/visible", R"("results.json")"),
       "bytes, but the answers to 2000 rays have 2000"},
      {replace("/results/1/answers", R"({"visible":"x"})"), "/results/1/answers/t: is missing"},
      {replace("/results/1", racer.results["results"][0].dump()), "/results/1: has the set, threads"}};
  for (const Refusal& refusal : refusals) {
    SCOPED_TRACE(refusal.patch);
    std::ofstream(results) << racer.results.patch(json::parse(refusal.patch)).dump();
    const Outcome outcome = compare(results);
    EXPECT_EQ(outcome.code, int(refusal.status)) << outcome.err;
    EXPECT_EQ(outcome.out, "");
    EXPECT_EQ(lines_of(outcome.err).size(), 1u) << outcome.err;
    EXPECT_NE(outcome.err.find(refusal.named), std::string::npos) << refusal.named << " in: " << outcome.err;
    EXPECT_NE(outcome.err.find(folder), std::string::npos) << outcome.err;
  }
  for (const std::string& text :
       {std::string(), std::string("{"), std::string("[]"), std::string(100000, '['),
        std::string("{\"schema\": 1e999}"), std::string("\xff\xfe")}) {
    std::ofstream(results) << text;
    const Outcome outcome = compare(results);
    EXPECT_TRUE(outcome.code == int(Status::malformed_results) || outcome.code == int(Status::file_empty))
        << text.substr(0, 20) << outcome.err;
    EXPECT_EQ(lines_of(outcome.err).size(), 1u) << outcome.err;
  }

  // Results of other threads, queries and rays are not those of this race.
  racer.write(folder);
  EXPECT_EQ(of_mesh({"--compare", results, "-j", "2", "--rounds", "1"}).code, int(Status::malformed_results));
  EXPECT_EQ(compare(results, {"--set", "segments"}).code, int(Status::malformed_results));
  const Outcome other = compare(results, {"--seed", "8"});
  EXPECT_EQ(other.code, int(Status::malformed_results));
  EXPECT_NE(other.err.find("is of other rays"), std::string::npos) << other.err;

  const auto refused_hits = [&](const std::string& named) {
    const Outcome outcome = compare(results, {"--hits"});
    EXPECT_EQ(outcome.code, int(Status::malformed_results)) << outcome.err;
    EXPECT_NE(outcome.err.find(named), std::string::npos) << named << " in: " << outcome.err;
  };
  BruteRacer changed = racer;
  changed.answers.back().second.t[7] = std::numeric_limits<float>::quiet_NaN();
  changed.write(folder);
  refused_hits("ray 7: t is not a number");
  changed = racer;
  std::vector<float>& t = changed.answers.front().second.t;
  const size_t hit = size_t(std::ranges::find_if(t, [](float x) { return !std::isinf(x); }) - t.begin());
  changed.answers.front().second.triangle[hit] = 0xfffffff0;
  changed.write(folder);
  refused_hits(fmt::format("ray {}: triangle 4294967280 of 256 does not exist", hit));
  changed = racer;
  changed.answers.front().second.instance[hit] = 1;
  changed.write(folder);
  refused_hits(fmt::format("ray {}: instance 1 is none of its scene", hit));
  changed = racer;
  changed.answers[1].second.visible[11] = 2;
  changed.write(folder);
  const Outcome two = compare(results);
  EXPECT_NE(two.err.find("ray 11: 2 is neither 0 nor 1"), std::string::npos) << two.err;

  // A pipe instead of answers would be waited for.
  racer.write(folder);
  const std::string name = racer.answers[1].first + ".visible";
  fs::remove(fs::path(folder) / name);
  ASSERT_EQ(::mkfifo((fs::path(folder) / name).c_str(), 0600), 0);
  EXPECT_EQ(compare(results).code, int(Status::file_unreadable));
  fs::remove_all(folder);
}

TEST_F(BenchRace, RefusesWhatCannotBeExported) {
  struct Refusal {
    std::vector<std::string> words;
    Status status;
    std::string named;
  };
  const std::string folder = path("full");
  fs::create_directory(folder);
  folder_->write("full/letter.txt", "kept");
  fs::create_directory(path("bare"));
  folder_->write("bare/race.json", "{}");
  for (const Refusal& refusal :
       {Refusal{{"--export", folder}, Status::usage, "letter.txt"},
        Refusal{{"--export", path("bare")}, Status::usage, "neither empty nor an earlier export"},
        Refusal{{"--export", mesh_}, Status::output_not_writable, "it is a file"},
        Refusal{{"--export", path("none/race")}, Status::output_folder_missing, "none"},
        Refusal{{"--export", mesh_ + "/race"}, Status::output_not_writable, "is not a folder"},
        Refusal{{"--export", path("x"), "-j", "1"}, Status::usage, "--threads"},
        Refusal{{"--export", path("x"), "--plot", path("x.svg")}, Status::usage, "--plot"},
        Refusal{{"--export", path("x"), "--compare", path("x.json")}, Status::usage, "--compare"},
        Refusal{{"--export", path("x"), "--device", "gpu"}, Status::usage, "--device"},
        Refusal{{"--compare", path("x.json"), "--device", "gpu"}, Status::usage, "--compare"},
        Refusal{{"--compare", path("x.json")}, Status::file_not_found, "x.json"}}) {
    SCOPED_TRACE(testing::PrintToString(refusal.words));
    const Outcome outcome = of_mesh(refusal.words);
    EXPECT_EQ(outcome.code, int(refusal.status)) << outcome.err;
    EXPECT_EQ(outcome.out, "");
    EXPECT_EQ(lines_of(outcome.err).size(), 1u) << outcome.err;
    EXPECT_NE(outcome.err.find(refusal.named), std::string::npos) << refusal.named << " in: " << outcome.err;
  }
  EXPECT_EQ(listing(folder), std::vector<std::string>{"letter.txt"});
  EXPECT_FALSE(fs::exists(path("x")));
  // A link to an empty folder stays a link.
  fs::create_directory(path("empty"));
  fs::create_directory_symlink(path("empty"), path("link"));
  EXPECT_EQ(of_mesh({"--export", path("link")}).code, 0);
  EXPECT_TRUE(fs::is_symlink(path("link")));
  EXPECT_TRUE(fs::exists(path("empty/race.json")));
  for (const char* name : {"full", "bare", "empty", "link"}) fs::remove_all(path(name));
}

TEST_F(BenchRace, AFailedExportLeavesTheEarlierOne) {
  const std::vector<std::string> before = listing(folder_->path());
  const std::map<std::string, std::string> files = files_of(path("export"));
  for (const std::string& target : {path("export"), path("new")}) {
    const Outcome limited =
        Process("/bin/sh", {"-c", "ulimit -f 40; exec \"$@\"", "sh", nif_path(), "bench", mesh_ + ".nif",
                            "--mesh", mesh_, "--rays", "5000", "--export", target})
            .finish();
    EXPECT_EQ(limited.code, int(Status::output_not_writable)) << limited.err;
    EXPECT_NE(limited.err.find("File too large"), std::string::npos) << limited.err;
    EXPECT_EQ(listing(folder_->path()), before);

    Process process(nif_path(),
                    {"bench", glb_, "--asset", glb_ + ".nif", "--rays", "2000000", "--export", target});
    ASSERT_TRUE(process.wait_for_error_text("drawing"));
    process.send(SIGINT);
    const Outcome cancelled = process.finish(120);
    EXPECT_EQ(cancelled.code, int(Status::interrupted)) << cancelled.err;
    EXPECT_EQ(listing(folder_->path()), before);
  }
  EXPECT_TRUE(files_of(path("export")) == files);

  // What a killed process left goes with the next export to the same folder; what is not ours stays.
  for (const char* name : {"new.tmp-01234567", "new.tmp-mine", "new.tmp-89abcdef"})
    fs::create_directory(path(name));
  folder_->write("new.tmp-01234567/positions.f32", "half");
  folder_->write("new.tmp-89abcdef/letter.txt", "kept");
  ASSERT_EQ(of_mesh({"--export", path("new")}).code, 0);
  EXPECT_FALSE(fs::exists(path("new.tmp-01234567")));
  EXPECT_TRUE(fs::exists(path("new.tmp-mine")));
  EXPECT_TRUE(fs::exists(path("new.tmp-89abcdef/letter.txt")));
  for (const char* name : {"new", "new.tmp-mine", "new.tmp-89abcdef"}) fs::remove_all(path(name));
}

}  // namespace
}  // namespace nif::test
