// `nif eval` and `nif info` on an asset that the program has baked itself.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "formats/base/status.hpp"
#include "tests/cli/mesh_text.hpp"
#include "tests/cli/program.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

using nlohmann::json;

TEST(Eval, OfProofsInFrontOfEmbree) {
  TempDir folder;
  const std::string mesh = folder.write("ring.obj", obj_text(torus(96, 48))).string();
  const std::string asset = (folder.path() / "ring.nif").string();
  const Outcome bake = nif({"bake", mesh, "-o", asset, "--encoding", "proof", "--rays", "20000", "--json"});
  ASSERT_EQ(bake.code, 0) << bake.err;
  const json object = json::parse(bake.out)["objects"][0];
  EXPECT_EQ(object["encoding"], "proof");
  EXPECT_EQ(object["training_rays"], 0);
  const auto sets = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"eval", asset, "--mesh", mesh, "--rays", "50000", "--json"});
    const Outcome outcome = nif(more);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    return json::parse(outcome.out)["sets"];
  };
  const json alone = sets({"--reference"}), both = sets({"--fallback", "embree"});
  for (const auto& [name, accuracy] : both.items()) {
    SCOPED_TRACE(name);
    EXPECT_EQ(accuracy["certain"], alone[name]["certain"]);
    EXPECT_GT(accuracy["certain"].get<double>(), 0.8);
    EXPECT_LT(accuracy["certain"].get<double>(), 1);
    EXPECT_EQ(accuracy["certain_wrong"], 0);
    // For rays on an edge, Embree's default build sometimes disagrees with its robust one.
    EXPECT_LE(accuracy["error"].get<double>(), 1e-4);
    EXPECT_EQ(alone[name]["leak"], 0) << "open rays count as occluded";
    EXPECT_GT(alone[name]["spurious"].get<double>(), 0);
  }
  const Outcome info = nif({"info", asset});
  EXPECT_NE(info.out.find("proof, "), std::string::npos) << info.out;
}

TEST(Eval, OfProbabilities) {
  TempDir folder;
  const std::string mesh = folder.write("ring.obj", obj_text(torus(48, 24))).string();
  const std::string learned = (folder.path() / "ring.nif").string(),
                    exact = (folder.path() / "e.nif").string();
  const Outcome bake = nif({"bake", mesh, "-o", learned, "--encoding", "segment", "--preset", "fast",
                            "--rays", "20000", "--json", "--quiet"});
  ASSERT_EQ(bake.code, 0) << bake.err;
  ASSERT_EQ(nif({"bake", mesh, "-o", exact, "--encoding", "bvh", "--rays", "0", "--quiet"}).code, 0);
  EXPECT_GT(json::parse(bake.out)["objects"][0]["sets"]["sun"]["calibration_error"], 0);
  EXPECT_GT(json::parse(bake.out)["sets"]["sun"]["calibration_error"], 0);
  const auto eval = [&](const std::string& asset, std::vector<std::string> more) {
    more.insert(more.begin(), {"eval", asset, "--mesh", mesh, "--rays", "20000", "--quiet"});
    const Outcome outcome = nif(more);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    return outcome.out;
  };
  const json plain = json::parse(eval(learned, {"--json"}));
  const json binned = json::parse(eval(learned, {"--json", "--calibration"}));
  EXPECT_EQ(binned["objects"][0]["sets"], binned["sets"]);
  for (const auto& [name, set] : binned["sets"].items()) {
    SCOPED_TRACE(name);
    EXPECT_FALSE(plain["sets"][name].contains("calibration"));
    EXPECT_EQ(plain["sets"][name]["calibration_error"], set["calibration_error"]);
    ASSERT_EQ(set["calibration"].size(), 10u);
    double off = 0, rays = 0;
    for (size_t b = 0; b < 10; ++b) {
      const json& bin = set["calibration"][b];
      if (bin["rays"] == 0) continue;
      EXPECT_GE(bin["probability"].get<double>(), 0.1 * double(b) - 1e-6);
      EXPECT_LE(bin["probability"].get<double>(), 0.1 * double(b + 1) + 1e-6);
      const double count = bin["rays"].get<double>();
      rays += count;
      off += count * std::abs(bin["probability"].get<double>() - bin["visible"].get<double>());
    }
    EXPECT_NEAR(rays / set["rays"].get<double>(), 1 - set["certain"].get<double>(), 1e-9);
    EXPECT_NEAR(off / rays, set["calibration_error"].get<double>(), 1e-9);
  }
  const std::string text = eval(learned, {"--calibration", "--set", "sun"});
  for (const char* words : {"calibration", "probability", "0.0 to 0.1", "0.9 to 1.0"})
    EXPECT_NE(text.find(words), std::string::npos) << words << " in:\n" << text;
  EXPECT_EQ(eval(learned, {"--set", "sun"}).find("0.9 to 1.0"), std::string::npos);
  const json proven = json::parse(eval(exact, {"--json", "--calibration"}));
  EXPECT_FALSE(proven["sets"]["sun"].contains("calibration_error"));
}

TEST(Eval, OfFirstHits) {
  TempDir folder;
  const std::string mesh = folder.write("ring.obj", obj_text(torus(48, 24))).string();
  const std::string asset = (folder.path() / "ring.nif").string();
  const auto bake = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"bake", mesh, "-o", asset, "--rays", "0", "--quiet", "--encoding"});
    ASSERT_EQ(nif(more).code, 0);
  };
  const auto eval = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"eval", asset, "--mesh", mesh, "--rays", "20000", "--hits", "--quiet"});
    const Outcome outcome = nif(more);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    return outcome.out;
  };
  const auto expect_rising = [](const json& percentiles, double limit) {
    ASSERT_EQ(percentiles.size(), 4u);
    EXPECT_LE(percentiles["median"], percentiles["p90"]);
    EXPECT_LE(percentiles["p90"], percentiles["p95"]);
    EXPECT_LE(percentiles["p95"], percentiles["p99"]);
    EXPECT_LT(percentiles["p99"].get<double>(), limit);
  };
  for (const std::string encoding : {"exact", "bvh"}) {
    bake({encoding});
    const json result = json::parse(eval({"--json", "--reference"}));
    EXPECT_EQ(result["reference"]["different_hits"], 0);
    EXPECT_EQ(result["sets"].size(), 5u);
    EXPECT_EQ(result["objects"][0]["sets"], result["sets"]);
    for (const auto& [name, set] : result["sets"].items()) {
      SCOPED_TRACE(encoding + " " + name);
      const json& hits = set["hits"];
      EXPECT_EQ(hits["missed"], set["leak"]);
      EXPECT_EQ(hits["false_hits"], set["spurious"]);
      EXPECT_LT(set["error"].get<double>(), 1e-3) << "only where a ray passes an edge";
      EXPECT_EQ(hits["certain"], 1);
      EXPECT_EQ(hits["bounds_wrong"], 0);
      EXPECT_GT(hits["compared"], 100);
      EXPECT_EQ(hits["triangles"]["compared"], hits["compared"]);
      EXPECT_LT(hits["triangles"]["displaced"], hits["compared"].get<double>() / 100);
      expect_rising(hits["diagonals"], 1e-6);
      expect_rising(hits["degrees"], 0.1);
      EXPECT_EQ(hits.contains("voxels"), encoding == "exact");
    }
  }
  bake({"segment", "--preset", "fast"});
  const std::string text = eval({"--json", "-j", "1"});
  EXPECT_EQ(text, eval({"--json", "-j", "2"}));
  const json sets = json::parse(text)["sets"];
  for (const auto& [name, set] : sets.items()) {
    SCOPED_TRACE(name);
    const json& hits = set["hits"];
    EXPECT_EQ(hits["missed"], set["leak"]);
    EXPECT_EQ(hits["false_hits"], set["spurious"]);
    EXPECT_EQ(hits["certain"], set["certain"]);
    EXPECT_EQ(hits["bounds_wrong"], 0);
    EXPECT_FALSE(hits.contains("triangles"));
    expect_rising(hits["diagonals"], 0.5);
    expect_rising(hits["degrees"], 180);
    expect_rising(hits["voxels"], 200);
    EXPECT_LT(hits["voxels"]["median"].get<double>(), 0.5);
  }
  const std::string table = eval({"--set", "sun"});
  for (const char* words :
       {"first hits", "bounds wrong", "percent of the object's diagonal", "in voxels", "in degrees"})
    EXPECT_NE(table.find(words), std::string::npos) << words << " in:\n" << table;
}

/// The second object begins with triangles that a bake drops.
TEST(Eval, OfSourceTriangles) {
  TempDir folder;
  mesh::Mesh ring = torus(48, 24), ball = icosphere(3);
  append(ball, torus(48, 24), 1, {4, 0, 0});
  ball.triangles.insert(ball.triangles.begin(), {{0, 0, 1}, ball.triangles[3]});
  const auto both = [&] {
    size_t base = 0;
    std::string text = obj_object(ring, "ring", base);
    text += obj_object(ball, "ball", base);
    return text;
  };
  const std::string mesh = folder.write("two.obj", both()).string(),
                    asset = (folder.path() / "two.nif").string();
  for (const std::string encoding : {"exact", "bvh"}) {
    const Outcome baked = nif({"bake", mesh, "-o", asset, "--rays", "0", "--encoding", encoding,
                               "--source-triangles", "--no-merge", "--json"});
    ASSERT_EQ(baked.code, 0) << baked.err;
    const json report = json::parse(baked.out);
    expect_parts_add_up(report["bytes"]);
    EXPECT_GT(report["bytes"]["source_triangles"], 0);
    const Outcome outcome =
        nif({"eval", asset, "--mesh", mesh, "--rays", "5000", "--hits", "--reference", "--json"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    const json result = json::parse(outcome.out);
    EXPECT_EQ(result["reference"]["different_hits"], 0);
    for (const auto& [name, set] : result["sets"].items()) {
      const json& hits = set["hits"];
      EXPECT_EQ(hits["source_triangles"]["compared"], hits["compared"]);
      EXPECT_EQ(hits["source_triangles"]["wrong"], 0);
      EXPECT_LT(hits["source_triangles"]["other"], hits["compared"].get<double>() / 100);
    }
    const Outcome table = nif({"eval", asset, "--mesh", mesh, "--rays", "1000", "--hits"});
    EXPECT_NE(table.out.find("Triangles of the source mesh"), std::string::npos) << table.out;
    const json info = json::parse(nif({"info", asset, "--json"}).out);
    EXPECT_EQ(info["objects"][0]["source_triangles"], ring.triangles.size());
    EXPECT_EQ(info["objects"][1]["source_triangles"], ball.triangles.size());
    EXPECT_EQ(info["objects"][1]["triangles"], ball.triangles.size() - 2);
    EXPECT_EQ(info["metadata"]["options"]["source_triangles"], true);
  }
  // Another mesh that has the same triangles except for dropped ones.
  ball.triangles.erase(ball.triangles.begin());
  const std::string other = folder.write("other.obj", both()).string();
  EXPECT_EQ(nif({"eval", asset, "--mesh", other, "--rays", "1000", "--hits"}).code,
            int(Status::mesh_mismatch));
  const Outcome none = nif({"bake", mesh, "-o", asset, "--rays", "0", "--source-triangles", "--max-bytes",
                            "20kB", "--preset", "fast", "--json"});
  ASSERT_EQ(none.code, 0) << none.err;
  EXPECT_EQ(json::parse(none.out)["bytes"]["source_triangles"], 0);
  EXPECT_NE(none.err.find("--source-triangles: no object became exact"), std::string::npos) << none.err;
}

/// Two balls that differ only in colour, so they are two objects.
TEST(Eval, OfColors) {
  TempDir folder;
  const mesh::Mesh ball = icosphere(3);
  std::string text;
  size_t base = 0;
  for (const char* color : {" 1 0 0\n", " 0 0 1\n"}) {
    std::string part = obj_object(ball, color, base);
    for (size_t at = 0; (at = part.find("v ", at)) != part.npos;) {
      at = part.find('\n', at);
      part.replace(at, 1, color);
    }
    text += part;
  }
  const std::string mesh = folder.write("two.obj", text).string(),
                    asset = (folder.path() / "two.nif").string();
  const auto bake = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"bake", mesh, "-o", asset, "--rays", "0", "--json"});
    const Outcome outcome = nif(more);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    return outcome;
  };
  EXPECT_EQ(json::parse(bake({}).out)["objects"].size(), 1u);
  const json report = json::parse(bake({"--colors"}).out);
  ASSERT_EQ(report["objects"].size(), 2u);
  EXPECT_EQ(report["objects"][0]["encoding"], "exact");
  EXPECT_GT(report["bytes"]["colors"], 0);
  expect_parts_add_up(report["bytes"]);
  const json info = json::parse(nif({"info", asset, "--json"}).out);
  EXPECT_EQ(info["objects"][1]["colors"], true);
  EXPECT_EQ(info["metadata"]["options"]["colors"], true);
  const Outcome outcome =
      nif({"eval", asset, "--mesh", mesh, "--rays", "5000", "--hits", "--reference", "--json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(json::parse(outcome.out)["reference"]["different_hits"], 0);
  // No colours are available.
  folder.write("two.obj", obj_text(ball));
  const Outcome none = bake({"--colors"});
  EXPECT_EQ(json::parse(none.out)["bytes"]["colors"], 0);
  EXPECT_NE(none.err.find("--colors: the mesh has no readable colours"), std::string::npos) << none.err;
}

TEST(Eval, OfAFreshBake) {
  TempDir folder;
  const std::string mesh = folder.write("ring.obj", obj_text(torus(96, 48))).string();
  const std::string asset = (folder.path() / "ring.nif").string();
  ASSERT_EQ(nif({"bake", mesh, "-o", asset, "--preset", "fast", "--encoding", "segment", "--rays", "20000",
                 "--quiet"})
                .code,
            0);
  const std::vector<std::string> files = listing(folder.path());

  {
    SCOPED_TRACE("all sets, with the BVHs");
    const Outcome outcome = nif({"eval", asset, "--mesh", mesh, "--rays", "50000", "--bvh", "--json"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_TRUE(without_progress(outcome.err).empty()) << outcome.err;
    const json result = json::parse(outcome.out);
    EXPECT_EQ(result["schema"], "nifkit.eval/2");
    EXPECT_EQ(result["file"], asset);
    EXPECT_EQ(result["triangles"], 2 * 96 * 48);
    EXPECT_EQ(result["bytes"]["file"], std::filesystem::file_size(asset));
    EXPECT_GE(result["bytes"]["resident"].get<uint64_t>(), 1000u);
    EXPECT_EQ(result["sets"].size(), 5u);
    for (const auto& [name, accuracy] : result["sets"].items()) {
      EXPECT_EQ(accuracy["rays"], 50000) << name;
      EXPECT_EQ(accuracy["certain_wrong"], 0) << name;
      EXPECT_LT(accuracy["error"].get<double>(), 0.05) << name;
    }
    const auto bvh = [&](const char* build) { return result["bvh"][build]["bytes"].get<uint64_t>(); };
    EXPECT_GT(bvh("embree_compact"), 0u);
    EXPECT_GT(bvh("embree_default"), bvh("embree_compact"));
  }
  for (const std::string isa : {"scalar", "sse4", "avx2", "avx512"}) {
    SCOPED_TRACE(isa);
    const Outcome outcome = nif(
        {"eval", asset, "--mesh", mesh, "--rays", "50000", "--isa", isa, "--reference", "--json", "--quiet"});
    if (outcome.code != 0) {  // only if the machine lacks it
      EXPECT_NE(isa, "scalar");
      EXPECT_NE(outcome.err.find("isa=" + isa), std::string::npos) << outcome.err;
      continue;
    }
    const json reference = json::parse(outcome.out)["reference"];
    EXPECT_EQ(reference["isa"], isa);
    EXPECT_EQ(reference["rays"], 5 * 50000);
    EXPECT_EQ(reference["different"], 0);
  }
  {
    SCOPED_TRACE("two sets, any number of threads");
    const std::vector<std::string> arguments{"eval",  asset,      "--mesh", mesh,  "--rays", "50000",
                                             "--set", "segments", "--set",  "sun", "--json", "--quiet"};
    std::vector<std::string> one = arguments, two = arguments;
    one.insert(one.end(), {"-j", "1"});
    two.insert(two.end(), {"-j", "2"});
    const Outcome outcome = nif(one);
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_EQ(outcome.err, "");
    const json result = json::parse(outcome.out);
    EXPECT_EQ(result["sets"].size(), 2u);
    EXPECT_TRUE(result["sets"].contains("segments"));
    EXPECT_TRUE(result["sets"].contains("sun"));
    EXPECT_FALSE(result.contains("bvh"));
    EXPECT_EQ(outcome.out, nif(two).out);
  }
  {
    SCOPED_TRACE("a table for people");
    const Outcome outcome = nif({"eval", asset, "--mesh", mesh, "--rays", "1000", "--set", "outer-lines"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    EXPECT_NE(outcome.out.find("outer-lines"), std::string::npos) << outcome.out;
    EXPECT_EQ(outcome.out.find("inner-volume"), std::string::npos) << outcome.out;
  }
  {
    SCOPED_TRACE("a mesh that differs in one vertex");
    mesh::Mesh other = torus(96, 48);
    other.positions[7][2] += 10;
    const std::string changed = folder.write("other.obj", obj_text(other)).string();
    const Outcome outcome = nif({"eval", asset, "--mesh", changed, "--rays", "1000"});
    EXPECT_EQ(outcome.code, int(Status::mesh_mismatch)) << outcome.err;
    EXPECT_EQ(outcome.out, "");
    for (const std::string& file : {asset, changed})
      EXPECT_NE(outcome.err.find(file), std::string::npos) << outcome.err;
    std::filesystem::remove(changed);
  }
  {
    SCOPED_TRACE("info");
    const Outcome text = nif({"info", asset}), as_json = nif({"info", asset, "--json"});
    ASSERT_EQ(text.code, 0) << text.err;
    ASSERT_EQ(as_json.code, 0) << as_json.err;
    EXPECT_EQ(text.err + as_json.err, "");
    for (const char* word : {"ring.nif", "torus", "9216 triangles", "outer-lines"})
      EXPECT_NE(text.out.find(word), std::string::npos) << word << " in:\n" << text.out;
    const json info = json::parse(as_json.out);
    EXPECT_EQ(info["schema"], "nifkit.info/2");
    EXPECT_EQ(info["version"], 2);
    EXPECT_EQ(info["objects"][0]["triangles"], 9216);
    EXPECT_EQ(info["metadata"]["accuracy"]["segments"]["certain_wrong"], 0);
  }
  EXPECT_EQ(listing(folder.path()), files);
}

}  // namespace
}  // namespace nif::test
