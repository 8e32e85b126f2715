// Which parts of a glTF block rays, as the program bakes it: files that place nothing, parts chosen by name,
// and notes. nif validate does not warn about them, and commands that compare read the file in the same way.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "formats/base/status.hpp"
#include "tests/cli/program.hpp"
#include "tests/support/gltf.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

using nlohmann::json;

class Shown : public testing::Test {
 protected:
  std::string path(const std::string& name) const { return (folder_.path() / name).string(); }
  std::string write(const std::string& name, const Gltf& gltf) const {
    return folder_.write(name, gltf.glb()).string();
  }
  Outcome bake(const std::string& mesh, const std::string& asset, std::vector<std::string> more = {}) const {
    more.insert(more.begin(), {"bake", mesh, "-o", asset, "--encoding", "bvh", "--rays", "0"});
    return nif(more);
  }
  /// A cube with two nodes, one of them scaled.
  static Gltf two_nodes(const json& scale) {
    Gltf gltf = gltf_of(cube());
    gltf.json["materials"] = {{{"name", "glass"},
                               {"alphaMode", "BLEND"},
                               {"pbrMetallicRoughness", {{"baseColorFactor", {1, 1, 1, 0.1}}}}}};
    gltf.json["nodes"] = {{{"mesh", 0}, {"name", "one"}, {"scale", scale}},
                          {{"mesh", 0}, {"name", "two"}, {"translation", {5, 0, 0}}}};
    gltf.json["scenes"] = {{{"nodes", {0, 1}}}};
    gltf.json["scene"] = 0;
    return gltf;
  }
  /// The same in its own size, of which the left half lets light through.
  static Gltf half_open() {
    Gltf gltf = two_nodes({1, 1, 1});
    gltf.json["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = {1, 1, 1, 1};
    json& primitive = gltf.json["meshes"][0]["primitives"][0];
    primitive["material"] = 0;
    std::vector<float> colors;
    for (const mesh::Float3& corner : cube().positions)
      colors.insert(colors.end(), {1, 1, 1, corner[0] > 0 ? 1.0f : 0.0f});
    primitive["attributes"]["COLOR_0"] = gltf.accessor(raw(colors), 5126, "VEC4", colors.size() / 4);
    return gltf;
  }
  static json info(const std::string& asset) { return json::parse(nif({"info", asset, "--json"}).out); }
  static void expect_clean(const std::string& asset) {
    const Outcome outcome = nif({"validate", asset, "--json"});
    EXPECT_EQ(outcome.code, 0);
    const json file = json::parse(outcome.out).at("files").at(0);
    EXPECT_EQ(file.at("warnings"), 0) << file;
  }

  const TempDir folder_;
};

TEST_F(Shown, AnAssetThatPlacesNothingWorksEverywhere) {
  Gltf gltf = two_nodes({0, 0, 0});
  gltf.json["scenes"][0]["nodes"] = {0};
  const std::string mesh = write("none.glb", gltf), asset = path("none.nif");
  const Outcome baked = bake(mesh, asset);
  ASSERT_EQ(baked.code, 0) << baked.err;
  EXPECT_NE(baked.err.find("leaves no area"), std::string::npos) << baked.err;
  EXPECT_EQ(info(asset)["places_nothing"], true);
  EXPECT_EQ(info(asset)["objects"].size(), 1u);
  EXPECT_EQ(info(asset)["instances"].size(), 0u);
  EXPECT_NE(nif({"info", asset}).out.find("1 object, places nothing"), std::string::npos);
  expect_clean(asset);
  const Outcome eval = nif({"eval", asset, "--mesh", mesh, "--rays", "1000", "--json"});
  EXPECT_EQ(eval.code, 0) << eval.err;
  const Outcome bench = nif({"bench", mesh, "--asset", asset});
  EXPECT_EQ(bench.code, int(Status::malformed_scene));
  EXPECT_NE(bench.err.find("places nothing"), std::string::npos) << bench.err;
  const Outcome attach = nif({"attach", mesh, asset, "-o", path("both.glb")});
  EXPECT_EQ(attach.code, int(Status::usage));
  EXPECT_NE(attach.err.find("places nothing"), std::string::npos) << attach.err;
  const Outcome convert = nif({"mesh", "convert", mesh, "-o", path("none.obj")});
  EXPECT_EQ(convert.code, int(Status::no_triangles));
  EXPECT_NE(convert.err.find("places nothing"), std::string::npos) << convert.err;
  const Outcome strict = bake(mesh, path("strict.nif"), {"--strict"});
  EXPECT_EQ(strict.code, int(Status::needs_repair)) << strict.err;
}

TEST_F(Shown, WhatIsFlattenedIsBakedBesideTheRest) {
  const std::string mesh = write("flat.glb", two_nodes({1, 1, 0})), asset = path("flat.nif");
  ASSERT_EQ(bake(mesh, asset, {"--no-merge"}).code, 0);
  const json described = info(asset);
  EXPECT_EQ(described["places_nothing"], false);
  ASSERT_EQ(described["instances"].size(), 2u);
  ASSERT_EQ(described["objects"].size(), 2u);
  EXPECT_EQ(described["metadata"]["hierarchy"]["instances"], json({0, 1}));
  expect_clean(asset);
  const Outcome eval = nif({"eval", asset, "--mesh", mesh, "--rays", "1000"});
  EXPECT_EQ(eval.code, 0) << eval.err;
}

TEST_F(Shown, WhatIsChosenIsRecordedAndReadAlike) {
  const std::string mesh = write("two.glb", two_nodes({2, 1, 1})), asset = path("two.nif");
  const Outcome baked = bake(mesh, asset, {"--only", "t*", "--only", "on[!e]", "--except", "nobody"});
  EXPECT_EQ(baked.code, int(Status::usage));
  EXPECT_NE(baked.err.find("matches 'on[!e]'"), std::string::npos) << baked.err;
  ASSERT_EQ(bake(mesh, asset, {"--only", "t*"}).code, 0);
  EXPECT_EQ(info(asset)["instances"].size(), 1u);
  EXPECT_EQ(info(asset)["instances"][0]["name"], "two");
  EXPECT_EQ(info(asset)["metadata"]["choice"], json({{"only", {"t*"}}}));
  expect_clean(asset);
  EXPECT_EQ(nif({"eval", asset, "--mesh", mesh, "--rays", "1000"}).code, 0);
  EXPECT_EQ(nif({"attach", mesh, asset, "-o", path("both.glb")}).code, 0);
  EXPECT_EQ(nif({"render", path("both.glb"), "-o", path("pictures"), "--help"}).code, 0);

  // The same for a manifest, which is then up to date, and for a conversion.
  const std::string manifest =
      folder_
          .write("m.toml",
                 "[[asset]]\nmesh = \"two.glb\"\nencoding = \"bvh\"\nrays = 0\nexcept = [\"one\"]\n")
          .string();
  EXPECT_EQ(nif({"bake", "--manifest", manifest}).code, 0);
  const Outcome mixed = nif({"bake", "--manifest", manifest, "--only", "one"});
  EXPECT_EQ(mixed.code, int(Status::usage));
  EXPECT_NE(mixed.err.find("--outputs FILE"), std::string::npos) << mixed.err;
  EXPECT_EQ(nif({"mesh", "convert", mesh, "-o", path("one.glb"), "--except", "two", "--quiet"}).code, 0);
  EXPECT_EQ(json::parse(nif({"mesh", "info", path("one.glb"), "--json"}).out)["meshes"].size(), 1u);
  const std::string scene =
      folder_.write("s.toml", "[[object]]\nmesh = \"two.glb\"\n[[light]]\ntype = \"sky\"\n").string();
  EXPECT_EQ(nif({"mesh", "convert", scene, "-o", path("s.glb"), "--only", "two"}).code, int(Status::usage));
}

TEST_F(Shown, WhatLetsLightThroughIsRecordedAndReadAlike) {
  Gltf gltf = two_nodes({1, 1, 1});
  json& primitives = gltf.json["meshes"][0]["primitives"];
  primitives.push_back(primitives[0]);
  primitives[0]["material"] = 0;
  const std::string mesh = write("glass.glb", gltf), asset = path("glass.nif");
  const Outcome baked = bake(mesh, asset, {"--strict", "--no-merge"});
  ASSERT_EQ(baked.code, 0) << baked.err;
  EXPECT_NE(baked.err.find("12 triangles of 1 material ('glass') let light through, and block nothing."),
            std::string::npos)
      << baked.err;
  EXPECT_EQ(info(asset)["objects"][0]["triangles"], 12);
  EXPECT_EQ(info(asset)["metadata"]["alpha"], json({{"cutoff", 0.5},
                                                    {"blend", "cutoff"},
                                                    {"glass", "ignore"},
                                                    {"materials",
                                                     {{{"name", "glass"},
                                                       {"rule", "blend"},
                                                       {"cutoff", 0.5},
                                                       {"solid", 0},
                                                       {"cut", 0},
                                                       {"clear", 12}}}}}));
  expect_clean(asset);
  EXPECT_EQ(nif({"eval", asset, "--mesh", mesh, "--rays", "1000", "--hits"}).code, 0);
  EXPECT_EQ(nif({"attach", mesh, asset, "-o", path("both.glb")}).code, 0);

  const std::string halved = path("halved.nif");
  ASSERT_EQ(bake(mesh, halved, {"--alpha-resolution", "64"}).code, 0);
  EXPECT_EQ(info(halved)["metadata"]["alpha"]["resolution"], 64);
  expect_clean(halved);
  EXPECT_EQ(nif({"eval", halved, "--mesh", mesh, "--rays", "1000"}).code, 0);

  // The same for a manifest, which is then up to date.
  const std::string manifest =
      folder_
          .write("m.toml",
                 "[[asset]]\nmesh = \"glass.glb\"\nencoding = \"bvh\"\nrays = 0\nblend = \"opaque\"\n")
          .string();
  EXPECT_EQ(nif({"bake", "--manifest", manifest}).code, 0);
  const json solid = info(path("glass.nif"))["metadata"]["alpha"];
  EXPECT_EQ(solid["blend"], "opaque");
  EXPECT_EQ(solid["materials"][0]["solid"], 12);

  const Outcome ignored = bake(mesh, path("strict.nif"), {"--ignore-alpha", "--strict"});
  EXPECT_EQ(ignored.code, int(Status::needs_repair));
  EXPECT_NE(ignored.err.find("'glass'"), std::string::npos) << ignored.err;
  primitives.erase(1);
  const Outcome nothing = bake(write("pane.glb", gltf), path("pane.nif"));
  EXPECT_EQ(nothing.code, int(Status::all_degenerate));
  EXPECT_NE(nothing.err.find("12 triangles of material 'glass', but all of them let light through"),
            std::string::npos)
      << nothing.err;
}

/// Whoever has no alpha pays nothing for it: the same bytes, whether alpha is read or not. (Golden files that are older than
/// holes keep the bits of answers.)
TEST_F(Shown, WhatHasNoAlphaIsBakedAlike) {
  Gltf gltf = half_open();  // vertex colours with alpha, which an opaque material ignores
  gltf.json["materials"][0] = {{"name", "wall"}};
  const std::string mesh = write("wall.glb", gltf), read = path("read.nif"), ignored = path("ignored.nif");
  for (const std::string encoding : {"bvh", "exact", "proof", "segment"}) {
    const auto baked = [&](const std::string& asset, std::vector<std::string> more) {
      more.insert(more.end(), {"--encoding", encoding, "--rays", "0"});
      if (encoding != "bvh") more.insert(more.end(), {"--resolution", "8"});
      if (encoding == "segment") more.insert(more.end(), {"--preset", "fast"});
      more.insert(more.begin(), {"bake", mesh, "-o", asset});
      const Outcome outcome = nif(more);
      EXPECT_EQ(outcome.code, 0) << outcome.err;
      return read_bytes(asset);
    };
    EXPECT_EQ(baked(read, {}), baked(ignored, {"--ignore-alpha"})) << encoding;
    EXPECT_FALSE(info(read)["metadata"].contains("alpha"));
    EXPECT_NE(info(read)["objects"][0]["encoding"], "cutout");
  }
}

TEST_F(Shown, WhatHasHolesIsExactUnlessItIsAskedToBeOtherwise) {
  const std::string mesh = write("half.glb", half_open()), asset = path("half.nif");
  const Outcome baked = bake(mesh, asset, {"--strict", "--no-merge"});
  ASSERT_EQ(baked.code, 0) << baked.err;
  EXPECT_NE(baked.out.find("is cutout: it has holes"), std::string::npos) << baked.out;
  const json about = info(asset);
  EXPECT_EQ(about["objects"][0]["encoding"], "cutout");
  EXPECT_EQ(about["objects"][0]["triangles_with_holes"], 8);
  EXPECT_EQ(about["metadata"]["alpha"]["materials"][0]["cut"], 8);
  EXPECT_NE(nif({"info", asset}).out.find("8 triangles with holes"), std::string::npos);
  expect_clean(asset);
  const Outcome judged = nif({"eval", asset, "--mesh", mesh, "--rays", "5000", "--hits", "--json"});
  ASSERT_EQ(judged.code, 0) << judged.err;
  for (const json& set : json::parse(judged.out)["sets"]) EXPECT_EQ(set["error"], 0) << set;
  EXPECT_EQ(nif({"bench", mesh, "--asset", asset, "--rays", "2000", "--rounds", "1", "--moved", "0"}).code,
            0);
  const Outcome exported = nif({"bench", asset, "--mesh", mesh, "--export", path("race")});
  EXPECT_EQ(exported.code, int(Status::usage));
  EXPECT_NE(exported.err.find("--ignore-alpha"), std::string::npos) << exported.err;
  for (const std::string encoding : {"proof", "segment"}) {
    const Outcome asked = nif({"bake", mesh, "-o", path("asked.nif"), "--encoding", encoding, "--resolution",
                               "12", "--no-merge", "--rays", "0"});
    ASSERT_EQ(asked.code, 0) << asked.err;
    EXPECT_NE(asked.out.find("is " + encoding + ": as requested"), std::string::npos) << asked.out;
    expect_clean(path("asked.nif"));
    const Outcome right = nif({"eval", path("asked.nif"), "--mesh", mesh, "--rays", "5000", "--json"});
    ASSERT_EQ(right.code, 0) << right.err;
    for (const json& set : json::parse(right.out)["sets"]) {
      EXPECT_EQ(set["certain_wrong"], 0) << encoding;
      EXPECT_LT(set["certain"].get<double>(), 1) << encoding;
    }
  }
  const Outcome named = nif({"bake", mesh, "-o", path("named.nif"), "--encoding", "cutout"});
  EXPECT_EQ(named.code, int(Status::usage)) << "it cannot be asked for";
}

/// A scene for pictures: light passes holes, with an asset and without.
TEST_F(Shown, PicturesHaveHolesWithoutAnAsset) {
  const std::string mesh = write("half.glb", half_open());
  ASSERT_EQ(bake(mesh, path("half.nif")).code, 0);
  const std::string rest = "[ground]\n[[light]]\ntype = \"sun\"\ndirection = [0.5, 0.8, 0.6]\n[[camera]]\n";
  const auto picture = [&](const std::string& name, const std::string& object,
                           std::vector<std::string> more) {
    const std::string scene =
        folder_.write(name + ".toml", "[[object]]\nmesh = \"half.glb\"\n" + object + rest).string();
    more.insert(more.begin(),
                {"render", scene, "-o", path(name), "--width", "48", "--height", "32", "--samples", "1"});
    const Outcome rendered = nif(more);
    EXPECT_EQ(rendered.code, 0) << rendered.err;
    return read_bytes(path(name) + "/camera1-reference.png");
  };
  const auto alone = picture("alone", "", {}), baked = picture("baked", "nif = \"half.nif\"\n", {});
  ASSERT_FALSE(alone.empty());
  EXPECT_EQ(alone, baked);
  EXPECT_NE(alone, picture("solid", "", {"--ignore-alpha"}));
}

/// Rays pass holes; distances are told to be without them.
TEST_F(Shown, MeshesAreComparedWithTheirHoles) {
  Gltf solid = half_open();
  solid.json["materials"][0].erase("alphaMode");
  const std::string open = write("half.glb", half_open()), closed = write("solid.glb", solid);
  const auto compare = [](std::vector<std::string> more) {
    more.insert(more.begin(), {"mesh", "compare"});
    more.insert(more.end(), {"--rays", "5000", "--samples", "1000"});
    return nif(more);
  };
  const auto differs = [&](const std::vector<std::string>& more, const char* how) {
    std::vector<std::string> arguments = more;
    arguments.push_back("--json");
    const Outcome compared = compare(arguments);
    EXPECT_EQ(compared.code, 0) << compared.err;
    const json result = json::parse(compared.out);
    return result["sets"]["outer-lines"][how].get<double>();
  };
  EXPECT_GT(differs({closed, open}, "opened"), 0.05);
  EXPECT_EQ(differs({closed, open}, "closed"), 0);
  EXPECT_GT(differs({open, closed}, "closed"), 0.05);
  EXPECT_EQ(differs({open, open}, "difference"), 0);
  EXPECT_EQ(differs({closed, open, "--ignore-alpha"}, "difference"), 0);
  const std::string said = compare({closed, open}).out, whole = "as if they had no holes";
  EXPECT_NE(said.find("half.glb: 24 triangles, 16 with holes\n"), std::string::npos) << said;
  EXPECT_NE(said.find("solid.glb: 24 triangles\n"), std::string::npos) << said;
  EXPECT_NE(said.find(whole), std::string::npos) << said;
  EXPECT_EQ(compare({closed, closed}).out.find(whole), std::string::npos);
}

TEST_F(Shown, SeveralInstancesOfANodeAreAttachedAsOne) {
  Gltf gltf = two_nodes({1, 1, 1});
  const int places = gltf.positions({{0, 0, 0}, {5, 0, 0}, {0, 7, 0}});
  gltf.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]["TRANSLATION"] = places;
  const std::string mesh = write("many.glb", gltf), asset = path("many.nif");
  ASSERT_EQ(bake(mesh, asset).code, 0);
  EXPECT_EQ(info(asset)["instances"].size(), 4u);
  expect_clean(asset);
  const Outcome attached = nif({"attach", mesh, asset, "-o", path("both.glb"), "--json"});
  ASSERT_EQ(attached.code, 0) << attached.err;
}

}  // namespace
}  // namespace nif::test
