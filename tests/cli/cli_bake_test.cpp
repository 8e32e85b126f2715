// Bakes small meshes through the program: what is written to the file and to the two streams, and what is
// not.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <map>
#include <nlohmann/json.hpp>
#include <tuple>

#include "formats/base/status.hpp"
#include "tests/cli/mesh_text.hpp"
#include "tests/cli/program.hpp"
#include "tests/support/gltf.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

using nlohmann::json;

class Bake : public testing::Test {
 protected:
  std::string path(const std::string& name) const { return (folder_.path() / name).string(); }

  /// A short bake of fields; `more` are extra arguments.
  Outcome bake(const std::string& mesh, const std::string& asset, std::vector<std::string> more = {}) const {
    more.insert(more.begin(), {"bake", mesh, "-o", asset, "--preset", "fast", "--resolution", "24", "--rays",
                               "20000", "--encoding", "segment"});
    return nif(more);
  }

  TempDir folder_;
  std::string ball_ = folder_.write("a ball \u00e9.obj", obj_text(icosphere(4))).string();
};

TEST_F(Bake, UncodedIsLargerAndTheSame) {
  const Outcome one = bake(ball_, path("one.nif"), {"--json"}),
                other = bake(ball_, path("other.nif"), {"--json", "--uncoded"});
  ASSERT_EQ(one.code, 0) << one.err;
  ASSERT_EQ(other.code, 0) << other.err;
  const json a = json::parse(one.out), b = json::parse(other.out);
  EXPECT_EQ(a["sets"], b["sets"]);
  EXPECT_EQ(a["objects"], b["objects"]);
  for (const char* part : {"occupancy", "planes", "features"})
    EXPECT_LT(a["bytes"][part].get<uint64_t>(), b["bytes"][part].get<uint64_t>()) << part;
  EXPECT_LT(a["bytes"]["file"].get<uint64_t>(), b["bytes"]["file"].get<uint64_t>());
  const json info = json::parse(nif({"info", path("other.nif"), "--json"}).out);
  EXPECT_EQ(info["metadata"]["options"]["uncoded"], true);
  for (const json& report : {a, b, info}) expect_parts_add_up(report["bytes"]);
}

TEST_F(Bake, PrintsJsonToStandardOutputAndProgressToStandardError) {
  ::setenv("NIF_PROGRESS", "", 1);
  const auto start = std::chrono::steady_clock::now();
  const Outcome outcome = bake(ball_, path("ball.nif"), {"--json"});
  ::unsetenv("NIF_PROGRESS");
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  ASSERT_EQ(outcome.code, 0) << outcome.err;

  const json result = json::parse(outcome.out);
  EXPECT_EQ(result["schema"], "nifkit.bake/2");
  EXPECT_EQ(result["file"], path("ball.nif"));
  EXPECT_EQ(result["triangles"], 20 * 256);
  EXPECT_GT(result["seconds"].get<double>(), 0);
  EXPECT_LE(result["seconds"].get<double>(), seconds);
  EXPECT_GT(result["peak_memory"].get<uint64_t>(), 1'000'000u);
  EXPECT_EQ(result["bytes"]["file"], std::filesystem::file_size(path("ball.nif")));
  for (const char* part : {"resident", "occupancy", "features", "network"})
    EXPECT_GT(result["bytes"][part].get<uint64_t>(), 0u) << part;
  expect_parts_add_up(result["bytes"]);
  for (const char* set : {"outer-lines", "inner-surface", "inner-volume", "segments", "sun"}) {
    SCOPED_TRACE(set);
    const json& accuracy = result["sets"][set];
    EXPECT_EQ(accuracy["rays"], 20000);
    EXPECT_EQ(accuracy["certain_wrong"], 0);
    const bool with_hits = std::string(set) == "outer-lines" || std::string(set) == "inner-surface";
    EXPECT_EQ(accuracy.contains("hits"), with_hits);
    EXPECT_EQ(result["objects"][0]["sets"][set].contains("hits"), with_hits);
    if (with_hits) {
      EXPECT_EQ(accuracy["hits"]["rays"], 2000);
      EXPECT_LT(accuracy["hits"]["missed"].get<double>(), 0.05);
      EXPECT_EQ(accuracy["hits"]["bounds_wrong"], 0);
      // Rays from the surface of a ball hit nothing.
      EXPECT_EQ(accuracy["hits"].contains("voxels"), std::string(set) == "outer-lines");
      if (accuracy["hits"].contains("voxels")) {
        EXPECT_LT(accuracy["hits"]["voxels"]["median"].get<double>(), 0.2);
        EXPECT_LE(accuracy["hits"]["degrees"]["median"], accuracy["hits"]["degrees"]["p90"]);
        EXPECT_GT(accuracy["hits"]["diagonals"]["p99"], 0);
      }
    }
    const double leak = accuracy["leak"], spurious = accuracy["spurious"], error = accuracy["error"];
    EXPECT_NEAR(error, leak + spurious, 1e-12);
    // Shares, not percent; and a ball is easy.
    EXPECT_LT(error, 0.05);
    EXPECT_LE(accuracy["certain"].get<double>(), 1);
    EXPECT_LT(accuracy["brier"].get<double>(), 0.05);
  }

  // A log gets a few whole lines and no cursor movement.
  const std::vector<std::string> lines = lines_of(outcome.err);
  EXPECT_TRUE(without_progress(outcome.err).empty()) << outcome.err;
  EXPECT_LE(double(lines.size()), std::min(seconds, 11.0));
  EXPECT_EQ(outcome.err.find_first_of("\r\033"), std::string::npos);
}

TEST_F(Bake, PrintsASummaryForPeople) {
  const Outcome outcome = bake(ball_, path("ball.nif"));
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  for (const char* word : {"ball.nif", "5120 triangles", "outer-lines", "leak", "spurious", "certain"})
    EXPECT_NE(outcome.out.find(word), std::string::npos) << word << " in:\n" << outcome.out;
  EXPECT_EQ(listing(folder_.path()), (std::vector<std::string>{"a ball \u00e9.obj", "ball.nif"}));
}

/// The text of a page between two headings.
std::string between(const std::string& page, const std::string& from, const std::string& to) {
  const size_t begin = page.find("<h2>" + from), end = page.find("<h2>" + to);
  return begin < end && end != std::string::npos ? page.substr(begin, end - begin) : "";
}

TEST_F(Bake, WritesAReportForPeople) {
  std::string pages[2];
  for (const int threads : {1, 2}) {
    const Outcome outcome =
        bake(ball_, path("ball.nif"), {"--report", path("r.html"), "-j", std::to_string(threads), "--quiet"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_EQ(outcome.out + outcome.err, "");
    pages[threads - 1] = read_bytes(path("r.html"));
  }
  const std::string& page = pages[0];
  EXPECT_LT(page.size(), 3'000'000u);
  // From four sides: Embree, the asset, their difference, and where answers are wrong.
  size_t pictures = 0;
  for (size_t at = 0; (at = page.find("src=\"", at)) != std::string::npos; ++at, ++pictures)
    EXPECT_EQ(page.compare(at + 5, 22, "data:image/png;base64,"), 0);
  EXPECT_EQ(pictures, 16u);
  for (const char* remote : {"http:", "https:", "src=//", "@import", "url("})
    EXPECT_EQ(page.find(remote), std::string::npos) << remote;
  EXPECT_NE(between(page, "Training", "Settings").find("<polyline"), std::string::npos);
  EXPECT_NE(page.find("<dt>preset</dt><dd>fast</dd>"), std::string::npos);
  // The rays are the same for any number of threads, and an exact asset makes no mistakes.
  const std::string asked = between(page, "Errors by angle", "Bytes by part");
  EXPECT_NE(asked, "");
  EXPECT_EQ(asked, between(pages[1], "Errors by angle", "Bytes by part"));
  EXPECT_EQ(between(page, "Pictures", "Errors by ray set"),
            between(pages[1], "Pictures", "Errors by ray set"));
  EXPECT_EQ(page.find("rays, 0.000 % are answered"), std::string::npos);
  ASSERT_EQ(nif({"bake", ball_, "-o", path("e.nif"), "--encoding", "exact", "--rays", "0", "--report",
                 path("e.html"), "--quiet"})
                .code,
            0);
  const std::string exact = between(read_bytes(path("e.html")), "Errors by angle", "Bytes by part");
  EXPECT_NE(exact.find("80 to 90 degrees"), std::string::npos);
  EXPECT_EQ(exact.find("0.001 %"), std::string::npos);
  size_t right = 0;
  for (size_t at = 0; (at = exact.find(">0.000 % of ", at)) != std::string::npos; ++at) ++right;
  EXPECT_EQ(right, 14u);
}

TEST_F(Bake, AReportReplacesNoOtherFile) {
  const std::string before = read_bytes(ball_);
  EXPECT_EQ(bake(ball_, path("ball.nif"), {"--report", ball_}).code, int(Status::usage));
  EXPECT_EQ(bake(ball_, path("ball.nif"), {"--report", path("./ball.nif")}).code, int(Status::usage));
  EXPECT_EQ(bake(ball_, path("ball.nif"), {"--report", path("r"), "--depfile", path("r")}).code,
            int(Status::usage));
  EXPECT_EQ(bake(ball_, path("ball.nif"), {"--report", path("none/r.html")}).code,
            int(Status::output_folder_missing));
  EXPECT_EQ(read_bytes(ball_), before);
  EXPECT_FALSE(std::filesystem::exists(path("ball.nif")));
}

TEST_F(Bake, ReplacesNoFileThatItReads) {
  const Gltf gltf = gltf_of(cube());
  const std::string mesh = folder_.write("m.gltf", gltf.gltf("m.bin")),
                    buffer = folder_.write("m.bin", gltf.data);
  const auto refused = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"bake", mesh, "--encoding", "bvh", "--rays", "0"});
    const Outcome outcome = nif(more);
    EXPECT_EQ(outcome.code, int(Status::usage)) << outcome.err;
    EXPECT_NE(outcome.err.find("would overwrite the input"), std::string::npos) << outcome.err;
    EXPECT_EQ(read_bytes(buffer), gltf.data);
  };
  refused({"-o", buffer});
  refused({"-o", path("m.nif"), "--depfile", buffer});
  refused({"-o", path("m.nif"), "--report", buffer});
}

/// A file with the name of a checkpoint may be anybody's.
TEST_F(Bake, RemovesNoFileThatOnlyHasTheNameOfACheckpoint) {
  folder_.write("a.nif.checkpoint", "precious");
  std::filesystem::create_directory(path("b.nif.checkpoint"));
  for (const char* name : {"a.nif", "b.nif"})
    EXPECT_EQ(nif({"bake", ball_, "-o", path(name), "--encoding", "bvh", "--rays", "0"}).code, 0);
  EXPECT_EQ(read_bytes(path("a.nif.checkpoint")), "precious");
  EXPECT_TRUE(std::filesystem::exists(path("b.nif.checkpoint")));
  ASSERT_EQ(::mkfifo(path("c.nif.checkpoint").c_str(), 0600), 0);  // nobody writes to it
  EXPECT_EQ(bake(ball_, path("c.nif"), {"--resume"}).code, int(Status::checkpoint_refused));
}

/// A mesh may refer to files by any name.
TEST_F(Bake, DepfilesTellMakeOfFilesOnly) {
  for (const char* name : {"a\nall:\n\ttouch x", "a;touch x", "a\tb"}) {
    Gltf gltf = gltf_of(cube());
    folder_.write(name, gltf.data);
    const Outcome outcome = nif({"bake", folder_.write("m.gltf", gltf.gltf(name)), "-o", path("m.nif"),
                                 "--encoding", "bvh", "--rays", "0", "--depfile", path("m.d")});
    EXPECT_EQ(outcome.code, int(Status::usage)) << outcome.err;
    EXPECT_NE(outcome.err.find("a makefile cannot contain"), std::string::npos) << outcome.err;
    EXPECT_FALSE(std::filesystem::exists(path("m.d")));
    EXPECT_FALSE(std::filesystem::exists(path("m.nif")));
  }
}

TEST_F(Bake, ErrorsAndNotesLeaveTheTerminalAlone) {
  const Outcome error = bake(folder_.write("a.obj", "v \x1b]0;x\x07 0 0\n"), path("a.nif"));
  EXPECT_NE(error.err.find("'\\x1b]0;x\\x07'"), std::string::npos) << error.err;
  Gltf gltf = gltf_of(cube());
  gltf.json["meshes"][0]["name"] = "\x1b[2J\u009b1m";
  gltf.json["meshes"][0]["primitives"].push_back({{"attributes", {{"POSITION", 0}}}, {"mode", 1}});
  const Outcome note = nif(
      {"bake", folder_.write("b.glb", gltf.glb()), "-o", path("b.nif"), "--encoding", "bvh", "--rays", "0"});
  EXPECT_EQ(note.code, 0) << note.err;
  EXPECT_NE(note.err.find("'\\x1b[2J\\x9b1m'"), std::string::npos) << note.err;
  for (const std::string& text : {error.err, note.err, note.out}) {
    EXPECT_EQ(text.find('\x1b'), std::string::npos) << text;
    EXPECT_EQ(text.find("\u009b"), std::string::npos) << text;
  }
}

TEST_F(Bake, QuietIsSilent) {
  const Outcome outcome = bake(ball_, path("ball.nif"), {"--quiet"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(outcome.out, "");
  EXPECT_EQ(outcome.err, "");
  EXPECT_TRUE(std::filesystem::exists(path("ball.nif")));
  const Outcome with_json = bake(ball_, path("ball.nif"), {"--quiet", "--json"});
  EXPECT_TRUE(json::accept(with_json.out)) << with_json.out;
  EXPECT_EQ(with_json.err, "");
}

TEST_F(Bake, TheSameBytesForAnyNumberOfThreadsAndByEitherName) {
  ASSERT_EQ(bake(ball_, path("one.nif"), {"--quiet", "-j", "1"}).code, 0);
  ASSERT_EQ(bake(ball_, path("two.nif"), {"--quiet", "-j", "2"}).code, 0);
  const std::vector<std::string> rest{ball_,          "-o",     path("alias.nif"), "--preset", "fast",
                                      "--resolution", "24",     "--rays",          "20000",    "--encoding",
                                      "segment",      "--quiet"};
  ASSERT_EQ(Process(nif_path().parent_path() / "nif-bake", rest).finish().code, 0);
  const std::string one = read_bytes(path("one.nif"));
  EXPECT_FALSE(one.empty());
  EXPECT_TRUE(one == read_bytes(path("two.nif"))) << "-j 1 and -j 2 differ";
  EXPECT_TRUE(one == read_bytes(path("alias.nif"))) << "nif bake and nif-bake differ";
}

TEST_F(Bake, LimitsAnErrorAndSaysSoEverywhere) {
  const std::string ring = folder_.write("ring.obj", obj_text(torus(40, 20))).string();
  const Outcome outcome = bake(ring, path("leak.nif"), {"--json", "--max-leak", "0.1%"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const json limit = json::parse(outcome.out)["objects"][0]["error_limit"];
  EXPECT_EQ(limit["against"], "leak");
  EXPECT_EQ(limit["rate"], 0.001);
  EXPECT_EQ(limit["proven"], false);
  EXPECT_GT(limit["threshold"].get<int>(), 0);
  for (const char* set : {"outer-lines", "inner-surface", "inner-volume", "segments", "sun"}) {
    EXPECT_GE(limit["sets"][set]["rays"].get<uint64_t>(), 200'000u) << set;
    EXPECT_LE(limit["sets"][set]["leak"].get<double>(), limit["sets"][set]["bound"].get<double>()) << set;
    EXPECT_LE(limit["sets"][set]["bound"].get<double>(), 0.001) << set;
  }

  const json info = json::parse(nif({"info", path("leak.nif"), "--json"}).out);
  EXPECT_EQ(info["objects"][0]["threshold"], limit["threshold"]);
  EXPECT_EQ(info["metadata"]["objects"][0]["error_limit"], limit);
  EXPECT_NE(nif({"info", path("leak.nif")}).out.find("favours occluded by"), std::string::npos);

  std::vector<std::string> eval{"eval", path("leak.nif"), "--mesh", ring, "--rays", "100000"};
  const Outcome table = nif(eval);
  EXPECT_NE(table.out.find("--max-leak 0.001"), std::string::npos) << table.out;
  eval.insert(eval.end(), {"--json", "--reference"});
  const json measured = json::parse(nif(eval).out);
  EXPECT_EQ(measured["objects"][0]["error_limit"], limit);
  EXPECT_EQ(measured["reference"]["different"], 0);
  for (const auto& [set, accuracy] : measured["sets"].items())
    EXPECT_LE(accuracy["leak"].get<double>(), 0.001) << set;

  // As text, and for a rate that is too low to be counted.
  const Outcome summary = bake(ring, path("none.nif"), {"--max-spurious", "1e-9"});
  ASSERT_EQ(summary.code, 0) << summary.err;
  EXPECT_NE(summary.out.find("limits spurious answers"), std::string::npos) << summary.out;
  EXPECT_NE(summary.err.find("--max-spurious 1e-09"), std::string::npos) << summary.err;
  EXPECT_NE(nif({"info", path("none.nif")}).out.find("favours visible by"), std::string::npos);
  // Without a limit nothing mentions one.
  const Outcome upright = bake(ring, path("upright.nif"), {"--json"});
  EXPECT_EQ(upright.out.find("error_limit"), std::string::npos);
  EXPECT_EQ(json::parse(nif({"info", path("upright.nif"), "--json"}).out)["objects"][0]["threshold"], 0);
}

TEST_F(Bake, AnotherSeedIsAnotherFile) {
  ASSERT_EQ(bake(ball_, path("one.nif"), {"--quiet"}).code, 0);
  ASSERT_EQ(bake(ball_, path("two.nif"), {"--quiet", "--seed", "2"}).code, 0);
  EXPECT_FALSE(read_bytes(path("one.nif")) == read_bytes(path("two.nif")));
}

TEST_F(Bake, DropsBadTrianglesAndSaysHowMany) {
  mesh::Mesh mesh = icosphere(3);
  mesh.triangles.push_back(mesh.triangles[5]);
  mesh.triangles.push_back(mesh.triangles[6]);
  mesh.triangles.push_back({1, 1, 2});
  const std::string file = folder_.write("bad.obj", obj_text(mesh)).string();
  const Outcome outcome = bake(file, path("bad.nif"), {"--json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const json result = json::parse(outcome.out);
  EXPECT_EQ(result["triangles"], 20 * 64);
  EXPECT_EQ(result["objects"][0]["duplicate"], 2);
  EXPECT_EQ(result["objects"][0]["degenerate"], 1);
  const std::vector<std::string> notes = without_progress(outcome.err);
  ASSERT_EQ(notes.size(), 1u) << outcome.err;
  EXPECT_EQ(
      notes[0],
      "nif: note: 'icosphere': dropped 1 triangle without area, dropped 2 triangles that another one covers");
}

TEST_F(Bake, TurnsTrianglesForTheInsideToBeKnownAndStrictRefuses) {
  mesh::Mesh mesh = icosphere(3);
  for (const size_t t : {7, 100, 101}) std::swap(mesh.triangles[t][0], mesh.triangles[t][1]);
  const std::string file = folder_.write("turned.obj", obj_text(mesh)).string();
  const Outcome outcome = bake(file, path("turned.nif"), {"--json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const json object = json::parse(outcome.out)["objects"][0];
  EXPECT_EQ(object["turned"], 3);
  EXPECT_EQ(object["closed_components"], 1);
  const std::string note = "'icosphere': turned 3 triangles to face as those around";
  ASSERT_EQ(without_progress(outcome.err).size(), 1u) << outcome.err;
  EXPECT_EQ(without_progress(outcome.err)[0], "nif: note: " + note);

  const Outcome strict = bake(file, path("strict.nif"), {"--strict"});
  EXPECT_EQ(strict.code, int(Status::needs_repair));
  EXPECT_NE(strict.err.find(
                "turned.obj: --strict refuses meshes that need repair or are not read completely: " + note),
            std::string::npos)
      << strict.err;
  EXPECT_FALSE(std::filesystem::exists(path("strict.nif")));
  EXPECT_EQ(bake(ball_, path("ball.nif"), {"--strict", "--quiet"}).code, 0);
}

TEST_F(Bake, KeepsNamesAndBakesEqualMeshesOnce) {
  size_t base = 0;
  std::string text = obj_object(icosphere(2), "left ball", base);
  text += obj_object(torus(24, 12), "ring", base);
  text += obj_object(icosphere(2), "right ball", base);
  const std::string file = folder_.write("three.obj", text).string();
  ASSERT_EQ(bake(file, path("three.nif"), {"--quiet"}).code, 0);
  const Outcome outcome = nif({"info", path("three.nif"), "--json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const json info = json::parse(outcome.out);
  EXPECT_EQ(info["schema"], "nifkit.info/2");
  ASSERT_EQ(info["objects"].size(), 2u);
  ASSERT_EQ(info["instances"].size(), 3u);
  EXPECT_EQ(info["objects"][0]["name"], "left ball");
  EXPECT_EQ(info["objects"][1]["name"], "ring");
  EXPECT_EQ(info["instances"][2]["name"], "right ball");
  EXPECT_EQ(info["instances"][2]["object"], 0);
  EXPECT_EQ(info["metadata"]["seed"], 1);
  EXPECT_EQ(info["bytes"]["file"], std::filesystem::file_size(path("three.nif")));
  // The same file wherever it is baked: it contains no path, time or number of threads.
  EXPECT_EQ(read_bytes(path("three.nif")).find(folder_.path().string()), std::string::npos);
}

class TargetOf : public Bake {
 protected:
  void expect_missed(const std::vector<std::string>& target) {
    std::vector<std::string> arguments{"bake",     ball_,  "-o",         path("ball.nif"),
                                       "--preset", "fast", "--encoding", "segment"};
    arguments.insert(arguments.end(), target.begin(), target.end());
    const Outcome outcome = nif(arguments);
    EXPECT_EQ(outcome.code, int(Status::target_not_met)) << outcome.err;
    EXPECT_EQ(outcome.out, "");
    const std::vector<std::string> lines = without_progress(outcome.err);
    ASSERT_EQ(lines.size(), 1u) << outcome.err;
    EXPECT_NE(lines[0].find(target[0]), std::string::npos) << lines[0];
    EXPECT_EQ(listing(folder_.path()).size(), 1u);
  }
};

TEST_F(TargetOf, BytesThatCannotBeReachedLeavesNoFile) { expect_missed({"--max-bytes", "1kB"}); }
TEST_F(TargetOf, ErrorThatCannotBeReachedLeavesNoFile) {
  // The larger grids that the search would try next are beyond this size.
  expect_missed({"--max-error", "0.0001%", "--rays", "50000", "--max-bytes", "40kB"});
}

TEST_F(Bake, MaxBytesIsOfTheWholeFile) {
  ASSERT_EQ(nif({"bake", ball_, "-o", path("ball.nif"), "--preset", "fast", "--max-bytes", "9kB", "--rays",
                 "20000", "--quiet"})
                .code,
            0);
  EXPECT_LE(std::filesystem::file_size(path("ball.nif")), 9000u);
}

class ExactBake : public Bake, public testing::WithParamInterface<const char*> {};

INSTANTIATE_TEST_SUITE_P(Each, ExactBake, testing::Values("bvh", "exact"),
                         [](const auto& p) { return p.param; });

TEST_P(ExactBake, AnswersExactly) {
  const std::string encoding = GetParam();
  const Outcome outcome =
      nif({"bake", ball_, "-o", path("ball.nif"), "--encoding", encoding, "--rays", "20000", "--json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const json result = json::parse(outcome.out);
  EXPECT_EQ(result["bytes"]["features"], 0);
  EXPECT_GT(result["bytes"]["bvh"], 10 * 5120);
  EXPECT_EQ(result["objects"][0]["encoding"], encoding);
  EXPECT_EQ(result["bytes"]["planes"] > 0, encoding == "exact");
  EXPECT_EQ(result["objects"][0]["reason"], "as requested");
  EXPECT_EQ(result["objects"][0]["training_rays"], 0);
  for (const auto& [name, accuracy] : result["sets"].items()) {
    EXPECT_LE(accuracy["error"].get<double>(), 1e-4) << name;
    EXPECT_EQ(accuracy["certain"], 1) << name;
    EXPECT_EQ(accuracy["certain_wrong"], 0) << name;
  }

  // By the runtime, with this machine's kernels and with the reference.
  const Outcome eval =
      nif({"eval", path("ball.nif"), "--mesh", ball_, "--rays", "20000", "--reference", "--json"});
  ASSERT_EQ(eval.code, 0) << eval.err;
  EXPECT_EQ(json::parse(eval.out)["reference"]["different"], 0);
  EXPECT_LE(json::parse(eval.out)["sets"]["inner-surface"]["error"].get<double>(), 1e-4);

  const Outcome info = nif({"info", path("ball.nif"), "--json"}), text = nif({"info", path("ball.nif")});
  ASSERT_EQ(info.code, 0) << info.err;
  const json described = json::parse(info.out);
  EXPECT_EQ(described["objects"][0]["encoding"], encoding);
  EXPECT_GT(described["objects"][0]["nodes"], 100);
  EXPECT_EQ(described["objects"][0]["bytes"]["bvh"], result["bytes"]["bvh"]);
  EXPECT_EQ(described["bytes"]["bvh"], result["bytes"]["bvh"]);
  EXPECT_NE(text.out.find(encoding + ", "), std::string::npos) << text.out;
  EXPECT_NE(text.out.find("encoding " + encoding + ", "), std::string::npos) << text.out;
}

/// Leaves are smaller than voxels.
TEST_F(Bake, ExactWithoutPlanesThatSaveNothing) {
  const std::string tree = path("tree.ply");
  ASSERT_EQ(nif({"mesh", "generate", "tree", "-o", tree, "--triangles", "3000", "--quiet"}).code, 0);
  std::vector<std::string> arguments{"bake",  tree,     "-o", path("tree.nif"), "--encoding",
                                     "exact", "--rays", "0",  "--json"};
  const Outcome alone = nif(arguments);
  ASSERT_EQ(alone.code, 0) << alone.err;
  const json object = json::parse(alone.out)["objects"][0];
  EXPECT_EQ(object["encoding"], "bvh");
  EXPECT_NE(object["reason"].get<std::string>().find("less work as a BVH than as planes"), std::string::npos)
      << object;
  EXPECT_LT(object["compared"]["bvh"]["work"], object["compared"]["exact"]["work"]);

  arguments.insert(arguments.end(), {"--resolution", "48"});
  const Outcome asked = nif(arguments);
  ASSERT_EQ(asked.code, 0) << asked.err;
  EXPECT_EQ(json::parse(asked.out)["objects"][0]["encoding"], "exact");
  EXPECT_EQ(json::parse(asked.out)["objects"][0]["reason"], "as requested");
}

TEST_F(Bake, ThePapersFields) {
  const std::vector<std::string> arguments{"bake",
                                           ball_,
                                           "-o",
                                           path("ball.nif"),
                                           "--preset",
                                           "paper",
                                           "--outer-resolution",
                                           "64",
                                           "--inner-resolution",
                                           "32",
                                           "--precision",
                                           "single",
                                           "--rays",
                                           "20000"};
  std::vector<std::string> one = arguments, text = arguments;
  one.insert(one.end(), {"--json", "-j", "1"});
  const Outcome outcome = nif(one);
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const json result = json::parse(outcome.out);
  EXPECT_EQ(result["bytes"]["network"], 4 * (4544 + 5280));
  EXPECT_EQ(result["bytes"]["grids"], 4 * (2 * 64 * 64 * 3 + 2 * 32 * 32 * 5 + 128 * 3));
  EXPECT_EQ(result["objects"][0]["encoding"], "spherical");
  EXPECT_GT(result["objects"][0]["training_rays"], 1'000'000);
  for (const auto& [name, accuracy] : result["sets"].items()) {
    EXPECT_EQ(accuracy["certain_wrong"], 0) << name;
    EXPECT_LT(accuracy["error"].get<double>(), 0.3) << name;
  }
  const std::string bytes = read_bytes(path("ball.nif"));
  const Outcome summary = nif(text);
  ASSERT_EQ(summary.code, 0) << summary.err;
  EXPECT_NE(summary.out.find("is spherical: as requested"), std::string::npos) << summary.out;
  EXPECT_TRUE(read_bytes(path("ball.nif")) == bytes) << "-j 1 and all threads differ";

  const Outcome eval = nif({"eval", path("ball.nif"), "--mesh", ball_, "--rays", "5000", "--reference"});
  ASSERT_EQ(eval.code, 0) << eval.err;
  EXPECT_NE(eval.out.find("where a segment ends"), std::string::npos) << eval.out;
  const Outcome info = nif({"info", path("ball.nif"), "--json"}), lines = nif({"info", path("ball.nif")});
  ASSERT_EQ(info.code, 0) << info.err;
  const json described = json::parse(info.out), object = described["objects"][0];
  EXPECT_EQ(object["encoding"], "spherical");
  EXPECT_EQ(object["outer"]["width"], 64);
  EXPECT_EQ(object["inner"]["distance_resolution"], 128);
  EXPECT_EQ(object["bytes"]["grids"], result["bytes"]["grids"]);
  EXPECT_EQ(object["bytes"]["outer_network"], 4 * 4544);
  EXPECT_EQ(object["paper"]["outer_grids"], 4 * 64 * 64);
  EXPECT_EQ(described["metadata"]["options"]["spherical"]["outer"]["resolution"], 64);
  EXPECT_EQ(described["metadata"]["options"]["spherical"]["learning_rate"].get<float>(), 0.005f);
  EXPECT_EQ(described["metadata"]["options"]["spherical"]["epsilon"].get<float>(), 1e-15f);
  for (const char* word : {"preset paper", "spherical, networks 0", "28 R^2"})
    EXPECT_NE(lines.out.find(word), std::string::npos) << word << " in:\n" << lines.out;
}

TEST_F(Bake, ChoosesTheEncodingAndSaysWhy) {
  const std::string ring = folder_.write("ring.obj", obj_text(torus(120, 60))).string();
  const std::vector<std::string> arguments{"bake",     ring,   "-o",     path("ring.nif"),
                                           "--preset", "fast", "--rays", "20000"};
  std::vector<std::string> with_json = arguments;
  with_json.push_back("--json");
  const Outcome outcome = nif(with_json);
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const json object = json::parse(outcome.out)["objects"][0];
  EXPECT_EQ(object["encoding"], "exact");
  EXPECT_NE(object["reason"].get<std::string>().find("exact: it has fewer than 200000 triangles"),
            std::string::npos)
      << object["reason"];
  EXPECT_LT(object["compared"]["exact"]["work"], object["compared"]["bvh"]["work"]);
  const std::string as_json = read_bytes(path("ring.nif"));

  std::vector<std::string> one = arguments;
  one.insert(one.end(), {"-j", "1"});
  const Outcome summary = nif(one);
  ASSERT_EQ(summary.code, 0) << summary.err;
  EXPECT_NE(summary.out.find("is exact: " + object["reason"].get<std::string>()), std::string::npos)
      << summary.out;
  EXPECT_TRUE(read_bytes(path("ring.nif")) == as_json) << "-j 1 and all threads differ";
}

TEST_F(Bake, PrefersSpeedOrBytes) {
  std::map<std::string, std::string> files;
  for (const auto& [preference, encoding, why] :
       {std::tuple{"speed", "exact", "speed is preferred; less work"},
        {"bytes", "bvh", "bytes are preferred, so it has no planes"}}) {
    const Outcome outcome =
        nif({"bake", ball_, "-o", path("ball.nif"), "--rays", "0", "--prefer", preference});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_NE(outcome.out.find(why), std::string::npos) << outcome.out;
    const json info = json::parse(nif({"info", path("ball.nif"), "--json"}).out);
    EXPECT_EQ(info["objects"][0]["encoding"], encoding);
    EXPECT_EQ(info["metadata"]["options"]["prefer"], preference);
    EXPECT_EQ(nif({"validate", path("ball.nif"), "--strict"}).code, 0);
    files[preference] = read_bytes(path("ball.nif"));
  }
  EXPECT_LT(files["bytes"].size(), files["speed"].size());
  const std::string manifest = folder_
                                   .write("library.toml",
                                          "[defaults]\nprefer = \"speed\"\nrays = 0\n[[asset]]\nmesh = "
                                          "\"*.obj\"\noutput = \"ball.nif\"\n")
                                   .string();
  ASSERT_EQ(nif({"bake", "--manifest", manifest, "--quiet", "--force"}).code, 0);
  EXPECT_TRUE(read_bytes(path("ball.nif")) == files["speed"]);
}

TEST_F(Bake, MaxBytesAlsoLimitsBvhs) {
  const Outcome outcome =
      nif({"bake", ball_, "-o", path("ball.nif"), "--encoding", "bvh", "--max-bytes", "50kB"});
  EXPECT_EQ(outcome.code, int(Status::target_not_met)) << outcome.err;
  EXPECT_NE(outcome.err.find("--max-bytes cannot be reached: with BVHs the asset takes"), std::string::npos)
      << outcome.err;
  EXPECT_NE(outcome.err.find("try --encoding segment"), std::string::npos) << outcome.err;
  EXPECT_EQ(listing(folder_.path()).size(), 1u);
}

TEST_F(Bake, InterruptedLeavesWhatWasThere) {
  folder_.write("old.nif", "what was there before");
  const std::vector<std::string> before = listing(folder_.path());
  for (const char* name : {"new.nif", "old.nif"}) {
    SCOPED_TRACE(name);
    Process process(nif_path(),
                    {"bake", ball_, "-o", path(name), "--preset", "high", "--encoding", "segment", "--json"});
    ASSERT_TRUE(process.wait_for_error_text("training"));
    process.send(SIGINT);
    const Outcome outcome = process.finish(60);
    EXPECT_EQ(outcome.code, int(Status::interrupted)) << outcome.err;
    EXPECT_EQ(outcome.out, "");
    EXPECT_EQ(without_progress(outcome.err).size(), 1u) << outcome.err;
    EXPECT_EQ(listing(folder_.path()), before);
  }
  EXPECT_EQ(read_bytes(path("old.nif")), "what was there before");
}

}  // namespace
}  // namespace nif::test
