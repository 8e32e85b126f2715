// `nif render` on assets that the program has baked itself.
#include <gtest/gtest.h>

#include <csignal>
#include <map>
#include <nlohmann/json.hpp>

#include "formats/base/status.hpp"
#include "tests/cli/mesh_text.hpp"
#include "tests/cli/program.hpp"
#include "tests/support/gltf.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;

class Render : public testing::Test {
 protected:
  static std::string scene_text(const std::string& object) {
    return "[picture]\nwidth = 64\nheight = 48\nsamples = 4\n[[object]]\n" + object +
           "[ground]\n[[light]]\ntype = 'sun'\ndirection = [0.4, 0.8, 0.3]\nangle = 2\n[[light]]\ntype = "
           "'sky'\n"
           "[[camera]]\nname = 'front'\n[[camera]]\nname = 'side'\nazimuth = 120\n";
  }
  std::string bake(const std::string& encoding, const std::vector<std::string>& more = {}) {
    if (!fs::exists(folder_.path() / "ring.obj")) folder_.write("ring.obj", obj_text(torus(64, 32)));
    const std::string asset = (folder_.path() / (encoding + ".nif")).string();
    std::vector<std::string> arguments{
        "bake",   (folder_.path() / "ring.obj").string(), "-o", asset, "--encoding", encoding, "--rays", "0",
        "--quiet"};
    if (encoding != "bvh") arguments.insert(arguments.end(), {"--preset", "fast"});
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Outcome outcome = nif(arguments);
    EXPECT_EQ(outcome.code, 0) << outcome.err;
    return asset;
  }
  void refused(const std::vector<std::string>& arguments, Status status, const std::string& fragment) {
    SCOPED_TRACE(testing::PrintToString(arguments));
    const std::vector<std::string> before = listing(folder_.path());
    const Outcome outcome = nif(arguments);
    EXPECT_EQ(outcome.code, int(status)) << outcome.err;
    EXPECT_EQ(outcome.out, "");
    const std::vector<std::string> lines = without_progress(outcome.err);
    ASSERT_EQ(lines.size(), 1u) << outcome.err;
    EXPECT_NE(lines[0].find(fragment), std::string::npos) << "'" << fragment << "' in: " << lines[0];
    EXPECT_EQ(listing(folder_.path()), before);
  }

  const TempDir folder_;
  const std::string out_ = (folder_.path() / "out").string();
};

TEST_F(Render, ExactAssetsGiveTheReferencesPicture) {
  bake("bvh");
  const std::string scene =
      folder_.write("scene.toml", scene_text("mesh = 'ring.obj'\nnif = 'bvh.nif'\n")).string();
  const Outcome outcome = nif({"render", scene, "-o", out_, "--json", "--exr"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const json result = json::parse(outcome.out);
  EXPECT_EQ(result["schema"], "nifkit.render/1");
  EXPECT_EQ(result["triangles"], 2 * 64 * 32);
  ASSERT_EQ(result["cameras"].size(), 2u);
  for (const auto& [name, camera] : result["cameras"].items()) {
    EXPECT_GT(camera["shadow_rays"], 64 * 48) << name;
    EXPECT_EQ(camera["certain"], 1) << name;
    // Rounding may differ on an edge.
    EXPECT_LT(camera["error"].get<double>(), 1e-3) << name;
    for (const char* mode : {"bits", "probability", "hybrid"}) {
      const json& psnr = camera["pictures"][mode]["psnr"];
      EXPECT_TRUE(psnr.is_null() || psnr.get<double>() > 45) << name << mode << psnr;
    }
  }
  std::vector<std::string> files;
  for (const char* camera : {"front", "side"})
    for (const char* file : {"bits.exr", "bits.png", "compare.png", "error.png", "hybrid.exr", "hybrid.png",
                             "probability.exr", "probability.png", "reference.exr", "reference.png"})
      files.push_back(std::string(camera) + "-" + file);
  EXPECT_EQ(listing(out_), files);
}

/// A pane of glass around the ring: neither the asset nor the reference has it.
TEST_F(Render, WhatLetsLightThroughIsInNeither) {
  folder_.write("a.mtl", "newmtl glass\nd 0.1\n");
  folder_.write("ring.obj", "mtllib a.mtl\n" + obj_text(torus(64, 32)) +
                                "v -9 -9 -9\nv 9 -9 -9\nv 0 9 9\nusemtl glass\nf -1 -2 -3\n");
  bake("bvh");
  const std::string scene =
      folder_.write("scene.toml", scene_text("mesh = 'ring.obj'\nnif = 'bvh.nif'\n")).string();
  const Outcome outcome = nif({"render", scene, "-o", out_, "--json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const json report = json::parse(outcome.out);
  EXPECT_EQ(report["triangles"], torus(64, 32).triangles.size());
  for (const auto& [name, camera] : report["cameras"].items())
    EXPECT_LT(camera["error"].get<double>(), 1e-3) << name;
  // Another library: the asset is of other triangles.
  folder_.write("a.mtl", "newmtl glass\n");
  const Outcome changed = nif({"eval", (folder_.path() / "bvh.nif").string(), "--mesh",
                               (folder_.path() / "ring.obj").string(), "--rays", "1000"});
  EXPECT_EQ(changed.code, int(Status::mesh_mismatch));
  EXPECT_NE(changed.err.find("materials or pictures have changed"), std::string::npos) << changed.err;
  EXPECT_EQ(nif({"render", scene, "-o", out_}).code, int(Status::mesh_mismatch));
}

TEST_F(Render, FieldsComeCloseAndThreadsDoNotMatter) {
  bake("segment");
  const std::string scene =
      folder_.write("scene.toml", scene_text("mesh = 'ring.obj'\nnif = 'segment.nif'\n")).string();
  const Outcome outcome = nif({"render", scene, "-o", out_, "-j", "1", "--json", "--quiet"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const json cameras = json::parse(outcome.out)["cameras"];
  for (const auto& [name, camera] : cameras.items()) {
    EXPECT_GT(camera["pictures"]["bits"]["psnr"], 25) << name;
    // Equal pictures have none.
    const json& hybrid = camera["pictures"]["hybrid"]["psnr"];
    EXPECT_TRUE(hybrid.is_null() || hybrid > camera["pictures"]["bits"]["psnr"]) << name;
    EXPECT_GT(camera["pictures"]["probability"]["ssim"], 0.9) << name;
    EXPECT_GT(camera["error"], 0) << name;
    EXPECT_LT(camera["certain"], 1) << name;
  }
  const std::string other = (folder_.path() / "other").string();
  ASSERT_EQ(nif({"render", scene, "-o", other, "-j", "2", "--quiet"}).code, 0);
  ASSERT_EQ(listing(out_), listing(other));
  for (const std::string& file : listing(out_))
    EXPECT_EQ(read_bytes(fs::path(out_) / file), read_bytes(fs::path(other) / file)) << file;
}

/// Rays from inside and outside of an asset's box add up to all rays.
TEST_F(Render, PartsOfTheAnswersAlone) {
  bake("segment", {"--resolution", "8"});  // coarse enough for wrong answers in both parts
  const std::string scene =
      folder_.write("scene.toml", scene_text("mesh = 'ring.obj'\nnif = 'segment.nif'\n")).string();
  std::map<std::string, double> wrong;
  for (const std::string exact : {"none", "inside", "outside"}) {
    const Outcome outcome = nif({"render", scene, "-o", out_, "--exact", exact, "--json", "--quiet"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    const json camera = json::parse(outcome.out)["cameras"]["front"];
    wrong[exact] = camera["error"].get<double>() * camera["shadow_rays"].get<double>();
  }
  EXPECT_GT(wrong["inside"], 0);
  EXPECT_GT(wrong["outside"], 0);
  EXPECT_NEAR(wrong["none"], wrong["inside"] + wrong["outside"], 1e-3);
}

TEST_F(Render, FieldsLearnedFromAView) {
  folder_.write("ring.obj", obj_text(torus(64, 32)));
  const std::string mesh = (folder_.path() / "ring.obj").string();
  const std::string asset = (folder_.path() / "view.nif").string();
  const std::string view = folder_.write("view.toml", scene_text("mesh = 'ring.obj'\n")).string();
  const std::vector<std::string> bake{"bake",   mesh, "-o",     asset, "--preset", "paper",
                                      "--view", view, "--rays", "0",   "--quiet"};
  std::vector<std::string> arguments = bake;
  arguments.insert(arguments.end(), {"--view-samples", "256", "-j", "2"});
  ASSERT_EQ(nif(arguments).code, 0);
  const std::string bytes = read_bytes(asset);
  arguments.back() = "1";
  ASSERT_EQ(nif(arguments).code, 0);
  EXPECT_EQ(bytes, read_bytes(asset));
  EXPECT_NE(bytes.find("2 cameras, 64 x 48 pixels, 256 samples each"), std::string::npos);

  const std::string scene =
      folder_.write("scene.toml", scene_text("mesh = 'ring.obj'\nnif = 'view.nif'\n")).string();
  const Outcome outcome =
      nif({"render", scene, "-o", out_, "--json", "--quiet", "--samples", "16", "--seed", "5"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const json cameras = json::parse(outcome.out)["cameras"];
  for (const auto& [name, camera] : cameras.items()) {
    EXPECT_GT(camera["pictures"]["probability"]["psnr"], 24) << name;
    EXPECT_LT(camera["error"], 0.1) << name;
  }

  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"bake", mesh, "-o", (folder_.path() / "none.nif").string()});
    return more;
  };
  refused(with({"--view", view}), Status::usage, "--view needs --encoding spherical");
  refused(with({"--preset", "paper", "--view-samples", "4"}), Status::usage, "--view-samples needs --view");
  refused(with({"--preset", "paper", "--view", view, "--mix", "outer-lines"}), Status::usage,
          "--view and --mix");
  refused(with({"--preset", "paper", "--view", "none.toml"}), Status::file_not_found, "none.toml");
  const std::string other = folder_.write("cube.obj", obj_text(cube())).string();
  const std::string without = folder_.write("other.toml", scene_text("mesh = 'cube.obj'\n")).string();
  refused(with({"--preset", "paper", "--view", without}), Status::usage, "no object of this scene uses");
}

TEST_F(Render, CamerasRaysByAField) {
  folder_.write("ring.obj", obj_text(torus(64, 32)));
  const std::string mesh = (folder_.path() / "ring.obj").string();
  const std::string view = folder_.write("view.toml", scene_text("mesh = 'ring.obj'\n")).string();
  const auto bake = [&](const std::string& asset, std::vector<std::string> more) {
    more.insert(more.begin(), {"bake", mesh, "-o", (folder_.path() / asset).string(), "--preset", "paper",
                               "--view", view, "--view-samples", "64", "--rays", "0"});
    return nif(more);
  };
  const std::vector<std::string> primary{"--primary", "--primary-resolution", "64", "--json"};
  const auto with_threads = [&](const std::string& threads) {
    std::vector<std::string> arguments = primary;
    arguments.insert(arguments.end(), {"-j", threads});
    return arguments;
  };
  const Outcome baked = bake("with.nif", with_threads("2"));
  ASSERT_EQ(baked.code, 0) << baked.err;
  const json report = json::parse(baked.out);
  constexpr uint64_t kGrids = 2 * 64 * 64 * 3 * 2, kNetwork = (64 * 6 + 64 * 64 + 64 * 5) * 4;
  EXPECT_EQ(report["bytes"]["primary"], kGrids + kNetwork);
  EXPECT_GT(report["objects"][0]["primary_rays"], 50'000);
  const std::string bytes = read_bytes(folder_.path() / "with.nif");
  ASSERT_EQ(bake("with.nif", with_threads("1")).code, 0);
  EXPECT_EQ(bytes, read_bytes(folder_.path() / "with.nif"));
  ASSERT_EQ(bake("without.nif", {"--quiet"}).code, 0);

  const Outcome info = nif({"info", (folder_.path() / "with.nif").string(), "--json"});
  const json described = json::parse(info.out);
  EXPECT_EQ(described["bytes"]["primary"], kGrids + kNetwork);
  EXPECT_EQ(described["objects"][0]["primary"]["bytes"]["grids"], kGrids);
  EXPECT_EQ(described["objects"][0]["primary"]["resolution"], 64);
  const Outcome lines = nif({"info", (folder_.path() / "with.nif").string()});
  EXPECT_NE(lines.out.find("primary   grids 64 x 64 x 3, " + std::to_string(kGrids) + " bytes"),
            std::string::npos)
      << lines.out;

  const auto render = [&](const std::string& name, const std::string& object, const std::string& threads) {
    const std::string scene =
        folder_.write(name + ".toml", scene_text("mesh = 'ring.obj'\n" + object)).string();
    return nif({"render", scene, "-o", (folder_.path() / name).string(), "--seed", "7", "--json", "--quiet",
                "-j", threads});
  };
  const Outcome outcome = render("fields", "nif = 'with.nif'\nprimary = true\n", "1");
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const json cameras = json::parse(outcome.out)["cameras"];
  for (const auto& [name, camera] : cameras.items()) {
    EXPECT_GT(camera["pictures"]["primary"]["psnr"], 20) << name;
    EXPECT_GT(camera["pictures"]["primary"]["ssim"], 0.5) << name;
    EXPECT_EQ(camera["primary"]["rays"], 64 * 48 * 4) << name;
    // It was trained for seconds only. An untrained one would differ in every hit and, on average, by 90
    // degrees in normals. tests/bake tests how well fields learn.
    const double hits = camera["primary"]["hits"];
    EXPECT_GT(hits, 0.05) << name;
    EXPECT_LT(camera["primary"]["differ"], 0.3 * hits) << name;
    EXPECT_LT(camera["primary"]["depth_error"], 0.02) << name;
    EXPECT_LT(camera["primary"]["normal_error"], 30) << name;
  }
  const std::vector<std::string> pictures = listing(folder_.path() / "fields");
  for (const char* file : {"front-primary.png", "front-normals.png", "side-primary.png", "side-normals.png"})
    EXPECT_NE(std::find(pictures.begin(), pictures.end(), file), pictures.end()) << file;
  ASSERT_EQ(render("two", "nif = 'with.nif'\nprimary = true\n", "2").code, 0);
  for (const std::string& file : pictures)
    EXPECT_EQ(read_bytes(folder_.path() / "fields" / file), read_bytes(folder_.path() / "two" / file))
        << file;

  // The other pictures equal those of an asset without the field, which cannot render these two.
  const Outcome plain = render("plain", "nif = 'without.nif'\n", "2");
  ASSERT_EQ(plain.code, 0) << plain.err;
  EXPECT_FALSE(json::parse(plain.out)["cameras"]["front"].contains("primary"));
  EXPECT_EQ(listing(folder_.path() / "plain").size(), pictures.size() - 4);
  for (const std::string& file : listing(folder_.path() / "plain"))
    EXPECT_EQ(read_bytes(folder_.path() / "fields" / file), read_bytes(folder_.path() / "plain" / file))
        << file;
  const std::string scene =
      folder_.write("none.toml", scene_text("mesh = 'ring.obj'\nnif = 'without.nif'\nprimary = true\n"))
          .string();
  refused({"render", scene, "-o", out_}, Status::malformed_scene, "'primary' is true, but");
}

/// All rays are answered by assets, with a mirror and a bounce.
TEST_F(Render, PicturesByAssetsAlone) {
  bake("bvh");
  const std::string object = "mesh = 'ring.obj'\nnif = 'bvh.nif'\n";
  const std::string scene =
      folder_
          .write("scene.toml", scene_text(object + "mirror = true\n[[object]]\n" + object +
                                          "translate = [0.5, 1, 2]\nrotate = [0, 30, 40]\n"))
          .string();
  const std::string sheet = (folder_.path() / "sheet.png").string();
  const Outcome outcome = nif({"render", scene, "-o", out_, "--primary", "asset", "--bounces", "1", "--json",
                               "--exr", "--quiet", "-j", "1", "--sheet", sheet});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const json result = json::parse(outcome.out);
  EXPECT_EQ(result["primary"], "asset");
  EXPECT_EQ(result["bounces"], 1);
  EXPECT_GT(result["bytes"]["embree"], 2 * 2 * 64 * 32 * 30);
  ASSERT_EQ(result["cameras"].size(), 2u);
  for (const auto& [name, camera] : result["cameras"].items()) {
    ASSERT_EQ(camera["pictures"].size(), 1u) << name;
    const json& errors = camera["pictures"]["asset"];
    EXPECT_TRUE(errors["psnr"].is_null() || errors["psnr"].get<double>() > 45) << name << errors;
    EXPECT_GT(errors["ssim"], 0.999) << name;
    EXPECT_LT(errors["flip"], 0.002) << name;
    EXPECT_EQ(camera["asset"]["rays"], 64 * 48 * 4) << name;
    EXPECT_GT(camera["asset"]["hits"], 0.05) << name;
    EXPECT_LT(camera["asset"]["differ"], 1e-3) << name;
    EXPECT_LT(camera["asset"]["depth_error"], 1e-6) << name;
    EXPECT_FALSE(camera.contains("primary")) << name;
    EXPECT_FALSE(camera.contains("error")) << name;
  }
  std::vector<std::string> files;
  for (const char* camera : {"front", "side"})
    for (const char* file : {"asset.exr", "asset.png", "compare.png", "error.png", "normals.png",
                             "reference.exr", "reference.png"})
      files.push_back(std::string(camera) + "-" + file);
  EXPECT_EQ(listing(out_), files);
  EXPECT_TRUE(fs::exists(sheet));

  const std::string two = (folder_.path() / "two").string();
  const Outcome printed =
      nif({"render", scene, "-o", two, "--primary", "asset", "--bounces", "1", "--exr", "-j", "2"});
  ASSERT_EQ(printed.code, 0) << printed.err;
  EXPECT_NE(printed.out.find("in memory; Embree "), std::string::npos) << printed.out;
  EXPECT_NE(printed.out.find("camera           asset "), std::string::npos) << printed.out;
  for (const std::string& file : files)
    EXPECT_EQ(read_bytes(fs::path(out_) / file), read_bytes(fs::path(two) / file)) << file;
  // The reference picture is the same as in any other run.
  ASSERT_EQ(nif({"render", scene, "-o", two, "--bounces", "1", "--quiet"}).code, 0);
  for (const char* file : {"front-reference.png", "side-reference.png"})
    EXPECT_EQ(read_bytes(fs::path(out_) / file), read_bytes(fs::path(two) / file)) << file;
}

TEST_F(Render, WhatAssetsAloneCannotRender) {
  bake("bvh");
  bake("proof");
  const auto with = [&](const std::string& object, std::vector<std::string> more = {}) {
    const std::string scene =
        folder_.write("scene.toml", scene_text("mesh = 'ring.obj'\n" + object)).string();
    more.insert(more.begin(), {"render", scene, "-o", out_, "--primary", "asset"});
    return more;
  };
  const std::string good = "nif = 'bvh.nif'\n";
  refused(with(good + "[[object]]\nmesh = 'ring.obj'\n"), Status::usage, "object 2 of ");
  refused(with(""), Status::usage, "ring.obj, has no asset; name one with 'nif'");
  refused(with(good + "primary = true\n"), Status::usage, "'primary' of object 1 of ");
  refused(with("nif = 'proof.nif'\n"), Status::usage, "proof.nif has an encoding that does not report where");
  refused(with(good, {"--exact", "inside"}), Status::usage, "--primary asset and --exact");
  refused(with(good, {"--confidence", "0.8"}), Status::usage, "--primary asset and --confidence");
  refused(with("nif = 'none.nif'\n"), Status::file_not_found, "none.nif");
  std::vector<std::string> nonsense = with(good);
  nonsense.back() = "mesh";
  refused(nonsense, Status::usage, "--primary");
  fs::remove(folder_.path() / "ring.obj");
  refused(with(good), Status::file_not_found, "ring.obj");
  folder_.write("ring.obj", obj_text(cube()));
  refused(with(good), Status::mesh_mismatch, "was not baked from");
}

TEST_F(Render, WithoutAssetsOnlyTheReferenceIsRendered) {
  folder_.write("ring.obj", obj_text(torus(32, 16)));
  const std::string scene = folder_.write("scene.toml", scene_text("mesh = 'ring.obj'\n")).string();
  const std::string sheet = (folder_.path() / "sheet.png").string();
  const Outcome outcome = nif(
      {"render", scene, "-o", out_, "--camera", "side", "--width", "32", "--samples", "1", "--sheet", sheet});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("side"), std::string::npos) << outcome.out;
  EXPECT_EQ(outcome.out.find("front"), std::string::npos) << outcome.out;
  EXPECT_EQ(listing(out_), std::vector<std::string>{"side-reference.png"});
  EXPECT_TRUE(fs::exists(sheet));
}

TEST_F(Render, AGlbIsASceneWithItsLightsAndCameras) {
  Gltf gltf = gltf_of(torus(32, 16));
  gltf.camera({{"type", "perspective"}, {"perspective", {{"yfov", 0.7}}}},
              {{"name", "eye/1"}, {"translation", {0, 0, 5}}});
  gltf.camera({{"type", "perspective"}, {"perspective", {{"yfov", 0.7}}}},
              {{"name", "eye/1"}, {"translation", {0, 0, 6}}});
  gltf.light({{"type", "directional"}, {"intensity", 3}});
  const std::string glb = folder_.write("ring.glb", gltf.glb()).string();
  const std::vector<std::string> small{"--width", "32", "--height", "24", "--samples", "1"};
  const auto render = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), small.begin(), small.end());
    return nif(arguments);
  };
  Outcome outcome = render({"render", glb, "-o", out_, "--json"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(without_progress(outcome.err), std::vector<std::string>{});
  EXPECT_EQ(listing(out_), (std::vector<std::string>{"eye_1-reference.png", "eye_12-reference.png"}));
  EXPECT_EQ(json::parse(outcome.out)["cameras"].size(), 2u);
  EXPECT_GT(json::parse(outcome.out)["cameras"]["eye_1"]["shadow_rays"], 0);
  refused({"render", glb, "-o", out_, "--camera", "back"}, Status::usage, "its cameras are eye_1, eye_12");

  // As an object, beside the scene's own camera and lights; one light has an unknown type.
  gltf.light({{"type", "laser"}});
  folder_.write("ring.glb", gltf.glb());
  const std::string scene =
      folder_.write("scene.toml", "[[object]]\nmesh = 'ring.glb'\n[[camera]]\nname = 'own'\n").string();
  const std::string other = (folder_.path() / "other").string();
  outcome = render({"render", scene, "-o", other, "--camera", "own", "eye_1"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(listing(other), (std::vector<std::string>{"eye_1-reference.png", "own-reference.png"}));
  const std::vector<std::string> notes = without_progress(outcome.err);
  ASSERT_EQ(notes.size(), 1u) << outcome.err;
  EXPECT_NE(notes[0].find("nif: note: "), std::string::npos);
  EXPECT_NE(notes[0].find("light 1 of node 4 "), std::string::npos) << notes[0];
  outcome = render({"render", scene, "-o", other, "--quiet"});
  EXPECT_EQ(outcome.code, 0);
  EXPECT_EQ(outcome.err, "");
}

TEST_F(Render, FolderNamedWithASlash) {
  folder_.write("ring.obj", obj_text(torus(32, 16)));
  const std::string scene = folder_.write("scene.toml", scene_text("mesh = 'ring.obj'\n")).string();
  const Outcome outcome = nif({"render", scene, "-o", out_ + "/", "--camera", "side", "--quiet"});
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(listing(out_), std::vector<std::string>{"side-reference.png"});
}

TEST_F(Render, WhatCannotBeRendered) {
  folder_.write("ring.obj", obj_text(torus(32, 16)));
  folder_.write("cube.obj", obj_text(cube()));
  const std::string asset = bake("bvh");
  const auto scene = [&](const std::string& text) { return folder_.write("scene.toml", text).string(); };
  const std::string none = (folder_.path() / "none.toml").string();
  refused({"render", none, "-o", out_}, Status::file_not_found, "none.toml");
  refused({"render", scene("nonsense"), "-o", out_}, Status::malformed_scene, "scene.toml: line 1");
  refused({"render", scene(scene_text("mesh = 'none.obj'\n")), "-o", out_}, Status::file_not_found,
          "none.obj");
  refused({"render", scene(scene_text("mesh = 'ring.obj'\nnif = 'none.nif'\n")), "-o", out_},
          Status::file_not_found, "none.nif");
  refused({"render", scene(scene_text("mesh = 'ring.obj'\nnif = 'ring.obj'\n")), "-o", out_},
          Status::not_a_nif, "ring.obj");
  refused({"render", scene(scene_text("mesh = 'cube.obj'\nnif = 'bvh.nif'\n")), "-o", out_},
          Status::mesh_mismatch, "was not baked from");
  refused({"render", scene(scene_text("mesh = 'ring.obj'\n") + "[[light]]\ntype = 'sky'\nmap = 'ring.obj'\n"),
           "-o", out_},
          Status::not_an_image, "ring.obj");
  refused({"render", scene(scene_text("mesh = 'ring.obj'\n") + "[[light]]\ntype = 'sky'\nmap = 'none.exr'\n"),
           "-o", out_},
          Status::file_not_found, "none.exr");
  refused({"render", scene("[[object]]\nmesh = 'ring.obj'\n[[camera]]\n"), "-o", out_},
          Status::malformed_scene, "scene.toml: has no light");
  refused({"render", scene("[[object]]\nmesh = 'ring.obj'\n[[light]]\ntype = 'sky'\n"), "-o", out_},
          Status::malformed_scene, "scene.toml: has no camera");
  refused({"render", (folder_.path() / "none.glb").string(), "-o", out_}, Status::file_not_found, "none.glb");
  refused({"render", folder_.write("false.glb", "nonsense").string(), "-o", out_}, Status::not_a_mesh,
          "false.glb");
  // Embree's test of triangles would overflow, and Debian's build of it would end the process.
  refused({"render", scene(scene_text("mesh = 'ring.obj'\nscale = 1e12\n")), "-o", out_}, Status::too_large,
          "from the origin");
  const std::string good = scene(scene_text("mesh = 'ring.obj'\n"));
  refused({"render", good}, Status::usage, "--output");
  refused({"render", good, "-o", out_, "--camera", "back"}, Status::usage, "its cameras are front, side");
  refused({"render", good, "-o", out_, "--width", "0"}, Status::usage, "--width");
  refused({"render", good, "-o", out_, "--samples", "0"}, Status::usage, "--samples");
  refused({"render", good, "-o", out_, "--isa", "sse99"}, Status::usage, "sse99");
  refused({"render", good, "-o", (folder_.path() / "no" / "out").string()}, Status::output_folder_missing,
          "does not exist");
  refused({"render", good, "-o", (folder_.path() / "ring.obj").string()}, Status::output_not_writable,
          "not a folder");
}

TEST_F(Render, CancelledItEndsAndKeepsWholePictures) {
  folder_.write("ring.obj", obj_text(torus(64, 32)));
  const std::string scene = folder_.write("scene.toml", scene_text("mesh = 'ring.obj'\n")).string();
  Process process(nif_path(),
                  {"render", scene, "-o", out_, "--width", "4096", "--height", "4096", "--samples", "4096"});
  ASSERT_TRUE(process.wait_for_error_text("rendering"));
  process.send(SIGINT);
  const Outcome outcome = process.finish(60);
  EXPECT_EQ(outcome.code, int(Status::interrupted));
  for (const std::string& file : listing(out_)) EXPECT_EQ(file, "front-reference.png");
}

}  // namespace
}  // namespace nif::test
