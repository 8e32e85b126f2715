// The subcommands of `nif mesh` that change or compare meshes: what they print, refuse and leave behind.
#include <gtest/gtest.h>
#include <signal.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "formats/base/status.hpp"
#include "formats/mesh/read.hpp"
#include "tests/cli/mesh_text.hpp"
#include "tests/cli/program.hpp"
#include "tests/support/real_meshes.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

using nlohmann::json;

class MeshVerbs : public testing::Test {
 protected:
  std::string path(const std::string& name) const { return (folder_.path() / name).string(); }
  std::string obj(const std::string& name, const mesh::Mesh& mesh) const {
    return folder_.write(name, obj_text(mesh)).string();
  }
  static Outcome run(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "mesh");
    return nif(arguments);
  }
  /// Runs a verb that must succeed, and returns its JSON.
  static json result_of(std::vector<std::string> arguments) {
    arguments.push_back("--json");
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    const json result = json::parse(outcome.out, nullptr, false);
    EXPECT_EQ(result["schema"], "nifkit.mesh-" + arguments[0] + "/1");
    return result;
  }
  /// Runs a verb that must be refused with one sentence that mentions `named`, without writing anything.
  void refused(const std::vector<std::string>& arguments, Status status, const std::string& named) const {
    SCOPED_TRACE(testing::PrintToString(arguments));
    const std::vector<std::string> before = listing(folder_.path());
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.code, int(status)) << outcome.err;
    EXPECT_EQ(outcome.out, "");
    EXPECT_EQ(without_progress(outcome.err).size(), 1u) << outcome.err;
    EXPECT_NE(outcome.err.find(named), std::string::npos) << outcome.err;
    EXPECT_EQ(listing(folder_.path()), before);
  }
  static bool has_cgal() { return nif({"--version"}).out.find("GPL-3.0-or-later") != std::string::npos; }

  const TempDir folder_;
};

TEST_F(MeshVerbs, RepairSaysWhatItChanged) {
  const std::string nested = path("nested.obj");
  mesh::Mesh boxes = cube();
  append(boxes, cube(), 0.5f);
  boxes.positions.push_back({1, std::nanf(""), 0});
  boxes.triangles.push_back({0, 1, uint32_t(boxes.positions.size() - 1)});
  const json turned = result_of({"repair", obj("nested.obj", boxes), "-o", path("out.glb")});
  EXPECT_EQ(turned["changes"]["solids_turned"], 1);
  EXPECT_EQ(turned["after"]["volume"], 7);
  ASSERT_EQ(turned["notes"].size(), 1u);
  EXPECT_NE(turned["notes"][0].get<std::string>().find("1 triangle that uses"), std::string::npos);
  EXPECT_EQ(result_of({"repair", nested, "-o", path("out.glb"), "--keep-nested"})["after"]["volume"], 9);
  EXPECT_EQ(json::parse(run({"info", nested, "--json"}).out)["notes"].size(), 1u);
  refused({"subdivide", nested, "-o", path("x.ply")}, Status::non_finite_vertex, "nested.obj");
  if (!has_cgal()) {
    refused({"repair", obj("a.obj", cube()), "-o", path("b.obj"), "--fill-holes", "9"}, Status::usage,
            "lacks CGAL");
    GTEST_SKIP() << "built without CGAL";
  }
  mesh::Mesh broken = icosphere(2);
  broken.triangles.erase(broken.triangles.begin());
  broken.triangles.push_back(broken.triangles[0]);
  size_t base = 0;
  std::string text = obj_object(broken, "ball", base);
  text += obj_object(cube(), "box", base);
  const std::string input = folder_.write("two.obj", text).string();
  const json result = result_of({"repair", input, "-o", path("out.glb"), "--fill-holes", "10"});
  EXPECT_EQ(result["changes"]["duplicate_dropped"], 1);
  EXPECT_EQ(result["changes"]["holes_filled"], 1);
  EXPECT_EQ(result["before"]["boundary_edges"], 3);
  EXPECT_EQ(result["after"]["boundary_edges"], 0);
  EXPECT_EQ(result["after"]["solids"], 2);
  const mesh::Scene scene = mesh::read(path("out.glb"));
  ASSERT_EQ(scene.meshes.size(), 2u);
  EXPECT_EQ(scene.meshes[0].name, "ball");
  EXPECT_EQ(scene.meshes[1].name, "box");
  const Outcome text_of = run({"repair", input, "-o", path("out.glb")});
  EXPECT_NE(text_of.out.find("1 duplicate"), std::string::npos) << text_of.out;
  refused({"repair", input, "-o", path("x.ply"), "--weld", "near"}, Status::usage, "--weld");
}

TEST_F(MeshVerbs, DecimateStopsAndSaysSo) {
  const std::string input = obj("ball.obj", icosphere(4));
  for (const char* fast : {"", "--fast"}) {
    std::vector<std::string> arguments{"decimate", input, "-o", path("out.ply"), "--ratio", "0.1"};
    if (*fast) arguments.emplace_back(fast);
    const json result = result_of(arguments);
    EXPECT_EQ(result["triangles"]["before"], 5120);
    EXPECT_LE(result["triangles"]["after"], 512);
    EXPECT_EQ(result["triangles"]["after"], mesh::read(path("out.ply")).meshes[0].triangles.size());
  }
  const json bounded = result_of({"decimate", input, "-o", path("out.ply"), "--max-error", "0.1%"});
  EXPECT_LT(bounded["triangles"]["after"], 5120);
  EXPECT_GT(bounded["triangles"]["after"], 512);
  refused({"decimate", input, "-o", path("x.ply")}, Status::usage, "--ratio");
  refused({"decimate", input, "-o", path("x.ply"), "--ratio", "2"}, Status::usage, "--ratio");
  refused({"decimate", input, "-o", path("x.ply"), "--max-error", "-1"}, Status::usage, "--max-error");
  refused({"decimate", input, "-o", path("x.fbx"), "--ratio", "0.5"}, Status::usage, "x.fbx");
}

TEST_F(MeshVerbs, SubdivideRefusesWhatWouldNotFit) {
  const std::string input = obj("ball.obj", icosphere(3));
  const json result =
      result_of({"subdivide", input, "-o", path("out.ply"), "--scheme", "sqrt3", "--times", "2"});
  EXPECT_EQ(result["triangles"]["after"], 1280 * 9);
  refused({"subdivide", input, "-o", path("x.ply"), "--times", "12"}, Status::too_large, "--times 12");
  refused({"subdivide", input, "-o", path("x.ply"), "--scheme", "cubic"}, Status::usage, "--scheme");
  if (kSanitized) GTEST_SKIP() << "sanitizers do not work where memory is limited";
  // 5.2 million triangles are allowed, but exceed the program's memory limit.
  const Outcome limited =
      Process("/bin/sh", {"-c", R"(ulimit -v 1200000; exec "$0" mesh subdivide "$1" -o "$2" --times 6)",
                          nif_path().string(), input, path("x.ply")})
          .finish();
  EXPECT_EQ(limited.code, int(Status::too_large)) << limited.err;
  EXPECT_NE(limited.err.find("5242880 triangles takes about"), std::string::npos) << limited.err;
}

TEST_F(MeshVerbs, RemeshByLevelSet) {
  const std::string ball = obj("ball.obj", icosphere(3)), bowl = obj("bowl.obj", open_bowl(8, 16));
  const json result = result_of({"remesh", ball, "-o", path("out.ply"), "--resolution", "40"});
  EXPECT_EQ(result["method"], "level-set");
  EXPECT_EQ(json::parse(run({"info", path("out.ply"), "--json"}).out)["solids"], 1);
  refused({"remesh", bowl, "-o", path("x.ply")}, Status::usage, "--thickness");
  refused({"remesh", bowl, "-o", path("x.ply"), "--thickness", "0.001"}, Status::usage, "two voxels");
  refused({"remesh", ball, "-o", path("x.ply"), "--voxel", "1e-9"}, Status::usage, "--voxel");
  refused({"remesh", ball, "-o", path("x.ply"), "--voxel", "1", "--resolution", "9"}, Status::usage,
          "--voxel");
  refused({"remesh", ball, "-o", path("x.ply"), "--edge", "1"}, Status::usage, "--edge");
  EXPECT_EQ(run({"remesh", bowl, "-o", path("shell.ply"), "--thickness", "0.1"}).code, 0);
}

TEST_F(MeshVerbs, RemeshIsotropically) {
  const std::string bowl = obj("bowl.obj", open_bowl(8, 16));
  if (!has_cgal()) {
    refused({"remesh", bowl, "-o", path("x.ply"), "--method", "isotropic"}, Status::usage, "lacks CGAL");
    GTEST_SKIP() << "built without CGAL";
  }
  const json result =
      result_of({"remesh", bowl, "-o", path("out.ply"), "--method", "isotropic", "--edge", "0.1"});
  EXPECT_GT(result["triangles"]["after"], 1000) << "of edges of a tenth, on half a unit sphere";
  EXPECT_LT(result["triangles"]["after"], 3000);
  EXPECT_EQ(json::parse(run({"info", path("out.ply"), "--json"}).out)["boundary_loops"], 1);
  const json cube_kept = result_of({"remesh", obj("cube.obj", cube()), "-o", path("c.ply"), "--method",
                                    "isotropic", "--edge", "0.2", "--sharp", "40"});
  const json info = json::parse(run({"info", path("c.ply"), "--json"}).out);
  EXPECT_NEAR(info["volume"].get<double>(), 8, 1e-4) << "edges and corners of the cube stay";
  refused({"remesh", bowl, "-o", path("x.ply"), "--method", "isotropic", "--voxel", "1"}, Status::usage,
          "--voxel");
}

TEST_F(MeshVerbs, VoxelizeWritesTheSameBytesOnAnyNumberOfThreads) {
  const std::string ball = obj("ball.obj", icosphere(4));
  for (const char* kind : {"level-set", "occupancy"}) {
    for (const char* threads : {"1", "3"}) {
      const json result = result_of({"voxelize", ball, "-o", path(std::string(threads) + ".vdb"), "--kind",
                                     kind, "-j", threads, "--resolution", "100"});
      EXPECT_EQ(result["bytes"], std::filesystem::file_size(path(std::string(threads) + ".vdb")));
      EXPECT_GT(result["voxels"], 100000);
    }
    EXPECT_TRUE(read_bytes(path("1.vdb")) == read_bytes(path("3.vdb"))) << kind;
  }
  EXPECT_EQ(run({"voxelize", ball, "-o", path("LARGE.VDB"), "--resolution", "20"}).code, 0);
  refused({"voxelize", ball, "-o", path("x.ply")}, Status::usage, ".vdb");
  refused({"voxelize", obj("bowl.obj", open_bowl(8, 16)), "-o", path("x.vdb")}, Status::usage, "open");
  const std::string point = folder_.write("point.obj", "v 1 2 3\nv 1 2 3\nv 1 2 3\nf 1 2 3\n").string();
  refused({"voxelize", point, "-o", path("x.vdb")}, Status::all_degenerate, "is a single point");
}

TEST_F(MeshVerbs, CompareMeasuresBothWays) {
  const std::string fine = obj("fine.obj", icosphere(4)), coarse = obj("coarse.obj", icosphere(1));
  const json result =
      result_of({"compare", fine, coarse, "--samples", "20000", "--rays", "20000", "-j", "1"});
  EXPECT_GT(result["first_to_second"]["mean"], 0.01);
  EXPECT_NEAR(result["hausdorff"].get<double>(), 0.06, 0.04);
  ASSERT_EQ(result["sets"].size(), 5u);
  EXPECT_GT(result["sets"]["outer-lines"]["opened"], 0.001);
  json again = result_of({"compare", fine, coarse, "--samples", "20000", "--rays", "20000"});
  for (const char* key : {"hausdorff", "first_to_second", "second_to_first", "sets"})
    EXPECT_EQ(again[key], result[key]) << key;
  EXPECT_EQ(result_of({"compare", fine, fine, "--rays", "0"})["sets"].size(), 0u);
  refused({"compare", fine, coarse, "--set", "rays"}, Status::usage, "rays");
  refused({"compare", fine, path("none.obj")}, Status::file_not_found, "none.obj");
}

TEST_F(MeshVerbs, RefuseAnInputByNameAndItsOverwriting) {
  const std::string input = obj("ball.obj", icosphere(1));
  const std::string flat = folder_.write("flat.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n").string();
  for (const std::vector<std::string>& verb :
       std::vector<std::vector<std::string>>{{"decimate", "--ratio", "0.5"}, {"subdivide"}, {"remesh"}}) {
    const auto with = [&](const std::string& from, const std::string& to) {
      std::vector<std::string> arguments{verb[0], from, "-o", to};
      arguments.insert(arguments.end(), verb.begin() + 1, verb.end());
      return arguments;
    };
    refused(with(path("none.obj"), path("x.obj")), Status::file_not_found, "none.obj");
    refused(with(input, input), Status::usage, "overwrite");
    refused(with(input, path("none/x.obj")), Status::output_folder_missing, "none");
  }
  const Outcome outcome = run({"decimate", flat, "-o", path("x.obj"), "--ratio", "0.5"});
  EXPECT_EQ(outcome.code, int(Status::all_degenerate)) << outcome.err;
  EXPECT_NE(outcome.err.find("flat.obj"), std::string::npos) << outcome.err;
  EXPECT_FALSE(std::filesystem::exists(path("x.obj")));
}

TEST_F(MeshVerbs, TakeRealMeshesOrSayWhyNot) {
  if (!real_mesh_folder()) GTEST_SKIP() << "NIF_TEST_MESHES is not set";
  for (const std::filesystem::path& file : real_meshes(1'000'000)) {
    for (std::vector<std::string> verb :
         std::vector<std::vector<std::string>>{{"info", "--self-intersections", "auto"},
                                               {"repair", "--fill-holes", "50", "--weld", "0.001%"},
                                               {"decimate", "--ratio", "0.3", "--fast", "--max-error", "1%"},
                                               {"subdivide", "--scheme", "sqrt3"},
                                               {"subdivide", "--scheme", "loop"},
                                               {"remesh", "--thickness", "4%", "--resolution", "64"},
                                               {"remesh", "--allow-open", "--resolution", "64"}}) {
      verb.insert(verb.begin() + 1, file.string());
      if (verb[0] != "info") verb.insert(verb.end(), {"-o", path("out.glb")});
      SCOPED_TRACE(testing::PrintToString(verb));
      const Outcome outcome = run(verb);
      EXPECT_LT(outcome.code, 60) << outcome.err;  // not killed by a signal
      EXPECT_NE(outcome.code, int(Status::internal)) << outcome.err;
      if (outcome.code != 0) {
        EXPECT_EQ(lines_of(outcome.err).empty(), false);
      }
    }
  }
}

TEST_F(MeshVerbs, InterruptLeavesNothing) {
  const std::string input = obj("ball.obj", icosphere(7)), old = folder_.write("old.ply", "old").string();
  for (const int signal : {SIGINT, SIGTERM}) {
    Process process(nif_path(),
                    {"mesh", "decimate", input, "-o", old, "--ratio", "0.001", "--max-error", "10%"});
    ASSERT_TRUE(process.wait_for_error_text("decimating"));
    process.send(signal);
    const Outcome outcome = process.finish(60);
    EXPECT_EQ(outcome.code, int(Status::interrupted)) << outcome.err;
    EXPECT_EQ(without_progress(outcome.err).size(), 1u) << outcome.err;
    EXPECT_EQ(listing(folder_.path()), (std::vector<std::string>{"ball.obj", "old.ply"}));
  }
  EXPECT_EQ(read_bytes(old), "old");
}

}  // namespace
}  // namespace nif::test
