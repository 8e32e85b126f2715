// `nif bench` on small assets that the program has baked itself: what it reports, and what it refuses. The
// speeds themselves are not tested.
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <cctype>
#include <nlohmann/json.hpp>
#include <set>

#include "formats/base/status.hpp"
#include "tests/cli/mesh_text.hpp"
#include "tests/cli/program.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

using nlohmann::json;

/// Returns what is wrong with the nesting of a document's elements, or an empty text. Enough XML for our
/// pictures: no comments, CDATA or document types.
std::string xml_fault(const std::string& text) {
  std::vector<std::string> open;
  bool rooted = false;
  for (size_t at = 0; at < text.size();) {
    if (text[at] == '&') {
      const std::string entity = text.substr(at, text.find(';', at) - at + 1);
      if (entity != "&amp;" && entity != "&lt;" && entity != "&gt;") return "entity " + entity.substr(0, 10);
    }
    if (text[at] != '<') {
      if (open.empty() && !std::isspace(static_cast<unsigned char>(text[at]))) return "text outside";
      ++at;
      continue;
    }
    const size_t end = text.find('>', at);
    if (end == std::string::npos) return "an open tag";
    const std::string tag = text.substr(at + 1, end - at - 1);
    at = end + 1;
    if (std::count(tag.begin(), tag.end(), '"') % 2 || tag.find('<') != std::string::npos)
      return "tag " + tag;
    if (tag.front() == '?') continue;
    const std::string name =
        tag.substr(tag.front() == '/', tag.find_first_of(" /", 1) - (tag.front() == '/'));
    if (tag.front() == '/') {
      if (open.empty() || open.back() != name) return "unexpected </" + name + ">";
      open.pop_back();
    } else {
      if (open.empty() && rooted) return "a second root";
      rooted = true;
      if (tag.back() != '/') open.push_back(name);
    }
  }
  return rooted && open.empty() ? "" : "not closed";
}

TEST(XmlFault, SeesFaults) {
  EXPECT_EQ(xml_fault("<?xml version=\"1.0\"?>\n<a b=\"c\"><d/>x &amp; y</a>\n"), "");
  for (const char* text : {"", "<a>", "<a></b>", "<a/><b/>", "<a>x & y</a>", "<a b=\"c></a>", "x<a/>"})
    EXPECT_NE(xml_fault(text), "") << text;
}

class Bench : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TempDir;
    mesh_ = folder_->write("ring.obj", obj_text(torus(48, 24))).string();
    asset_ = (folder_->path() / "<a & b>.nif").string();
    ASSERT_EQ(nif({"bake", mesh_, "-o", asset_, "--preset", "fast", "--resolution", "24", "--encoding",
                   "segment", "--rays", "0", "--quiet"})
                  .code,
              0);
  }
  static void TearDownTestSuite() { delete folder_; }

  static std::vector<std::string> bench(std::vector<std::string> more) {
    more.insert(more.begin(),
                {"bench", asset_, "--mesh", mesh_, "--rays", "5000", "--rounds", "2", "--quiet"});
    return more;
  }
  static std::string path(const char* name) { return (folder_->path() / name).string(); }

  static inline TempDir* folder_ = nullptr;
  static inline std::string mesh_, asset_;
};

/// Speed needs a real GPU. The participants and their answers can be tested with an emulated one.
#ifdef NIF_EMULATED_MODULE
TEST_F(Bench, OnAGpu) {
  ASSERT_EQ(setenv("NIF_GPU_MODULE", NIF_EMULATED_MODULE, 1), 0);
  Outcome outcome = nif(bench({"--device", "gpu", "--json"}));
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const json result = json::parse(outcome.out);
  const json on_cpu = json::parse(nif(bench({"--threads", "1", "--json"})).out);
  EXPECT_EQ(result["schema"], "nifkit.bench-gpu/3");
  EXPECT_NE(nif({"bench", "--help"}).out.find("nifkit.bench-gpu/3"), std::string::npos);
  EXPECT_EQ(result["gpu"], "emulated GPU 0");
  EXPECT_EQ(result["against"], "bvh");
  EXPECT_EQ(result["rounds"], 2);
  ASSERT_EQ(result["sets"].size(), 3u);
  for (const auto& [name, set] : result["sets"].items()) {
    SCOPED_TRACE(name);
    for (const char* stated : {"rays", "error", "leak", "spurious", "certain", "certain_wrong"})
      EXPECT_EQ(set[stated], on_cpu["sets"][name][stated]) << stated;
    EXPECT_LT(set["other_error"].get<double>(), 1e-3) << "a BVH is exact";
    double fastest = 0, bar = 0;
    for (const char* side : {"one_kernel", "pipeline", "other", "single_bvh"}) {
      EXPECT_LE(set[side]["lowest"], set[side]["mrays_per_s"]) << side;
      EXPECT_LE(set[side]["mrays_per_s"], set[side]["highest"]) << side;
      const bool nif = side == std::string_view("one_kernel") || side == std::string_view("pipeline");
      double& fastest_of = nif ? fastest : bar;
      fastest_of = std::max(fastest_of, set[side]["mrays_per_s"].get<double>());
    }
    EXPECT_EQ(set[set["bar"].get<std::string>()]["mrays_per_s"], bar);
    EXPECT_GT(fastest, 0);
    EXPECT_DOUBLE_EQ(set["ratio"].get<double>(), fastest / bar);
    EXPECT_EQ(set[set["way"].get<std::string>()]["mrays_per_s"], fastest);
    EXPECT_FALSE(set.contains("stages") || set.contains("batches"));
  }
  for (const char* bytes : {"file", "gpu", "other"})
    EXPECT_GT(result["bytes"][bytes].get<uint64_t>(), 1000u) << bytes;

  outcome = nif(bench({"--device", "gpu", "--set", "inner-surface", "--stages", "--batches", "--json"}));
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const json more = json::parse(outcome.out)["sets"]["inner-surface"];
  ASSERT_EQ(more["stages"].size(), 7u);
  for (const char* stage : {"ray_cast", "outer_grids", "rest"})
    EXPECT_GT(more["stages"][stage]["ns"].get<double>(), 0) << stage;
  EXPECT_EQ(more["stages"]["order"]["ns"], 0) << "one object has two lists, which need none";
  ASSERT_EQ(more["batches"].size(), 3u) << "256, 1024 and 4096 of 5000 rays";
  for (const json& batch : more["batches"])
    for (const char* side : {"one_kernel", "pipeline", "other", "single_bvh"})
      EXPECT_GT(batch[side].get<double>(), 0);
  EXPECT_EQ(more["batches"][2]["rays"], 4096);

  // Half precision exists only in the pipeline.
  outcome = nif(bench({"--device", "gpu", "--set", "sun", "--precision", "half", "--json"}));
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const json half = json::parse(outcome.out);
  EXPECT_EQ(half["precision"], "half");
  EXPECT_FALSE(half["sets"]["sun"].contains("one_kernel"));
  EXPECT_EQ(half["sets"]["sun"]["way"], "pipeline");

  outcome = nif(bench({"--device", "gpu", "--set", "sun", "--stages", "--batches"}));
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("in each stage of the pipeline"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find("by rays per query"), std::string::npos) << outcome.out;
  outcome = nif(bench({"--device", "gpu", "--set", "sun"}));
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("on emulated GPU 0, against an exact BVH of the mesh"), std::string::npos)
      << outcome.out;
  ASSERT_EQ(setenv("NIF_GPU_MODULE", "/no/such/module.so", 1), 0);
  outcome = nif(bench({"--device", "gpu"}));
  EXPECT_EQ(outcome.code, int(Status::usage));
  EXPECT_NE(outcome.err.find("/no/such/module.so cannot be loaded"), std::string::npos) << outcome.err;
  unsetenv("NIF_GPU_MODULE");
}
#endif

void check_rate(const json& rate) {
  EXPECT_GT(rate["lowest"].get<double>(), 0);
  EXPECT_LE(rate["lowest"], rate["mrays_per_s"]);
  EXPECT_LE(rate["mrays_per_s"], rate["highest"]);
  EXPECT_GT(rate["bytes"].get<uint64_t>(), 1000u);
}

/// One set's results after two rounds with `finalists` calls of each build.
void check_set(const std::string& name, const json& set, size_t finalists, size_t calls = 7) {
  SCOPED_TRACE(name);
  EXPECT_EQ(set["rays"], 5000);
  EXPECT_DOUBLE_EQ(set["error"].get<double>(), set["leak"].get<double>() + set["spurious"].get<double>());
  EXPECT_LT(set["error"].get<double>(), 0.1);
  EXPECT_EQ(set["certain_wrong"], 0);
  check_rate(set["nif"]);
  check_rate(set["embree"]);
  EXPECT_DOUBLE_EQ(set["ratio"].get<double>(),
                   set["nif"]["mrays_per_s"].get<double>() / set["embree"]["mrays_per_s"].get<double>());
  EXPECT_LE(set["ratio_lowest"], set["ratio_highest"]);

  EXPECT_EQ(set["variants"].size(), 4u * (name == "sun" || name == "camera" ? 2 * calls - 1 : calls));
  EXPECT_EQ(set["variants"][0], set["embree"]);
  size_t raced = 0;
  for (const json& variant : set["variants"]) {
    SCOPED_TRACE(variant["variant"]);
    check_rate(variant);
    // Less than one ray in a thousand passes so close to an edge that the builds disagree.
    EXPECT_LT(variant["error"].get<double>(), 1e-3);
    const size_t rounds = variant["rounds"];
    raced += rounds > 0;
    if (rounds > 0) {
      EXPECT_EQ(rounds, 2u);
      EXPECT_LE(variant["mrays_per_s"], set["embree"]["mrays_per_s"]);
    }
  }
  EXPECT_EQ(raced, std::min(finalists * 4, set["variants"].size()));
}

TEST_F(Bench, StatesSpeedBesideError) {
  const std::vector<std::string> files = listing(folder_->path());
  const Outcome outcome = nif(bench({"--json", "-j", "1", "-j", "2"}));
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  const json result = json::parse(outcome.out);
  EXPECT_EQ(result["schema"], "nifkit.bench/1");
  EXPECT_NE(nif({"bench", "--help"}).out.find("nifkit.bench/1"), std::string::npos);
  EXPECT_EQ(result["file"], asset_);
  EXPECT_EQ(result["threads"], 1);
  EXPECT_NE(result["isa"], "");
  EXPECT_EQ(result["triangles"], 2 * 48 * 24);
  EXPECT_EQ(result["bytes"]["file"], std::filesystem::file_size(asset_));
  expect_parts_add_up(result["bytes"]);
  EXPECT_LT(result["bytes"]["embree"]["compact"], result["bytes"]["embree"]["default"]);
  EXPECT_EQ(result["sets"].size(), 3u);
  ASSERT_EQ(result["scaling"].size(), 2u);
  EXPECT_EQ(result["scaling"][0]["sets"], result["sets"]);
  EXPECT_EQ(result["scaling"][1]["threads"], 2);
  for (const json& run : result["scaling"]) {
    for (const char* name : {"outer-lines", "inner-surface", "sun"}) {
      ASSERT_TRUE(run["sets"].contains(name)) << name;
      check_set(name, run["sets"][name], 2);
      EXPECT_EQ(run["sets"][name]["error"], result["sets"][name]["error"]) << name;
    }
  }
  EXPECT_EQ(listing(folder_->path()), files);
}

TEST_F(Bench, LetsAllOfEmbreesCallsRaceOnRequest) {
  const Outcome outcome =
      nif(bench({"--json", "-j", "1", "--set", "segments", "--embree", "all", "--isa", "scalar"}));
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const json result = json::parse(outcome.out);
  EXPECT_EQ(result["isa"], "scalar");
  EXPECT_EQ(result["sets"].size(), 1u);
  check_set("segments", result["sets"]["segments"], 7);
}

TEST_F(Bench, TheLeastMemoryChangesNoAnswer) {
  json sets[2];
  for (const bool least : {false, true}) {
    std::vector<std::string> words = bench({"--json", "-j", "1", "--set", "segments"});
    if (least) words.push_back("--least-memory");
    const Outcome outcome = nif(words);
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    const json result = json::parse(outcome.out);
    EXPECT_EQ(result["configuration"], least ? "isa=auto,memory=least" : "isa=auto,memory=auto");
    sets[least] = result["sets"]["segments"];
  }
  EXPECT_EQ(sets[0]["error"], sets[1]["error"]);
  EXPECT_EQ(sets[0]["certain"], sets[1]["certain"]);
  EXPECT_LE(sets[1]["nif"]["bytes"], sets[0]["nif"]["bytes"]);
}

TEST_F(Bench, ErrorIsThatOfEval) {
  const Outcome ours = nif(bench({"--json", "-j", "1", "--set", "sun", "--set", "inner-volume"}));
  const Outcome eval = nif({"eval", asset_, "--mesh", mesh_, "--rays", "5000", "--json", "--quiet"});
  ASSERT_EQ(ours.code, 0) << ours.err;
  ASSERT_EQ(eval.code, 0) << eval.err;
  const json sets = json::parse(ours.out)["sets"], expected = json::parse(eval.out)["sets"];
  EXPECT_EQ(sets.size(), 2u);
  for (const char* name : {"sun", "inner-volume"}) {
    for (const char* field : {"rays", "error", "leak", "spurious", "certain", "certain_wrong"})
      EXPECT_EQ(sets[name][field], expected[name][field]) << name << " " << field;
  }
}

TEST_F(Bench, TimesTheStagesOfThePapersFields) {
  const std::string paper = path("paper.nif");
  ASSERT_EQ(nif({"bake", mesh_, "-o", paper, "--preset", "paper", "--training-rays", "20000", "--precision",
                 "half", "--rays", "0", "--quiet"})
                .code,
            0);
  const Outcome outcome =
      nif(bench({"--json", "-j", "1", "--set", "inner-surface", "--against", paper, "--stages"}));
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const json set = json::parse(outcome.out)["sets"]["inner-surface"];
  EXPECT_FALSE(set.contains("stages"));
  const json stages = set["against"]["stages"];
  for (const char* stage : {"ray_cast", "inner_grids", "inner_network"})
    EXPECT_GT(stages[stage]["ns"].get<double>(), 0) << stage;
  EXPECT_GT(stages["inner_network"]["ns"], stages["outer_network"]["ns"]);
  const Outcome text = nif(bench({"-j", "1", "--set", "inner-surface", "--against", paper, "--stages"}));
  EXPECT_NE(text.out.find("Stages of " + paper), std::string::npos) << text.out;
  const Outcome none = nif(bench({"--stages"}));
  EXPECT_EQ(none.code, int(Status::usage));
  EXPECT_NE(none.err.find("--stages"), std::string::npos) << none.err;
  std::filesystem::remove(paper);
}

TEST_F(Bench, RacesAnotherAssetOfTheSameMesh) {
  const std::string exact = path("exact.nif");
  ASSERT_EQ(nif({"bake", mesh_, "-o", exact, "--encoding", "bvh", "--rays", "0", "--quiet"}).code, 0);
  const Outcome outcome = nif(bench({"--json", "-j", "1", "--set", "outer-lines", "--against", exact}));
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const json result = json::parse(outcome.out), set = result["sets"]["outer-lines"];
  EXPECT_EQ(result["against"], exact);
  check_set("outer-lines", set, 2);
  check_rate(set["against"]);
  EXPECT_LT(set["against"]["error"], 1e-3);
  EXPECT_DOUBLE_EQ(set["against"]["ratio"].get<double>(),
                   set["nif"]["mrays_per_s"].get<double>() / set["against"]["mrays_per_s"].get<double>());
  const Outcome text = nif(bench({"-j", "1", "--set", "outer-lines", "--against", exact}));
  EXPECT_NE(text.out.find("against " + exact), std::string::npos) << text.out;

  const std::string mesh = folder_->write("other.obj", obj_text(torus(40, 24))).string();
  const std::string other = path("other.nif");
  ASSERT_EQ(nif({"bake", mesh, "-o", other, "--encoding", "bvh", "--rays", "0", "--quiet"}).code, 0);
  EXPECT_EQ(nif(bench({"--against", other})).code, int(Status::mesh_mismatch));
  for (const std::string& file : {exact, mesh, other}) std::filesystem::remove(file);
}

TEST_F(Bench, RacesFirstHits) {
  const std::string exact = path("exact.nif");
  ASSERT_EQ(nif({"bake", mesh_, "-o", exact, "--encoding", "exact", "--rays", "0", "--quiet"}).code, 0);
  const Outcome outcome =
      nif(bench({"--json", "-j", "1", "-j", "2", "--hits", "--embree", "all", "--against", exact}));
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const json result = json::parse(outcome.out);
  EXPECT_EQ(result["hits"], true);
  EXPECT_EQ(result["against"], exact);
  for (const json& run : result["scaling"]) {
    EXPECT_EQ(run["sets"].size(), 4u);
    EXPECT_TRUE(run["sets"].contains("camera"));
    for (const auto& [name, set] : run["sets"].items()) {
      check_set(name, set, 100, 5);
      check_rate(set["against"]);
      EXPECT_LT(set["against"]["error"], 1e-3);
      std::set<std::string> calls, with_hint;
      for (const json& variant : set["variants"]) {
        calls.insert(variant["call"]);
        if (variant["coherent"]) with_hint.insert(variant["call"]);
      }
      EXPECT_EQ(with_hint.size(), name == "sun" || name == "camera" ? 4u : 0u) << name;
      EXPECT_EQ(calls, (std::set<std::string>{"rtcIntersect1", "rtcIntersect4", "rtcIntersect8",
                                              "rtcIntersect16", "rtcIntersect1M"}));
    }
  }
  const Outcome text =
      nif(bench({"-j", "1", "--set", "inner-surface", "--hits", "--plot", path("hits.svg")}));
  EXPECT_NE(text.out.find("First hits: nifIntersect"), std::string::npos) << text.out;
  EXPECT_NE(read_bytes(path("hits.svg")).find("first hits"), std::string::npos);
  for (const char* file : {"exact.nif", "hits.svg"}) std::filesystem::remove(path(file));
}

TEST_F(Bench, PutsProofsInFrontOfEmbree) {
  const std::string planes = path("planes.nif");
  ASSERT_EQ(nif({"bake", mesh_, "-o", planes, "--encoding", "proof", "--rays", "0", "--quiet"}).code, 0);
  std::vector<std::string> arguments{"bench", planes, "--mesh", mesh_,     "--rays",     "5000",  "--rounds",
                                     "2",     "-j",   "1",      "--quiet", "--fallback", "embree"};
  const Outcome table = nif(arguments);
  ASSERT_EQ(table.code, 0) << table.err;
  EXPECT_NE(table.out.find("proofs first"), std::string::npos) << table.out;
  arguments.push_back("--json");
  const Outcome outcome = nif(arguments);
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const json result = json::parse(outcome.out);
  EXPECT_EQ(result["fallback"], "embree");
  for (const auto& [name, set] : result["sets"].items()) {
    EXPECT_NE(set["behind"].get<std::string>().find(" rtcOccluded"), std::string::npos) << name;
    EXPECT_GT(set["nif"]["mrays_per_s"].get<double>(), 0) << name;
    EXPECT_LE(set["error"].get<double>(), 1e-3) << name;
  }
}

TEST_F(Bench, PrintsATableAndDrawsAPicture) {
  const Outcome outcome = nif(bench({"--plot", path("speed.svg")}));
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  for (const char* word :
       {"outer-lines", "inner-surface", "sun", "1 thread", "rtcOccluded", "compact", "leak"})
    EXPECT_NE(outcome.out.find(word), std::string::npos) << word << " in:\n" << outcome.out;
  const std::string picture = read_bytes(path("speed.svg"));
  EXPECT_EQ(xml_fault(picture), "");
  EXPECT_NE(picture.find("&lt;a &amp; b&gt;.nif"), std::string::npos);
  for (const char* word : {"<svg xmlns=", "outer-lines", "% wrong", "1 thread", "Embree compact"})
    EXPECT_NE(picture.find(word), std::string::npos) << word;
  EXPECT_EQ(picture.find("nan"), std::string::npos);
  std::filesystem::remove(path("speed.svg"));
}

TEST_F(Bench, AddsUpObjects) {
  size_t base = 0;
  mesh::Mesh second = cube();
  std::string text = obj_object(torus(48, 24), "ring", base);
  text += obj_object(second, "box", base);
  const std::string mesh = folder_->write("two.obj", text).string();
  const std::string asset = path("two.nif");
  ASSERT_EQ(nif({"bake", mesh, "-o", asset, "--preset", "fast", "--resolution", "24", "--encoding", "segment",
                 "--rays", "0", "--quiet"})
                .code,
            0);
  const Outcome outcome = nif({"bench", asset, "--mesh", mesh, "--rays", "5000", "--rounds", "2", "--set",
                               "outer-lines", "-j", "1", "--json", "--quiet"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const json result = json::parse(outcome.out);
  EXPECT_EQ(result["objects"], 2);
  EXPECT_EQ(result["triangles"], 2 * 48 * 24 + 12);
  check_set("outer-lines", result["sets"]["outer-lines"], 2);
  for (const std::string& file : {mesh, asset}) std::filesystem::remove(file);
}

TEST_F(Bench, RefusesAnotherMesh) {
  const std::string other = folder_->write("other.obj", obj_text(cube())).string();
  const Outcome outcome = nif({"bench", asset_, "--mesh", other, "--quiet", "--plot", path("speed.svg")});
  EXPECT_EQ(outcome.code, int(Status::mesh_mismatch)) << outcome.err;
  EXPECT_EQ(outcome.out, "");
  for (const std::string& file : {asset_, other})
    EXPECT_NE(outcome.err.find(file), std::string::npos) << outcome.err;
  EXPECT_FALSE(std::filesystem::exists(path("speed.svg")));
  std::filesystem::remove(other);
}

TEST_F(Bench, RefusesAnUnknownInstructionSet) {
  const Outcome outcome = nif(bench({"--isa", "abacus"}));
  EXPECT_EQ(outcome.code, int(Status::usage)) << outcome.err;
  EXPECT_EQ(outcome.out, "");
  EXPECT_NE(outcome.err.find("abacus"), std::string::npos) << outcome.err;
}

TEST_F(Bench, RefusesAPictureThatCannotBeWritten) {
  const std::string before = read_bytes(mesh_);
  const Outcome over = nif(bench({"--plot", mesh_}));
  EXPECT_EQ(over.code, int(Status::usage)) << over.err;
  EXPECT_NE(over.err.find("--plot"), std::string::npos) << over.err;
  EXPECT_EQ(read_bytes(mesh_), before);
  const Outcome nowhere = nif(bench({"--plot", path("none/speed.svg")}));
  EXPECT_EQ(nowhere.code, int(Status::output_folder_missing)) << nowhere.err;
  EXPECT_EQ(nowhere.out, "");
}

TEST_F(Bench, InterruptedLeavesNothing) {
  const std::vector<std::string> files = listing(folder_->path());
  Process process(nif_path(),
                  {"bench", asset_, "--mesh", mesh_, "--rounds", "1000", "--plot", path("speed.svg")});
  ASSERT_TRUE(process.wait_for_error_text("outer-lines, 1 thread"));
  process.send(SIGINT);
  const Outcome outcome = process.finish(60);
  EXPECT_EQ(outcome.code, int(Status::interrupted)) << outcome.err;
  EXPECT_EQ(outcome.out, "");
  EXPECT_EQ(without_progress(outcome.err).size(), 1u) << outcome.err;
  EXPECT_EQ(listing(folder_->path()), files);
}

}  // namespace
}  // namespace nif::test
