// `nif bake` of a glTF and `nif attach`: names, hierarchy and instances kept, and the asset in the file.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "formats/base/status.hpp"
#include "tests/cli/program.hpp"
#include "tests/support/gltf.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

using nlohmann::json;

/// A car with four wheels, one of them flattened by its transform, under a nameless node.
Gltf car() {
  Gltf gltf = gltf_of(cube());
  gltf.json["nodes"][0] = {{"name", "car"}, {"children", {1, 2, 3}}, {"translation", {5, 0, 0}}};
  std::vector<uint32_t> flat;
  const mesh::Mesh wheel = torus(12, 6);
  for (const auto& t : wheel.triangles) flat.insert(flat.end(), t.begin(), t.end());
  const int tyre = gltf.mesh(gltf.positions(wheel.positions), gltf.indices(flat), "tyre");
  gltf.node({{"children", {4, 5}}, {"translation", {0, 1, 0}}});
  gltf.node({{"name", "body"}, {"mesh", 0}});
  gltf.node({{"name", "wheel"}, {"mesh", tyre}, {"scale", {1, 0, 0}}});
  gltf.node({{"name", "wheel"}, {"mesh", tyre}, {"scale", {-1, 1, 1}}});
  gltf.node({{"mesh", tyre}, {"translation", {1, 0, 0}}});
  return gltf;
}

class Attach : public testing::Test {
 protected:
  std::string path(const std::string& name) const { return (folder_.path() / name).string(); }
  std::string bytes(const std::string& name) const { return read_bytes(path(name)); }
  void bake(const std::string& mesh, const std::string& asset) const {
    const Outcome outcome = nif({"bake", path(mesh), "-o", path(asset), "--encoding", "bvh", "--rays", "0"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
  }
  Outcome attach(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), "attach");
    return nif(arguments);
  }
  void refused(const std::vector<std::string>& arguments, Status status, const std::string& fragment) const {
    SCOPED_TRACE(testing::PrintToString(arguments));
    const std::vector<std::string> before = listing(folder_.path());
    const Outcome outcome = attach(arguments);
    EXPECT_EQ(outcome.code, int(status)) << outcome.err;
    EXPECT_EQ(outcome.out, "");
    EXPECT_NE(outcome.err.find(fragment), std::string::npos) << outcome.err;
    EXPECT_EQ(without_progress(outcome.err).size(), 1u) << outcome.err;
    EXPECT_EQ(listing(folder_.path()), before);
  }

  const TempDir folder_;
};

TEST_F(Attach, BakeKeepsNamesHierarchyAndInstances) {
  folder_.write("car.glb", car().glb());
  bake("car.glb", "car.nif");
  const json info = json::parse(nif({"info", path("car.nif"), "--json"}).out);
  ASSERT_EQ(info["objects"].size(), 2u);
  ASSERT_EQ(info["instances"].size(), 3u) << "one is flattened to a line";
  EXPECT_EQ(info["instances"][0]["name"], "wheel");
  EXPECT_EQ(info["instances"][0]["transform"], json({-1, 0, 0, 5, 0, 1, 0, 1, 0, 0, 1, 0}));
  EXPECT_EQ(info["instances"][1]["name"], "tyre");
  EXPECT_EQ(info["instances"][1]["object"], info["instances"][0]["object"]);
  EXPECT_EQ(info["instances"][2]["name"], "body");
  EXPECT_EQ(info["metadata"]["hierarchy"], json::parse(R"({
      "nodes": [{"node": 0, "name": "car"}, {"node": 1, "parent": 0}, {"node": 4, "name": "wheel", "parent": 1},
                {"node": 5, "parent": 1}, {"node": 2, "name": "body", "parent": 0}],
      "instances": [4, 5, 2]})"));
  const std::string text = nif({"info", path("car.nif")}).out;
  EXPECT_NE(text.find("instance  'tyre': object 'tyre', node 5, car/1/5\n"), std::string::npos) << text;
}

TEST_F(Attach, EmbedsAndTakesOutAgain) {
  const std::string before = car().glb();
  folder_.write("car.glb", before);
  bake("car.glb", "car.nif");
  const Outcome outcome = attach({path("car.glb"), path("car.nif"), "-o", path("both.glb"), "--json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const json result = json::parse(outcome.out);
  EXPECT_EQ(result["schema"], "nifkit.attach/1");
  EXPECT_EQ(result["how"], "embedded");
  EXPECT_EQ(result["bytes"], std::filesystem::file_size(path("both.glb")));
  EXPECT_EQ(result["nodes"], 3);
  EXPECT_EQ(result["notes"].size(), 0u) << "what is left out has no instance, and the bake said so";

  const std::string after = bytes("both.glb");
  const json root = json::parse(after.substr(20, after.find("BIN") - 24));
  const std::vector<std::pair<size_t, int>> expected{{4, 0}, {5, 1}, {2, 2}};
  for (const auto& [node, instance] : expected)
    EXPECT_EQ(root["nodes"][node]["extensions"]["NIF_visibility"],
              (json{{"asset", 0}, {"instance", instance}}));
  EXPECT_FALSE(root["nodes"][3].contains("extensions"));
  ASSERT_NE(after.find(bytes("car.nif")), std::string::npos);
  EXPECT_EQ(after.find(bytes("car.nif")) % 64, 0u) << "where a mapped file can be used in place";

  bake("both.glb", "again.nif");
  EXPECT_EQ(bytes("again.nif"), bytes("car.nif"));
  ASSERT_EQ(attach({path("both.glb"), path("again.nif"), "-o", path("twice.glb")}).code, 0);
  EXPECT_EQ(bytes("twice.glb"), after);
  ASSERT_EQ(attach({path("both.glb"), "--remove", "-o", path("without.glb"), "--json"}).code, 0);
  EXPECT_EQ(bytes("without.glb"), before);
}

TEST_F(Attach, NamesAnAssetBesideTheFile) {
  const Gltf gltf = car();
  std::filesystem::create_directory(path("assets"));
  folder_.write("car.bin", gltf.data);
  folder_.write("car.gltf", gltf.gltf("car.bin"));
  bake("car.gltf", "assets/a b.nif");
  const Outcome outcome =
      attach({path("car.gltf"), path("assets/a b.nif"), "-o", path("out.gltf"), "--json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(json::parse(outcome.out)["asset"]["uri"], "assets/a%20b.nif");
  EXPECT_EQ(json::parse(bytes("out.gltf"))["extensions"]["NIF_visibility"]["assets"][0]["uri"],
            "assets/a%20b.nif");
  bake("out.gltf", "again.nif");
  EXPECT_EQ(bytes("again.nif"), bytes("assets/a b.nif"));
  ASSERT_EQ(attach({path("out.gltf"), "--remove", "-o", path("back.gltf"), "--quiet"}).code, 0);
  EXPECT_EQ(bytes("back.gltf"), bytes("car.gltf"));

  folder_.write("car.glb", gltf.glb());
  ASSERT_EQ(nif({"bake", path("car.glb"), "-o", path("b.nif"), "--encoding", "bvh", "--rays", "0"}).code, 0);
  ASSERT_EQ(
      attach({path("car.glb"), path("b.nif"), "-o", path("assets/out.glb"), "--reference", "--quiet"}).code,
      0);
  EXPECT_NE(bytes("assets/out.glb").find("\"uri\":\"../b.nif\""), std::string::npos);
  refused({path("car.gltf"), path("assets/a b.nif"), "-o", path("assets/out.gltf")}, Status::usage,
          "'car.bin' in its own folder");
}

TEST_F(Attach, AnAssetOfAnotherFileNeedsForce) {
  Gltf gltf = car();
  folder_.write("car.glb", gltf.glb());
  bake("car.glb", "car.nif");
  gltf.json["nodes"][2]["name"] = "chassis";
  folder_.write("changed.glb", gltf.glb());
  refused({path("changed.glb"), path("car.nif"), "-o", path("out.glb")}, Status::mesh_mismatch,
          "was not baked from");
  const Outcome outcome =
      attach({path("changed.glb"), path("car.nif"), "-o", path("out.glb"), "--force", "--json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const json result = json::parse(outcome.out);
  EXPECT_EQ(result["nodes"], 2);
  EXPECT_EQ(result["notes"].size(), 2u) << result["notes"];
  folder_.write("cube.glb", gltf_of(cube()).glb());
  bake("cube.glb", "cube.nif");
  refused({path("car.glb"), path("cube.nif"), "-o", path("none.glb"), "--force"}, Status::mesh_mismatch,
          "none of its 1 instance");
}

TEST_F(Attach, RefusesAndLeavesNothing) {
  folder_.write("car.glb", car().glb());
  bake("car.glb", "car.nif");
  const std::string gltf = path("car.glb"), asset = path("car.nif"), out = path("out.glb");
  refused({gltf, "-o", out}, Status::usage, "give an ASSET");
  refused({gltf, asset, "-o", out, "--remove"}, Status::usage, "--remove and an ASSET");
  refused({gltf, "-o", out, "--remove", "--reference"}, Status::usage, "--remove and --reference");
  refused({gltf, "-o", out, "--remove"}, Status::usage, "no attached asset");
  refused({gltf, asset, "-o", gltf}, Status::usage, "overwrite");
  refused({gltf, asset, "-o", asset}, Status::usage, "overwrite");
  refused({gltf, asset, "-o", path("out.gltf")}, Status::usage, "must end in .glb");
  refused({gltf, asset, "-o", path("none/out.glb")}, Status::output_folder_missing, "none");
  refused({path("none.glb"), asset, "-o", out}, Status::file_not_found, "none.glb");
  refused({gltf, path("none.nif"), "-o", out}, Status::file_not_found, "none.nif");
  std::string damaged = bytes("car.nif");
  damaged[damaged.size() / 2] ^= 1;
  refused({gltf, folder_.write("damaged.nif", damaged).string(), "-o", out}, Status::damaged_nif,
          "damaged.nif");
  refused({gltf, folder_.write("half.nif", damaged.substr(0, 100)).string(), "-o", out},
          Status::file_truncated, "half.nif");
  refused({gltf, gltf, "-o", out}, Status::not_a_nif, "car.glb");
  const auto bad = [&](const std::string& name, const std::string& content, Status status,
                       const std::string& fragment) {
    refused({folder_.write(name, content).string(), asset, "-o", out}, status, fragment);
  };
  bad("bad.glb", "no mesh", Status::not_a_mesh, "neither glTF nor GLB");
  bad("bad.gltf", R"({"asset":{"version":"1.0"}})", Status::not_a_mesh, "glTF 1.0");
  bad("bad.glb", car().glb().substr(0, 200), Status::file_truncated, "bad.glb");
  bad("bad.gltf", R"({"asset":{"version":"2.0"},"a":)" + std::string(100000, '['), Status::malformed_mesh,
      "deeper");
  Gltf odd = car();
  odd.json["extensions"] = 5;
  bad("bad.glb", odd.glb(), Status::mesh_mismatch, "was not baked from");
  refused({path("bad.glb"), asset, "-o", out, "--force"}, Status::malformed_mesh,
          "extensions of the wrong type");
}

}  // namespace
}  // namespace nif::test
