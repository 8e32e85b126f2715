// `nif mesh convert`: a mesh, or the objects of a scene, as one .glb that bakes and renders.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "formats/base/status.hpp"
#include "formats/mesh/read.hpp"
#include "tests/cli/mesh_text.hpp"
#include "tests/cli/program.hpp"
#include "tests/support/gltf.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

class MeshConvert : public testing::Test {
 protected:
  std::string path(const std::string& name) const { return (folder_.path() / name).string(); }
  static Outcome convert(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"mesh", "convert"});
    return nif(arguments);
  }

  const TempDir folder_;
};

TEST_F(MeshConvert, KeepsAMeshToTheBit) {
  const std::string input = folder_.write("ring.obj", obj_text(torus(16, 8))).string();
  const Outcome outcome = convert({input, "-o", path("ring.glb"), "--json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const auto result = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(result["schema"], "nifkit.mesh-convert/1");
  EXPECT_EQ(result["bytes"], std::filesystem::file_size(path("ring.glb")));
  const mesh::Scene before = mesh::read(input), after = mesh::read(path("ring.glb"));
  ASSERT_EQ(after.meshes.size(), 1u);
  EXPECT_EQ(result["triangles"], after.meshes[0].triangles.size());
  EXPECT_EQ(after.meshes[0].positions, before.meshes[0].positions);
  EXPECT_EQ(after.meshes[0].triangles, before.meshes[0].triangles);
  EXPECT_EQ(after.meshes[0].name, before.meshes[0].name);
}

TEST_F(MeshConvert, WritesAMomentOfAClip) {
  Gltf gltf = gltf_of(cube());
  const int times = gltf.accessor(raw(std::vector<float>{0, 2}), 5126, "SCALAR", 2),
            places = gltf.accessor(raw(std::vector<float>{0, 0, 0, 4, 0, 0}), 5126, "VEC3", 2);
  gltf.json["animations"] = {
      {{"name", "slide"},
       {"samplers", {{{"input", times}, {"output", places}}}},
       {"channels", {{{"sampler", 0}, {"target", {{"node", 0}, {"path", "translation"}}}}}}}};
  const std::string input = folder_.write("slide.glb", gltf.glb()).string();
  const Outcome listed = nif({"mesh", "info", input, "--json"});
  ASSERT_EQ(listed.code, 0) << listed.err;
  EXPECT_EQ(nlohmann::json::parse(listed.out)["clips"],
            nlohmann::json({{{"name", "slide"}, {"begin", 0}, {"end", 2}, {"channels", 1}}}));
  EXPECT_NE(nif({"mesh", "info", input}).out.find("'slide': 0 to 2 s, 1 channel"), std::string::npos);
  const auto place = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {input, "-o", path("moved.glb"), "--quiet"});
    EXPECT_EQ(convert(more).code, 0);
    return mesh::read(path("moved.glb")).instances.at(0).transform[3];
  };
  EXPECT_EQ(place({}), 0);
  EXPECT_EQ(place({"--clip", "slide"}), 0);
  EXPECT_EQ(place({"--clip", "slide", "--time", "1.5"}), 3);
  const auto refused = [&](std::vector<std::string> more, const std::string& part) {
    more.insert(more.begin(), {input, "-o", path("none.glb")});
    const Outcome outcome = convert(more);
    EXPECT_EQ(outcome.code, int(Status::usage));
    EXPECT_NE(outcome.err.find(part), std::string::npos) << outcome.err;
    EXPECT_FALSE(std::filesystem::exists(path("none.glb")));
  };
  refused({"--clip", "jump"}, "slide.glb: has no clip 'jump', but: slide");
  refused({"--time", "1"}, "--clip");
  refused({"--clip", "slide", "--time", "-1"}, "--time");
}

TEST_F(MeshConvert, PutsTheObjectsOfASceneWhereTheyStand) {
  folder_.write("ring.obj", obj_text(torus(16, 8)));
  folder_.write("ball.obj", obj_text(icosphere(2)));
  const std::string scene =
      folder_
          .write("plan.toml",
                 "[[object]]\nmesh = 'ring.obj'\ntranslate = [1, 2, 3]\n"
                 "[[object]]\nmesh = 'ball.obj'\n[[object]]\nmesh = 'ring.obj'\nscale = 2\n"
                 "[[camera]]\nname = 'front'\n")
          .string();
  const Outcome outcome = convert({scene, "-o", path("all.glb")});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("0 lights and 1 camera of the scene file were left out"), std::string::npos)
      << outcome.err;
  const mesh::Scene all = mesh::read(path("all.glb"));
  ASSERT_EQ(all.meshes.size(), 2u) << "a file named twice is there once";
  ASSERT_EQ(all.instances.size(), 3u);
  EXPECT_EQ(all.instances[0].mesh, all.instances[2].mesh);
  EXPECT_EQ(all.instances[0].transform, (mesh::Transform{1, 0, 0, 1, 0, 1, 0, 2, 0, 0, 1, 3}));
  EXPECT_EQ(all.instances[2].transform, (mesh::Transform{2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0}));
  EXPECT_EQ(nif({"bake", path("all.glb"), "-o", path("all.nif"), "--encoding", "bvh", "--rays", "0"}).code,
            0);
}

TEST_F(MeshConvert, TakesEndingsInCapitals) {
  folder_.write("RING.OBJ", obj_text(torus(16, 8)));
  const std::string scene = folder_.write("PLAN.TOML", "[[object]]\nmesh = 'RING.OBJ'\n").string();
  const Outcome outcome = convert({scene, "-o", path("RING.PLY"), "--json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(nlohmann::json::parse(outcome.out)["triangles"], 256);
  EXPECT_EQ(convert({path("RING.PLY"), "-o", path("RING.VDB"), "--resolution", "20"}).code, 0);
}

TEST_F(MeshConvert, WritesWhatTheNameSays) {
  const std::string input = folder_.write("ring.obj", obj_text(torus(16, 8))).string();
  for (const char* name : {"a.obj", "a.ply", "a.stl", "a.off", "a.drc", "a.GLB"}) {
    const Outcome outcome = convert({input, "-o", path(name), "--json"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    const auto result = nlohmann::json::parse(outcome.out);
    EXPECT_EQ(result["bytes"], std::filesystem::file_size(path(name)));
    EXPECT_EQ(result["notes"].size(), without_progress(outcome.err).size()) << outcome.err;
    EXPECT_EQ(mesh::read(path(name)).meshes.at(0).triangles.size(), 256u) << name;
  }
  EXPECT_NE(read_bytes(path("a.obj")).find("o torus\n"), std::string::npos);
  EXPECT_EQ(convert({input, "-o", path("text.stl"), "--text", "--quiet"}).out, "");
  EXPECT_TRUE(read_bytes(path("text.stl")).starts_with("solid torus\n"));
  ASSERT_EQ(convert({input, "-o", path("small.glb"), "--draco", "--draco-bits", "10"}).code, 0);
  EXPECT_NE(read_bytes(path("small.glb")).find("KHR_draco_mesh_compression"), std::string::npos);
  EXPECT_LT(std::filesystem::file_size(path("small.glb")), std::filesystem::file_size(path("a.GLB")));
}

TEST_F(MeshConvert, RefusesContradictions) {
  const std::string input = folder_.write("ring.obj", obj_text(torus(16, 8))).string();
  for (const std::vector<std::string>& options : std::vector<std::vector<std::string>>{
           {"--text"}, {"--draco"}, {"--draco-bits", "9"}, {"--draco-bits", "31"}}) {
    std::vector<std::string> arguments{input, "-o", path("a.ply")};
    arguments.insert(arguments.end(), options.begin(), options.end());
    const Outcome outcome = convert(arguments);
    EXPECT_EQ(outcome.code, int(Status::usage)) << outcome.err;
    EXPECT_NE(outcome.err.find(options[0]), std::string::npos) << outcome.err;
  }
  EXPECT_EQ(listing(folder_.path()), std::vector<std::string>{"ring.obj"});
}

TEST_F(MeshConvert, RefusesAndLeavesNothing) {
  const std::string input = folder_.write("ring.obj", obj_text(torus(16, 8))).string();
  const auto refused = [&](const std::string& from, const std::string& to, Status status,
                           const std::string& fragment) {
    const Outcome outcome = convert({from, "-o", to});
    EXPECT_EQ(outcome.code, int(status)) << outcome.err;
    EXPECT_NE(outcome.err.find(fragment), std::string::npos) << outcome.err;
  };
  refused(input, path("ring.fbx"), Status::usage, "ring.fbx: is not the name of a mesh file");
  const Outcome volume = nif({"mesh", "subdivide", input, "-o", path("ring.vdb")});
  EXPECT_EQ(volume.code, int(Status::usage));
  EXPECT_NE(volume.err.find("nif mesh voxelize"), std::string::npos) << volume.err;
  refused(path("none.obj"), path("ring.glb"), Status::file_not_found, "none.obj");
  refused(input, path("none/ring.glb"), Status::output_folder_missing, "none");
  folder_.write("bad.toml", "[[object]]\nmesh = 'ring.obj'\nshade = 1\n");
  refused(path("bad.toml"), path("ring.glb"), Status::malformed_scene, "shade");
  ASSERT_EQ(convert({input, "-o", path("ring.glb"), "--quiet"}).code, 0);
  refused(path("ring.glb"), path("ring.glb"), Status::usage, "overwrite");
  EXPECT_EQ(listing(folder_.path()), (std::vector<std::string>{"bad.toml", "ring.glb", "ring.obj"}));
}

TEST_F(MeshConvert, GoesThroughALevelSet) {
  const std::string ball = folder_.write("ball.obj", obj_text(icosphere(3))).string();
  const Outcome there = convert({ball, "-o", path("ball.vdb"), "--voxel", "0.05", "--json"});
  ASSERT_EQ(there.code, 0) << there.err;
  EXPECT_NE(there.err.find("ball.vdb: a level set, sampled every 0.05"), std::string::npos) << there.err;
  const Outcome back = convert({path("ball.vdb"), "-o", path("back.ply"), "--json"});
  ASSERT_EQ(back.code, 0) << back.err;
  const Outcome info = nif({"mesh", "info", path("ball.vdb"), "--json"});
  ASSERT_EQ(info.code, 0) << info.err;
  const auto found = nlohmann::json::parse(info.out);
  EXPECT_EQ(found["closed_components"], 1);
  EXPECT_EQ(found["inward_solids"], 0);
  EXPECT_NEAR(found["volume"].get<double>(), 4.1, 0.1);
  EXPECT_EQ(found["triangles"], nlohmann::json::parse(back.out)["triangles"]);

  EXPECT_EQ(convert({ball, "-o", path("b.vdb"), "--draco"}).code, int(Status::usage));
  EXPECT_EQ(convert({ball, "-o", path("b.ply"), "--voxel", "0.05"}).code, int(Status::usage));
  const Outcome bake = nif({"bake", path("ball.vdb"), "-o", path("ball.nif")});
  EXPECT_EQ(bake.code, int(Status::not_a_mesh));
  EXPECT_NE(bake.err.find("ball.vdb: is an OpenVDB volume; convert it to a mesh with nif mesh convert"),
            std::string::npos)
      << bake.err;
  ASSERT_EQ(nif({"mesh", "voxelize", ball, "-o", path("mask.vdb"), "--kind", "occupancy"}).code, 0);
  const Outcome mask = convert({path("mask.vdb"), "-o", path("mask.ply")});
  EXPECT_EQ(mask.code, int(Status::no_triangles)) << mask.err;
}

TEST_F(MeshConvert, NoDamagedVolumeDoesHarm) {
  if (kSanitized) GTEST_SKIP() << "sanitizers report what OpenVDB gets wrong in its own process";
  const std::string ball = folder_.write("ball.obj", obj_text(icosphere(2))).string();
  ASSERT_EQ(convert({ball, "-o", path("ball.vdb"), "--resolution", "12"}).code, 0);
  const std::string whole = read_bytes(path("ball.vdb"));
  const auto expect_refused_or_read = [&](const std::string& bytes, size_t place) {
    const std::string file = folder_.write("damaged.vdb", bytes).string();
    const Outcome outcome = convert({file, "-o", path("out.ply"), "--quiet"});
    if (outcome.code == 0) return;  // a changed distance is valid, too
    EXPECT_TRUE(outcome.code >= 10 && outcome.code < 30)
        << place << ": " << outcome.code << ' ' << outcome.err;
    EXPECT_NE(outcome.err.find("damaged.vdb: "), std::string::npos) << outcome.err;
    EXPECT_EQ(lines_of(outcome.err).size(), 1u) << outcome.err;
  };
  for (size_t i = 1; i < 12; ++i) expect_refused_or_read(whole.substr(0, whole.size() * i / 12), i);
  for (size_t i = 8; i < whole.size(); i += 1 + whole.size() / 24) {
    std::string damaged = whole;
    damaged[i] = char(damaged[i] ^ 0xFF);
    expect_refused_or_read(damaged, i);
  }
}

}  // namespace
}  // namespace nif::test
