// `nif study`: what it compares, how it resumes, and what it refuses.
#include <gtest/gtest.h>

#include <csignal>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>

#include "formats/base/status.hpp"
#include "tests/cli/mesh_text.hpp"
#include "tests/cli/program.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

Outcome study(const std::string& mesh, const fs::path& out, std::vector<std::string> more = {}) {
  std::vector<std::string> arguments{"study", mesh, "-o", out.string(), "--quick", "--rays", "3000"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return nif(arguments);
}

const json* point_of(const json& study, const std::string& family, const std::string& size) {
  for (const json& point : study["points"])
    if (point["family"] == family && point["size"] == size) return &point;
  return nullptr;
}

TEST(Study, ComparesAndGoesOnWhereItStopped) {
  TempDir folder;
  const std::string ball = folder.write("ball.obj", obj_text(icosphere(5))).string();  // 20,480 triangles
  const fs::path out = folder.path() / "study";
  const Outcome outcome = study(ball, out, {"--json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const json all = json::parse(outcome.out);
  EXPECT_EQ(all, json::parse(read_bytes(out / "study.json")));
  EXPECT_EQ(all["schema"], "nifkit.study/1");
  EXPECT_EQ(all["study"]["instances"], 1);
  EXPECT_EQ(outcome.err.find("one mesh"), std::string::npos) << outcome.err;

  std::set<std::string> families;
  for (const json& point : all["points"]) {
    families.insert(point["family"].get<std::string>());
    ASSERT_FALSE(point.contains("left_out")) << point;
    EXPECT_GT(point["bytes"]["resident"].get<uint64_t>(), 0u) << point;
    EXPECT_GT(point["sets"]["sun"]["speed"]["ratio"].get<double>(), 0) << point;
    // A ball is easy, so a higher error means that a rival answers another question. `spherical` is excepted:
    // it is hardly trained.
    if (point["family"] != "spherical") {
      EXPECT_LT(point["sets"]["outer-lines"]["error"].get<double>(), 0.1) << point;
    }
  }
  EXPECT_EQ(families,
            (std::set<std::string>{"segment", "exact", "bvh", "proof, then Embree", "spherical",
                                   "all triangles: Embree", "all triangles: Embree compact",
                                   "OpenMesh: Embree", "OpenMesh: Embree compact", "OpenMesh: exact",
                                   "meshoptimizer: Embree", "meshoptimizer: Embree compact",
                                   "meshoptimizer: exact", "distance field", "voxels"}));
  for (const char* family : {"exact", "bvh"})
    for (const auto& [name, set] : (*point_of(all, family, "all triangles"))["sets"].items())
      EXPECT_EQ(set["error"], 0) << family << ' ' << name;
  // More voxels are better, and take more bytes.
  const json &coarse = *point_of(all, "voxels", "96 voxels along its longest side"),
             &fine = *point_of(all, "voxels", "192 voxels along its longest side");
  EXPECT_LT(fine["sets"]["outer-lines"]["error"], coarse["sets"]["outer-lines"]["error"]);
  EXPECT_GT(fine["bytes"]["resident"], coarse["bytes"]["resident"]);
  const std::string page = read_bytes(out / "study.html");
  EXPECT_TRUE(page.starts_with("<!DOCTYPE html>"));
  EXPECT_EQ(page.find("http"), page.find("http://www.w3.org")) << "a page that asks the network";
  for (const char* word : {"At equal bytes", "Curves", "Pictures", "All sizes", "meshoptimizer: exact"})
    EXPECT_NE(page.find(word), std::string::npos) << word;

  // Nothing is left to do, so all figures stay, even timings.
  const Outcome again = study(ball, out, {"--json"});
  ASSERT_EQ(again.code, 0) << again.err;
  EXPECT_EQ(json::parse(again.out), all);

  // Only a missing point is measured again.
  fs::remove(out / point_of(all, "bvh", "all triangles")->at("view").at("picture").get<std::string>());
  const Outcome mended = study(ball, out, {"--json"});
  ASSERT_EQ(mended.code, 0) << mended.err;
  const json after = json::parse(mended.out);
  ASSERT_EQ(after["points"].size(), all["points"].size());
  for (size_t i = 0; i < all["points"].size(); ++i) {
    if (all["points"][i]["family"] == "bvh") {
      EXPECT_NE(after["points"][i]["seconds"], all["points"][i]["seconds"]);
    } else {
      EXPECT_EQ(after["points"][i], all["points"][i]);
    }
  }

  // Another mesh, other rays, another seed, or no study: results are not mixed, and none is lost.
  const std::string kept = read_bytes(out / "study.json");
  const std::string cubes = folder.write("cube.obj", obj_text(cube())).string();
  for (const auto& [refused, word] : std::vector<std::pair<Outcome, std::string>>{
           {study(cubes, out), "mesh"},
           {study(ball, out, {"--seed", "2"}), "seed"},
           {nif({"study", ball, "-o", out.string(), "--quick", "--rays", "2000"}), "rays"}}) {
    EXPECT_EQ(refused.code, int(Status::checkpoint_refused)) << refused.err;
    EXPECT_NE(refused.err.find("its " + word), std::string::npos) << refused.err;
    EXPECT_NE(refused.err.find("study.json"), std::string::npos) << refused.err;
  }
  EXPECT_EQ(read_bytes(out / "study.json"), kept);
  const std::string nested =
      "{\"new\":" + std::string(300'000, '[') + std::string(300'000, ']') + ',' + kept.substr(1);
  for (const std::string& damaged :
       {kept.substr(0, kept.size() / 2), std::string("{}"), std::string("[1]"), std::string(), nested}) {
    std::ofstream(out / "study.json", std::ios::binary) << damaged;
    const Outcome refused = study(ball, out);
    EXPECT_EQ(refused.code, int(Status::checkpoint_refused)) << refused.err;
    EXPECT_EQ(read_bytes(out / "study.json"), damaged);
  }
}

TEST(Study, LeavesOutWhatAMeshCannotBe) {
  TempDir folder;
  // Two objects, which are studied as one mesh.
  size_t base = 0;
  std::string bowls = obj_object(open_bowl(20, 40), "bowl", base);
  mesh::Mesh beside = open_bowl(10, 20);
  for (mesh::Float3& p : beside.positions) p[0] += 3;
  bowls += obj_object(beside, "beside", base);
  const std::string bowl = folder.write("bowl.obj", bowls).string();
  const fs::path out = folder.path() / "study";
  const Outcome outcome = study(bowl, out);
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const json all = json::parse(read_bytes(out / "study.json"));
  const json* field = point_of(all, "distance field", "96 voxels along its longest side");
  ASSERT_NE(field, nullptr);
  ASSERT_TRUE(field->contains("left_out")) << *field;
  EXPECT_NE((*field)["left_out"].get<std::string>().find("is open"), std::string::npos) << *field;
  EXPECT_FALSE(field->contains("sets"));
  EXPECT_FALSE(point_of(all, "voxels", "96 voxels along its longest side")->contains("left_out"));
  // It has fewer triangles than the simplified meshes would have.
  EXPECT_EQ(point_of(all, "OpenMesh: Embree", "4,000 triangles"), nullptr);
  EXPECT_NE(read_bytes(out / "study.html").find("Left out"), std::string::npos);
  EXPECT_NE(outcome.out.find("segment"), std::string::npos) << outcome.out;
  EXPECT_EQ(all["study"]["instances"], 2);
  const std::string note = "2 instances are studied as one mesh";
  EXPECT_NE(outcome.err.find("nif: note: " + bowl + ": " + note), std::string::npos) << outcome.err;
  EXPECT_NE(read_bytes(out / "study.html").find(note), std::string::npos);
}

TEST(Study, CanBeCancelled) {
  TempDir folder;
  const std::string ball = folder.write("ball.obj", obj_text(icosphere(5))).string();
  const fs::path out = folder.path() / "study";
  Process process(nif_path(), {"study", ball, "-o", out.string(), "--rays", "3000"});
  ASSERT_TRUE(process.wait_for_error_text("segment, scale 0.35"));
  process.send(SIGINT);
  const Outcome outcome = process.finish();
  EXPECT_EQ(outcome.code, int(Status::interrupted));
  EXPECT_NE(outcome.err.find("cancelled"), std::string::npos) << outcome.err;
  const json kept = json::parse(read_bytes(out / "study.json"));
  EXPECT_EQ(kept["points"].size(), 1u);
  EXPECT_FALSE(fs::exists(out / "study.html"));
}

TEST(Study, RefusesWhatItCannotDo) {
  TempDir folder;
  const std::string ball = folder.write("ball.obj", obj_text(icosphere(1))).string(),
                    out = (folder.path() / "study").string();
  EXPECT_EQ(nif({"study", ball}).code, int(Status::usage));
  EXPECT_EQ(nif({"study", ball, "-o", out, "--rays", "0"}).code, int(Status::usage));
  EXPECT_EQ(nif({"study", ball, "-o", out, "--rays", "1000000000000"}).code, int(Status::usage));
  EXPECT_EQ(nif({"study", (folder.path() / "none.obj").string(), "-o", out}).code,
            int(Status::file_not_found));
  EXPECT_EQ(nif({"study", ball, "-o", ball + "/below"}).code, int(Status::output_folder_missing));
}

}  // namespace
}  // namespace nif::test
