// `nif bake --manifest`: what is baked, what is skipped, and what stays intact after failures.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>

#include <chrono>
#include <cstdlib>
#include <deque>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <thread>

#include "formats/base/status.hpp"
#include "tests/cli/mesh_text.hpp"
#include "tests/cli/program.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;

/// Uses a stream because GCC 12 warns about text + to_string().
template <class... Parts>
std::string joined(const Parts&... parts) {
  std::ostringstream stream;
  (stream << ... << parts);
  return stream.str();
}

class Batch : public testing::Test {
 protected:
  std::string path(const std::string& name) const { return (folder_.path() / name).string(); }
  /// Writes a file in the folder, and creates its folders.
  std::string write(const std::string& name, const std::string& text) const {
    fs::create_directories((folder_.path() / name).parent_path());
    return folder_.write(name, text).string();
  }
  /// Quick bakes, unless `defaults` says otherwise.
  std::string manifest(const std::string& assets,
                       const std::string& defaults = "encoding = \"bvh\"\nrays = 0\n") const {
    return write("library.toml", "output = \"out/{folder}/{stem}.nif\"\n[defaults]\n" + defaults + assets);
  }
  Outcome batch(const std::string& file, std::vector<std::string> more = {}) const {
    more.insert(more.begin(), {"bake", "--manifest", file});
    return nif(more);
  }
  json batch_json(const std::string& file, std::vector<std::string> more = {}) const {
    more.push_back("--json");
    const Outcome outcome = batch(file, more);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    return json::parse(outcome.out, nullptr, false);
  }
  void refused(const std::string& file, const std::string& words,
               Status status = Status::malformed_manifest) const {
    const Outcome outcome = batch(file);
    EXPECT_EQ(outcome.code, int(status));
    EXPECT_NE(outcome.err.find(words), std::string::npos) << outcome.err;
    EXPECT_EQ(without_progress(outcome.err).size(), 1u) << outcome.err;
    EXPECT_FALSE(fs::exists(folder_.path() / "out"));
    EXPECT_FALSE(fs::exists(folder_.path() / ".nif-batch"));
  }

  TempDir folder_;
  std::string ball_ = obj_text(icosphere(2));
};

TEST_F(Batch, BakesTwoHundredAssetsAndThenOnlyWhatHasChanged) {
  for (int i = 0; i < 200; ++i) write(joined("props/", i % 7, "/ball ", i, ".obj"), ball_);
  const std::string file = manifest("[[asset]]\nmesh = \"props/**/*.obj\"\n");
  const json first = batch_json(file);
  EXPECT_EQ(first["schema"], "nifkit.batch/1");
  EXPECT_EQ(first["baked"], 200);
  EXPECT_EQ(first["assets"][0]["report"]["schema"], "nifkit.bake/2");
  for (int i = 0; i < 200; ++i)
    EXPECT_TRUE(fs::exists(path(joined("out/props/", i % 7, "/ball ", i, ".nif"))));

  const auto written = [&] {
    std::vector<fs::file_time_type> times;
    for (int i = 0; i < 200; ++i)
      times.push_back(fs::last_write_time(path(joined("out/props/", i % 7, "/ball ", i, ".nif"))));
    return times;
  };
  const std::vector<fs::file_time_type> before = written();
  const json second = batch_json(file);
  EXPECT_EQ(written(), before);
  EXPECT_EQ(second["baked"], 0);
  EXPECT_EQ(second["current"], 200);
  EXPECT_EQ(second["assets"][0]["report"], first["assets"][0]["report"]);

  write("props/3/ball 3.obj", ball_ + "# another\n");
  const json third = batch_json(file);
  EXPECT_EQ(third["baked"], 1);
  EXPECT_EQ(third["current"], 199);
  for (const json& asset : third["assets"])
    if (asset["outcome"] == "baked") {
      EXPECT_EQ(asset["mesh"], path("props/3/ball 3.obj"));
      EXPECT_EQ(asset["reason"], "props/3/ball 3.obj has changed");
    }
}

TEST_F(Batch, GivesTheBytesOfABakeByItself) {
  write("a.obj", obj_text(icosphere(4)));
  const std::string file =
      manifest("[[asset]]\nmesh = \"a.obj\"\nseed = 5\n",
               "preset = \"fast\"\nencoding = \"segment\"\nresolution = 24\nrays = 1000\n"
               "max-spurious = \"1%\"\n");
  ASSERT_EQ(batch(file).code, 0);
  ASSERT_EQ(nif({"bake", path("a.obj"), "-o", path("own.nif"), "--preset", "fast", "--encoding", "segment",
                 "--resolution", "24", "--rays", "1000", "--seed", "5", "--max-spurious", "0.01"})
                .code,
            0);
  EXPECT_EQ(read_bytes(path("out/a.nif")), read_bytes(path("own.nif")));
}

TEST_F(Batch, ContentCountsAndNotTimes) {
  write("a.obj", ball_);
  write("b.obj", ball_);
  const std::string file = manifest("[[asset]]\nmesh = \"*.obj\"\n");
  EXPECT_EQ(batch_json(file)["baked"], 2);
  const timespec times[2] = {{1'000'000'000, 0}, {1'000'000'000, 0}};
  ASSERT_EQ(utimensat(AT_FDCWD, path("a.obj").c_str(), times, 0), 0);
  EXPECT_EQ(batch_json(file)["current"], 2);
  // The same time and size do not hide changed content so soon after.
  struct stat before {};
  ASSERT_EQ(stat(path("b.obj").c_str(), &before), 0);
  std::string other = ball_;
  std::swap(other[other.find("1")], other[other.rfind("2")]);
  write("b.obj", other);
  const timespec same[2] = {before.st_atim, before.st_mtim};
  ASSERT_EQ(utimensat(AT_FDCWD, path("b.obj").c_str(), same, 0), 0);
  EXPECT_EQ(batch_json(file)["baked"], 1);

  const std::string baked = read_bytes(path("out/b.nif"));
  fs::remove(path("out/a.nif"));
  EXPECT_EQ(batch_json(file)["baked"], 1);
  write("out/b.nif", "another");
  const json repaired = batch_json(file);
  EXPECT_EQ(repaired["baked"], 1);
  EXPECT_EQ(repaired["assets"][1]["reason"], "the asset has changed since its bake");
  EXPECT_TRUE(read_bytes(path("out/b.nif")) == baked);

  // Like a file from a machine whose clock is ahead.
  const timespec ahead[2] = {{4'000'000'000, 0}, {4'000'000'000, 0}};
  ASSERT_EQ(utimensat(AT_FDCWD, path("a.obj").c_str(), ahead, 0), 0);
  EXPECT_EQ(batch_json(file)["current"], 2);

  manifest("[[asset]]\nmesh = \"*.obj\"\nseed = 2\n");
  const json again = batch_json(file);
  EXPECT_EQ(again["baked"], 2);
  EXPECT_EQ(again["assets"][0]["reason"], "its options have changed");
  EXPECT_EQ(batch_json(file, {"--force"})["baked"], 2);
}

/// Found by fuzzing: a number outside of the range of its type was undefined behaviour.
TEST_F(Batch, ADamagedRecordIsIgnored) {
  write("a.obj", ball_);
  const std::string file = manifest("[[asset]]\nmesh = \"a.obj\"\n");
  ASSERT_EQ(batch_json(file)["baked"], 1);
  fs::path record;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder_.path() / ".nif-batch"))
    if (entry.path().extension() == ".json") record = entry.path();
  ASSERT_FALSE(record.empty());
  const json whole = json::parse(read_bytes(record));
  const std::pair<const char*, json> damages[] = {
      {"/sources/0/size", 7.9e75}, {"/sources/0/size", -1},
      {"/asset/modified", 1e300},  {"/report/peak_memory", "much"},
      {"/report/sources", 3},      {"/report", nullptr},
      {"/report/seconds", 1e300},  {"/report/peak_memory", UINT64_MAX}};
  for (const auto& [where, value] : damages) {
    json damaged = whole;
    damaged[json::json_pointer(where)] = value;
    std::ofstream(record) << damaged;
    const json again = batch_json(file);
    EXPECT_EQ(again["baked"], 1) << where;
    EXPECT_EQ(again["assets"][0]["reason"], "new") << where;
  }
  std::string deep = whole.dump();
  deep.insert(1, "\"new\":" + std::string(300'000, '[') + std::string(300'000, ']') + ',');
  std::ofstream(record) << deep;
  EXPECT_EQ(batch_json(file)["baked"], 1);
}

TEST_F(Batch, ADryRunSaysWhatAndWhyAndDoesNothing) {
  write("a.obj", ball_);
  const Outcome outcome = batch(manifest("[[asset]]\nmesh = \"*.obj\"\n"), {"--dry-run"});
  EXPECT_EQ(outcome.code, 0);
  EXPECT_EQ(outcome.out,
            path("out/a.nif") + " from " + path("a.obj") + ": new\n1 of 1 asset would be baked\n");
  EXPECT_EQ(listing(folder_.path()), (std::vector<std::string>{"a.obj", "library.toml"}));
}

TEST_F(Batch, StopsAtAFailureUnlessToldToKeepGoing) {
  write("a.obj", "v 0 0 0\nf 1 2 3\n");
  write("b.obj", ball_);
  write("c.obj", ball_);
  const std::string file = manifest("[[asset]]\nmesh = \"*.obj\"\n");
  const Outcome stopped = batch(file, {"-j", "1"});
  EXPECT_EQ(stopped.code, int(Status::index_out_of_range));
  EXPECT_NE(stopped.out.find("1 failed, 2 not started"), std::string::npos) << stopped.out;
  EXPECT_NE(stopped.err.find("a.obj"), std::string::npos);

  const Outcome kept = batch(file, {"--keep-going", "--json"});
  EXPECT_EQ(kept.code, int(Status::index_out_of_range));
  const json result = json::parse(kept.out);
  EXPECT_EQ(result["baked"], 2);
  EXPECT_EQ(result["failed"], 1);
  EXPECT_EQ(result["assets"][0]["code"], int(Status::index_out_of_range));
  EXPECT_NE(result["assets"][0]["error"].get<std::string>().find("a.obj"), std::string::npos);
  // Failed assets are tried again, finished ones are not.
  write("a.obj", ball_);
  EXPECT_EQ(batch_json(file)["baked"], 1);
}

TEST_F(Batch, EachShardDoesItsPart) {
  for (int i = 0; i < 7; ++i) write(joined("m", i, ".obj"), ball_);
  const std::string file = manifest("[[asset]]\nmesh = \"*.obj\"\n");
  EXPECT_EQ(batch_json(file, {"--shard", "1/3"})["baked"], 3);
  EXPECT_EQ(batch_json(file, {"--shard", "2/3"})["baked"], 2);
  EXPECT_EQ(batch_json(file, {"--shard", "3/3"})["baked"], 2);
  EXPECT_EQ(batch_json(file)["current"], 7);
  for (const char* bad : {"0/3", "4/3", "1", "1/3x", "-1/3"})
    EXPECT_EQ(batch(file, {"--shard", bad}).code, 2) << bad;
}

TEST_F(Batch, WritesAReportWithPicturesAndARuleForMake) {
  write("a <b> & c.obj", obj_text(icosphere(3)));
  write("bad.obj", "v 0 0 0\nf 1 2 3\n");
  const std::string file = manifest("[[asset]]\nmesh = \"*.obj\"\n", "encoding = \"bvh\"\nrays = 1000\n");
  const Outcome outcome = batch(file, {"--keep-going", "--report", path("r.html"), "--depfile", path("r.d")});
  EXPECT_EQ(outcome.code, int(Status::index_out_of_range));
  const std::string html = read_bytes(path("r.html"));
  EXPECT_NE(html.find("a &lt;b&gt; &amp; c.nif"), std::string::npos);
  EXPECT_EQ(html.find("<b>"), std::string::npos);
  EXPECT_NE(html.find("data:image/png;base64,iVBORw0KGgo"), std::string::npos);
  EXPECT_LT(html.find("class=\"failed\""), html.find("a &lt;b"));
  // Numbers come before pictures, and cells have values to sort by.
  EXPECT_LT(html.find("data-name=\"resident\""), html.find("<img"));
  EXPECT_NE(html.find("data-name=\"triangles\" data-value=\"1280\">1280<"), std::string::npos);
  const std::string rule = read_bytes(path("r.d"));
  EXPECT_NE(rule.find("a\\ <b>\\ &\\ c.nif "), std::string::npos) << rule;
  EXPECT_NE(rule.find("library.toml"), std::string::npos);
  for (const std::string& name : listing(folder_.path() / ".nif-batch"))
    EXPECT_TRUE(name.ends_with(".json") || name.ends_with(".png") || name == "lock") << name;
}

TEST_F(Batch, ACancelledOrKilledBatchGoesOnWhereItWas) {
  for (int i = 0; i < 3; ++i) write(joined("m", i, ".obj"), obj_text(icosphere(4)));
  const std::string file = manifest("[[asset]]\nmesh = \"*.obj\"\n",
                                    "encoding = \"segment\"\npreset = \"fast\"\nresolution = 24\nrays = 0\n");
  for (const int signal : {SIGINT, SIGKILL}) {
    fs::remove_all(path("out"));
    fs::remove_all(path(".nif-batch"));
    Process process(nif_path(), {"bake", "--manifest", file, "-j", "1"});
    ASSERT_TRUE(process.wait_for_error_text("1 of 3; baking"));
    process.send(signal);
    EXPECT_EQ(process.finish().code, signal == SIGINT ? int(Status::interrupted) : 128 + SIGKILL);
    // Bakes end with the batch; one that has just written its asset may finish first.
    std::this_thread::sleep_for(std::chrono::seconds(1));
    for (const std::string& name : listing(folder_.path() / "out"))
      EXPECT_TRUE(name.ends_with(".nif")) << name;
    const json rest = batch_json(file);
    EXPECT_GE(rest["current"].get<int>(), 1);
    EXPECT_EQ(rest["baked"].get<int>() + rest["current"].get<int>(), 3);
    for (const std::string& name : listing(folder_.path() / ".nif-batch"))
      EXPECT_TRUE(name.ends_with(".json") || name == "lock") << name;
  }
}

TEST_F(Batch, TwoAtOnceShareTheWork) {
  constexpr int kAssets = 5;
  for (int i = 0; i < kAssets; ++i) write(joined("m", i, ".obj"), obj_text(uv_sphere(8 + i, 16)));
  const std::string file = manifest("[[asset]]\nmesh = \"*.obj\"\n", "encoding = \"exact\"\nrays = 1000\n");
  std::vector<std::string> reports{path("first.html"), path("second.html")};
  std::deque<Process> processes;
  for (const std::string& report : reports)
    processes.emplace_back(nif_path(), std::vector<std::string>{"bake", "--manifest", file, "-j", "1",
                                                                "--json", "--report", report});
  int baked = 0;
  for (Process& process : processes) {
    const Outcome outcome = process.finish();
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    const json result = json::parse(outcome.out);
    EXPECT_EQ(result["baked"].get<int>() + result["current"].get<int>(), kAssets);
    baked += result["baked"].get<int>();
    for (const json& asset : result["assets"]) EXPECT_EQ(asset["report"]["schema"], "nifkit.bake/2");
  }
  EXPECT_EQ(baked, kAssets) << "each is baked by one of them";
  EXPECT_EQ(batch_json(file)["current"], kAssets);
  for (const std::string& report : reports) {
    const std::string html = read_bytes(report);
    EXPECT_NE(html.find("</html>"), std::string::npos);
    size_t pictures = 0;
    for (size_t at = 0; (at = html.find("<img", at)) != std::string::npos; ++at) ++pictures;
    EXPECT_EQ(pictures, size_t(kAssets));
  }
  EXPECT_EQ(listing(folder_.path() / "out").size(), size_t(kAssets));
}

TEST_F(Batch, TwoAtOnceWithForceLeaveWholeAssets) {
  for (int i = 0; i < 4; ++i) write(joined("m", i, ".obj"), obj_text(uv_sphere(8 + i, 16)));
  const std::string file = manifest("[[asset]]\nmesh = \"*.obj\"\n");
  std::deque<Process> processes;
  for (int i = 0; i < 2; ++i)
    processes.emplace_back(nif_path(), std::vector<std::string>{"bake", "--manifest", file, "--force"});
  for (Process& process : processes) EXPECT_EQ(process.finish().code, 0);
  EXPECT_EQ(batch_json(file)["current"], 4);
}

TEST_F(Batch, AMeshThatChangesDuringItsBakeIsAFailure) {
  write("a.obj", obj_text(icosphere(5)));
  const std::string file = manifest("[[asset]]\nmesh = \"*.obj\"\n",
                                    "encoding = \"segment\"\npreset = \"fast\"\nresolution = 24\nrays = 0\n");
  Process process(nif_path(), {"bake", "--manifest", file, "-j", "1"});  // slow enough on any machine
  ASSERT_TRUE(process.wait_for_error_text("0 of 1; baking"));
  write("a.obj", ball_);
  const Outcome outcome = process.finish();
  EXPECT_EQ(outcome.code, int(Status::file_unreadable)) << outcome.err;
  EXPECT_NE(outcome.err.find("a.obj: changed while it was baked"), std::string::npos) << outcome.err;
  EXPECT_EQ(batch_json(file)["baked"], 1);
}

TEST_F(Batch, RefusesManifestsThatContradictThemselves) {
  write("a.obj", ball_);
  write("b.obj", ball_);
  const std::string all = "[[asset]]\nmesh = \"*.obj\"\n";
  refused(manifest("[[asset]]\nmash = \"*.obj\"\n"),
          "line 6: asset 1: 'mash' is unknown here; did you mean 'mesh'?");
  refused(manifest(all, "resoluton = 24\n"),
          "defaults: 'resoluton' is unknown here; did you mean 'resolution'?");
  refused(manifest(all + "[[asset]]\nmesh = \"b.obj\"\n"), "gives two meshes the same output");
  refused(manifest(all + "output = \"x.nif\"\n"), "gives two meshes the same output");
  refused(manifest(all + "output = \"{stm}.nif\"\n"), "'{stm}.nif' has an unknown placeholder");
  refused(manifest(all + "output = \"{stem.nif\"\n"), "has an unknown placeholder");
  refused(manifest("[[asset]]\nmesh = \"a.obj\"\noutput = \"b.obj\"\n[[asset]]\nmesh = \"b.obj\"\n"),
          "contains a cycle");
  refused(manifest("[[asset]]\nmesh = \"none/*.obj\"\n"), "matches no file");
  refused(manifest("[[asset]]\nmesh = \"none.obj\"\n"), "names a file that does not exist");
  refused(manifest("[[asset]]\nmesh = \"*.obj\"\nexclude = \"*\"\n"), "leaves nothing to bake");
  refused(manifest(""), "is missing: add an [[asset]]");
  refused(manifest(all + "preset = \"best\"\n"), "--preset");
  refused(manifest(all + "prefer = \"bytes\"\nencoding = \"exact\"\n"), "--prefer needs --encoding auto");
  refused(manifest(all + "seed = \"x\"\n"), "seed");
  refused(manifest(all + "shared-network = 3\n"), "--shared-network must be true or false");
  refused(manifest(all + "resolution = [1]\n"), "'resolution' must be a string, a number, true or false");
  refused(write("library.toml", "output = \n"), "library.toml: line 1");
  std::string parts = "a";
  for (int i = 0; i < 200'000; ++i) parts += i % 2 ? " . \"b\"" : ".c";
  const char* const many = "a key has more than 16 parts";
  refused(manifest(all, parts + " = 1\n"), many);
  refused(manifest("['x.y' . " + parts + "]\n"), many);
  refused(manifest(all, "seed = { # \"\n" + parts + " = 1}\n"), many);
  refused(manifest(all, "state = \"\"\"\\\"\n\"\"\"\"\"\n" + parts + " = 1\n"), many);
  refused(path("none.toml"), "none.toml", Status::file_not_found);
}

TEST_F(Batch, NamesContradictingOptions) {
  write("a.obj", ball_);
  const std::string file = manifest("[[asset]]\nmesh = \"*.obj\"\n");
  for (const std::vector<std::string>& more : {std::vector<std::string>{"--preset", "fast"},
                                               {"-o", path("x.nif")},
                                               {path("a.obj")},
                                               {"--memory", "much"}})
    EXPECT_EQ(batch(file, more).code, int(Status::usage)) << more[0];
  EXPECT_EQ(nif({"bake", path("a.obj"), "-o", path("x.nif"), "--keep-going"}).code, int(Status::usage));
  EXPECT_EQ(nif({"bake"}).code, int(Status::usage));
}

TEST_F(Batch, PatternsMatchNamesAndFolders) {
  for (const char* name :
       {"a.obj", "b.ply.obj", "deep/c.obj", "deep/er/d.obj", "deep/er/.hidden.obj", ".git/e.obj"})
    write(name, ball_);
  fs::create_directory_symlink("..", path("deep/er/up"));
  const auto meshes = [&](const std::string& pattern) {
    std::set<std::string> names;
    const json plan = batch_json(manifest("[[asset]]\nmesh = " + pattern + "\n"), {"--dry-run"});
    for (const json& asset : plan["assets"])
      names.insert(fs::path(asset["mesh"].get<std::string>()).lexically_relative(folder_.path()).string());
    return names;
  };
  using Names = std::set<std::string>;
  EXPECT_EQ(meshes("\"*.obj\""), (Names{"a.obj", "b.ply.obj"}));
  EXPECT_EQ(meshes("\"**/*.obj\""), (Names{"a.obj", "b.ply.obj", "deep/c.obj", "deep/er/d.obj"}));
  std::string anywhere;
  for (int i = 0; i < 200'000; ++i) anywhere += "**/";
  EXPECT_EQ(meshes('"' + anywhere + "c.obj\""), Names{"deep/c.obj"});
  EXPECT_EQ(meshes("\"deep/**\""), (Names{"deep/c.obj", "deep/er/d.obj"}));
  EXPECT_EQ(meshes("[\"?.obj\", \"deep/[c-d].obj\"]"), (Names{"a.obj", "deep/c.obj"}));
  // There are 10^11 ways to assign 60 folders to twelve `**`.
  std::string bottom, dealt;
  for (int i = 0; i < 60; ++i) bottom += "n/";
  for (int i = 0; i < 12; ++i) dealt += "**/*/";
  write(bottom + "f.obj", ball_);
  EXPECT_EQ(meshes('"' + dealt + "f.obj\""), Names{bottom + "f.obj"});
  EXPECT_EQ(meshes("\"deep/er/.*.obj\""), (Names{"deep/er/.hidden.obj"}));
  EXPECT_EQ(meshes(joined("\"", path("a.obj"), "\"")), (Names{"a.obj"}));
}

TEST_F(Batch, ReplacesNoFileThatItReads) {
  write("a.obj", ball_);
  const std::string file = manifest("[[asset]]\nmesh = \"a.obj\"\n"), text = read_bytes(file);
  for (const char* option : {"--report", "--depfile"})
    for (const std::string& kept : {file, path("a.obj")}) {
      const std::string before = read_bytes(kept);
      EXPECT_EQ(batch(file, {option, kept}).code, int(Status::usage));
      EXPECT_EQ(read_bytes(kept), before);
    }
  EXPECT_EQ(batch(file, {"--report", path("x"), "--depfile", path("x")}).code, int(Status::usage));
  refused(write("own.toml", "[[asset]]\nmesh = \"a.obj\"\noutput = \"own.toml\"\n"), "the manifest itself");
  // The system would read "a.nif" twice.
  refused(write("zero.toml", "[[asset]]\nmesh = \"a.obj\"\noutput = \"a.nif\\u0000b\"\n"), "U+0000");
  write("out/x", "");
  EXPECT_EQ(batch(file, {"--report", path("out/a.nif")}).code, int(Status::usage));
}

TEST_F(Batch, NamesMayLookLikeOptions) {
  for (const char* name : {"-x.obj", "-h.obj", "--help.obj"}) write(name, ball_);
  write("library.toml",
        "[defaults]\nencoding = \"bvh\"\nrays = 0\n[[asset]]\nmesh = \"*.obj\"\noutput = \"{stem}.nif\"\n");
  // With a manifest in the current folder.
  const Outcome outcome =
      Process("/bin/sh",
              {"-c", joined("cd ", folder_.path(), " && exec ", nif_path(), " bake --manifest library.toml")})
          .finish();
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  for (const char* name : {"-x.nif", "-h.nif", "--help.nif"}) EXPECT_TRUE(fs::exists(path(name))) << name;
}

TEST_F(Batch, NamesMustBeUtf8) {
  write("m\xff.obj", ball_);
  refused(manifest("[[asset]]\nmesh = \"*.obj\"\n"), "is not UTF-8");
}

TEST_F(Batch, ASingleBakeWritesItsDependenciesToo) {
  write("a b.obj", ball_);
  const Outcome outcome = nif({"bake", path("a b.obj"), "-o", path("x.nif"), "--encoding", "bvh", "--rays",
                               "0", "--depfile", path("x.d"), "--json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  std::string escaped = path("a b.obj");
  escaped.replace(escaped.find(' '), 1, "\\ ");
  EXPECT_EQ(read_bytes(path("x.d")), path("x.nif") + ": \\\n  " + escaped + "\n");
  EXPECT_EQ(json::parse(outcome.out)["sources"], json::array({path("a b.obj")}));
}

TEST_F(Batch, PartsAreSummedUp) {
  for (int i = 0; i < 4; ++i) write(joined("m", i, ".obj"), ball_);
  write("bad.obj", "v 0 0 0\nf 1 2 3\n");
  const std::string file = manifest("[[asset]]\nmesh = \"*.obj\"\n");
  const Outcome first = batch(file, {"--shard", "1/2", "--keep-going", "--json"});
  const std::string part = write("part-1.json", first.out);
  const Outcome lost = nif({"farm", file, "--merge", part});
  EXPECT_EQ(lost.code, int(Status::index_out_of_range)) << lost.err;
  EXPECT_NE(lost.out.find("2 baked, 0 up to date, 1 failed, 2 not baked"), std::string::npos) << lost.out;

  write("only.txt", "out/m0.nif\n\nout/m2.nif\n");
  EXPECT_EQ(batch_json(file, {"--outputs", path("only.txt")})["assets"].size(), 2u);
  write("none.txt", "out/m9.nif\n");
  const Outcome none = batch(file, {"--outputs", path("none.txt")});
  EXPECT_EQ(none.code, int(Status::malformed_manifest));
  EXPECT_NE(none.err.find("has no output 'out/m9.nif'"), std::string::npos) << none.err;
  write("bad.obj", ball_);
  EXPECT_EQ(batch_json(file)["baked"], 1);
  const Outcome whole = nif({"farm", file, "--merge", part, "--json", "--report", path("r.html")});
  EXPECT_EQ(whole.code, 0) << whole.err;
  EXPECT_EQ(json::parse(whole.out)["baked"].get<int>() + json::parse(whole.out)["current"].get<int>(), 5);
  EXPECT_TRUE(fs::exists(path("r.html")));

  write("m1.obj", ball_ + "# changed\n");
  EXPECT_EQ(nif({"farm", file, "--merge", part}).code, int(Status::farm_failed));
  EXPECT_EQ(nif({"farm", file, "--merge", write("x.json", "{}")}).code, int(Status::malformed_manifest));
  EXPECT_EQ(nif({"farm", file}).code, int(Status::usage));
}

TEST_F(Batch, AFarmWithoutASchedulerSaysSo) {
  write("a.obj", ball_);
  const std::string file = manifest("[[asset]]\nmesh = \"*.obj\"\n");
  const std::string path_before = std::getenv("PATH");
  ASSERT_EQ(setenv("PATH", folder_.path().c_str(), 1), 0);
  const Outcome outcome = nif({"farm", file, "--slurm"});
  setenv("PATH", path_before.c_str(), 1);
  EXPECT_EQ(outcome.code, int(Status::farm_failed));
  EXPECT_NE(outcome.err.find("sbatch is not on the PATH"), std::string::npos) << outcome.err;
  EXPECT_FALSE(fs::exists(path(".nif-batch")));
  EXPECT_EQ(nif({"farm", file, "--slurm", "--dry-run"}).out.substr(0, 16), "1 asset, 1 task,");
}

}  // namespace
}  // namespace nif::test
