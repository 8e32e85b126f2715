// Base colours: read from files, averaged over voxels, and found again where rays hit.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <memory>

#include "bake/colors.hpp"
#include "formats/mesh/flat_scene.hpp"
#include "formats/mesh/read.hpp"
#include "formats/nif/writer.hpp"
#include "kernels/reference/planes/voxel_colors.hpp"
#include "nif/nif.hpp"
#include "tests/bake/quiet_bake.hpp"
#include "tests/support/gltf.hpp"
#include "tests/support/pictures.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/support/test_random.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

using Color = std::array<float, 3>;
using Pixel = std::array<uint8_t, 3>;

constexpr Pixel kRed{255, 0, 0}, kBlue{0, 0, 255};

mesh::ReadLimits with_colors() {
  mesh::ReadLimits limits;
  limits.colors = true;
  return limits;
}

bake::BakeOptions options_for(const char* encoding) {
  bake::BakeOptions options;
  options.encoding = encoding;
  options.evaluation_rays = 0;
  options.colors = true;
  options.preset = bake::Preset::fast;
  options.resolution = 20;
  options.effort = 0.01;
  return options;
}

/// The left half red, the right one blue.
std::string two_halves(int side) {
  std::vector<Pixel> pixels;
  for (int i = 0; i < side * side; ++i) pixels.push_back(i % side < side / 2 ? kRed : kBlue);
  return png(uint32_t(side), uint32_t(side), pixels);
}

/// A square with a picture from x = 0 to 1, and one with a factor from x = 2 to 3.
Gltf two_squares(const std::string& picture) {
  Gltf gltf;
  const auto square = [&](float x) {
    return gltf.positions({{x, 0, 0}, {x + 1, 0, 0}, {x + 1, 1, 0}, {x, 1, 0}});
  };
  const int mesh = gltf.mesh(square(0), gltf.indices({0, 1, 2, 0, 2, 3}), "squares");
  nlohmann::json& primitives = gltf.json["meshes"][size_t(mesh)]["primitives"];
  const std::vector<float> places{0, 0, 1, 0, 1, 1, 0, 1};
  primitives[0]["attributes"]["TEXCOORD_0"] = gltf.accessor(raw(places), 5126, "VEC2", 4);
  primitives[0]["material"] = 0;
  primitives.push_back({{"attributes", {{"POSITION", square(2)}}},
                        {"indices", gltf.indices({0, 1, 2, 0, 2, 3})},
                        {"material", 1}});
  gltf.json["images"] = {{{"bufferView", gltf.view(picture)}, {"mimeType", "image/png"}}};
  gltf.json["samplers"] = {{{"wrapS", 33071}, {"wrapT", 33071}}};
  gltf.json["textures"] = {{{"source", 0}, {"sampler", 0}}};
  gltf.json["materials"] = {{{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}},
                            {{"pbrMetallicRoughness", {{"baseColorFactor", {0.25, 0.5, 1, 1}}}}}};
  gltf.scene({gltf.node({{"mesh", mesh}})});
  return gltf;
}

/// The colour where a ray from (x, y, 5) along -z hits; hit 0 gives black.
class Colors {
 public:
  explicit Colors(const bake::BakeResult& result) : device_("threads=1"), scene_(device_) {
    scene_.add_asset(nifkit::Asset::load(device_, format::encode(result.asset)));
    scene_.commit();
  }
  Color at(float x, float y) const {
    const NifRay ray{{x, y, 5}, 0, {0, 0, -1}, std::numeric_limits<float>::infinity()};
    Color color;
    NifHits hits{};
    hits.struct_size = sizeof(hits);
    hits.color = color.data();
    const NifRays query = nifMakeRays(&ray, 1);
    nifkit::check(nifIntersect(scene_.get(), &query, &hits));
    return color;
  }

 private:
  nifkit::Device device_;
  nifkit::Scene scene_;
};

/// Within the error of storing the square root in 5 and 6 bits.
void expect_near(const Color& seen, const Color& expected, const char* what, float more = 0) {
  for (size_t c = 0; c < 3; ++c) {
    const float steps = c == 1 ? 63 : 31;
    EXPECT_NEAR(std::sqrt(seen[c]), std::sqrt(expected[c]), 0.501f / steps + more) << what << ", " << c;
  }
}

TEST(Colors, OfPicturesAndFactors) {
  const mesh::Scene scene = mesh::read("squares.glb", two_squares(two_halves(64)).glb(), with_colors());
  EXPECT_TRUE(scene.notes.empty());
  ASSERT_EQ(scene.meshes.size(), 1u);
  EXPECT_EQ(scene.meshes[0].look.materials, (std::vector<uint32_t>{1, 1, 4, 4}));
  for (const char* encoding : {"exact", "proof", "segment"}) {
    SCOPED_TRACE(encoding);
    const bake::BakeResult result = bake_quietly(scene, options_for(encoding));
    ASSERT_TRUE(result.asset.objects[0].colors.has_value());
    EXPECT_NE(result.asset.metadata.find(R"("colors":true)"), std::string::npos);
    if (encoding == std::string("segment")) continue;  // untrained: it may miss
    const Colors colors(result);
    for (const float y : {0.1f, 0.5f, 0.9f}) {
      expect_near(colors.at(0.2f, y), {1, 0, 0}, "left");
      expect_near(colors.at(0.8f, y), {0, 0, 1}, "right");
      expect_near(colors.at(2.5f, y), {0.25f, 0.5f, 1}, "factor");
    }
    EXPECT_EQ(colors.at(1.5f, 0.5f), (Color{0, 0, 0})) << "no hit";
  }
}

/// If colours are not read, nothing of them is there, and the mesh is the same.
TEST(Colors, AreReadOnlyIfAskedFor) {
  const std::string glb = two_squares(two_halves(8)).glb();
  const mesh::Scene plain = mesh::read("squares.glb", glb),
                    coloured = mesh::read("squares.glb", glb, with_colors());
  EXPECT_FALSE(plain.meshes[0].look.known());
  EXPECT_TRUE(plain.materials.empty());
  EXPECT_EQ(plain.meshes[0].positions, coloured.meshes[0].positions);
  EXPECT_EQ(plain.meshes[0].triangles, coloured.meshes[0].triangles);
  EXPECT_EQ(plain.source_hash, coloured.source_hash);
  bake::BakeOptions options = options_for("exact");
  const bake::BakeResult none = bake_quietly(plain, options);
  EXPECT_FALSE(none.asset.objects[0].colors.has_value());
  options.colors = false;
  EXPECT_EQ(format::encode(none.asset), format::encode(bake_quietly(coloured, options).asset));
}

/// Red and blue stripes, of which the blue ones are holes: voxels are red, except where everything is solid.
TEST(Colors, AreThoseOfWhatBlocks) {
  constexpr uint32_t kSide = 64, kStripe = 4;
  std::vector<Pixel> pixels;
  mesh::AlphaMap map{kSide, kSide, {mesh::Wrap::clamp, mesh::Wrap::clamp}, {}};
  map.tiles.resize(size_t(map.tiles_of_row()) * map.tiles_of_row());
  for (uint32_t y = 0; y < kSide; ++y)
    for (uint32_t x = 0; x < kSide; ++x) {
      const bool red = x / kStripe % 2 == 0;
      pixels.push_back(red ? kRed : kBlue);
      if (red) map.tiles[y / 8 * map.tiles_of_row() + x / 8] |= uint64_t{1} << (x % 8 + 8 * (y % 8));
    }
  mesh::Scene scene = mesh::read("squares.glb", two_squares(png(kSide, kSide, pixels)).glb(), with_colors());
  const Color solid = Colors(bake_quietly(scene, options_for("proof"))).at(0.5f, 0.5f);
  EXPECT_NEAR(solid[0], 0.5, 0.25) << "few samples, many stripes";
  EXPECT_NEAR(solid[2], 0.5, 0.25);

  mesh::Mesh& mesh = scene.meshes[0];
  mesh.alpha.assign(mesh.triangles.size(), mesh::TriangleAlpha::solid);
  mesh.holes.resize(mesh.triangles.size());
  constexpr int32_t kEnd = kSide << mesh::TriangleHoles::kFraction;
  const auto give_holes = [&](const std::vector<uint64_t>& tiles) {
    map.tiles = tiles;
    mesh.alpha_maps = {std::make_shared<const mesh::AlphaMap>(map)};
    mesh.alpha[0] = mesh.alpha[1] = mesh::TriangleAlpha::cut;
    mesh.holes[0] = {0, 0, {{{0, 0}, {kEnd, 0}, {kEnd, kEnd}}}};
    mesh.holes[1] = {0, 0, {{{0, 0}, {kEnd, kEnd}, {0, kEnd}}}};
    return bake_quietly(scene, options_for("proof"));
  };
  const Colors pierced(give_holes(map.tiles));
  for (const float x : {0.2f, 0.5f, 0.8f}) {
    const Color seen = pierced.at(x, 0.5f);
    EXPECT_GT(seen[0], 0.85f) << x;  // colours are interpolated between stripes, so a little blue stays
    EXPECT_LT(seen[2], 0.15f) << x;
  }
  expect_near(pierced.at(2.5f, 0.5f), {0.25f, 0.5f, 1}, "without holes");
  // Where nothing blocks, a voxel has the colour of everything.
  const Color clear = Colors(give_holes(std::vector<uint64_t>(map.tiles.size()))).at(0.5f, 0.5f);
  EXPECT_NEAR(clear[0], 0.5, 0.15);
  EXPECT_NEAR(clear[2], 0.5, 0.15);
}

/// KHR_texture_transform with a second set of texture coordinates.
TEST(Colors, FollowTheTransformOfATexture) {
  Gltf gltf = two_squares(two_halves(64));
  nlohmann::json& info = gltf.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"];
  info["extensions"]["KHR_texture_transform"] = {{"offset", {0.5, 0}}, {"scale", {0.5, 1}}};
  const Colors moved(bake_quietly(mesh::read("a.glb", gltf.glb(), with_colors()), options_for("exact")));
  expect_near(moved.at(0.2f, 0.5f), {0, 0, 1}, "all of it is the right half");
  expect_near(moved.at(0.8f, 0.5f), {0, 0, 1}, "all of it is the right half");
  info = {{"index", 0}, {"texCoord", 1}};
  nlohmann::json& attributes = gltf.json["meshes"][0]["primitives"][0]["attributes"];
  attributes["TEXCOORD_1"] = gltf.accessor(raw(std::vector<float>{1, 0, 0, 0, 0, 1, 1, 1}), 5126, "VEC2", 4);
  const Colors mirrored(bake_quietly(mesh::read("a.glb", gltf.glb(), with_colors()), options_for("exact")));
  expect_near(mirrored.at(0.2f, 0.5f), {0, 0, 1}, "mirrored");
  expect_near(mirrored.at(0.8f, 0.5f), {1, 0, 0}, "mirrored");
}

/// KHR_materials_pbrSpecularGlossiness has the colour of such a material; the other one is for readers that do not know it.
TEST(Colors, OfSpecularGlossiness) {
  Gltf gltf = two_squares(two_halves(8));
  nlohmann::json& materials = gltf.json["materials"];
  materials[0]["extensions"]["KHR_materials_pbrSpecularGlossiness"] = {{"diffuseFactor", {0.5, 0.25, 1, 1}}};
  materials[1]["extensions"]["KHR_materials_pbrSpecularGlossiness"] = {{"diffuseTexture", {{"index", 0}}}};
  const mesh::Scene scene = mesh::read("a.glb", gltf.glb(), with_colors());
  EXPECT_TRUE(scene.notes.empty());
  ASSERT_EQ(scene.materials.size(), 5u);
  EXPECT_EQ(scene.materials[1].factor, (std::array{0.5f, 0.25f, 1.0f}));
  EXPECT_EQ(scene.materials[1].texture, mesh::kNoTexture);
  EXPECT_EQ(scene.materials[3].factor, (std::array{1.0f, 1.0f, 1.0f}));
  EXPECT_EQ(scene.materials[3].texture, 0u);
}

/// A missing picture only causes a note.
TEST(Colors, OfPicturesThatCannotBeRead) {
  const std::string picture = two_halves(8);
  for (const auto& [bytes, why] : {std::pair(png_that_claims(18432, 18432, ""), "more than the limit"),
                                   {picture.substr(0, picture.size() / 2), "cannot be decoded"},
                                   {std::string("no picture"), "is neither PNG nor JPEG"}}) {
    SCOPED_TRACE(why);
    const mesh::Scene scene = mesh::read("a.glb", two_squares(bytes).glb(), with_colors());
    ASSERT_EQ(scene.notes.size(), 1u);
    EXPECT_NE(scene.notes[0].text.find(why), std::string::npos) << scene.notes[0].text;
    EXPECT_TRUE(scene.textures.empty());
    const Colors colors(bake_quietly(scene, options_for("exact")));
    expect_near(colors.at(0.5f, 0.5f), {1, 1, 1}, "the factor alone");
  }
}

/// For any bytes, reading yields a picture or a note.
TEST(Colors, OfDamagedPictures) {
  const std::string picture = two_halves(16);
  Random random(3);
  for (int i = 0; i < 300; ++i) {
    std::string damaged = picture;
    for (uint32_t n = 1 + random.below(4); n > 0; --n)
      damaged[random.below(uint32_t(damaged.size()))] = char(random.below(256));
    if (random.below(4) == 0) damaged.resize(random.below(uint32_t(damaged.size())));
    const mesh::Scene scene = mesh::read("a.glb", two_squares(damaged).glb(), with_colors());
    EXPECT_EQ(scene.textures.size() + scene.notes.size(), 1u);
  }
}

TEST(Colors, OfPicturesBesideTheFile) {
  TempDir folder;
  Gltf gltf = two_squares("");
  gltf.json["images"] = {{{"uri", "a%20b.png"}}};
  folder.write("a b.png", two_halves(32));
  const auto file = folder.write("squares.glb", gltf.glb());
  const mesh::Scene scene = mesh::read(file, with_colors());
  EXPECT_TRUE(scene.notes.empty());
  ASSERT_EQ(scene.files.size(), 2u);
  EXPECT_TRUE(scene.files[1].ends_with("a b.png"));
  EXPECT_EQ(scene.textures.size(), 1u);
  for (const char* uri : {"http://a.b/c.png", "missing.png", "data:image/png;base64,@@"}) {
    gltf.json["images"] = {{{"uri", uri}}};
    const mesh::Scene other = mesh::read(folder.write("squares.glb", gltf.glb()), with_colors());
    EXPECT_EQ(other.notes.size(), 1u) << uri;
    EXPECT_TRUE(other.textures.empty());
  }
}

/// A ball with a colour at each vertex, as sRGB bytes.
struct PaintedBall {
  mesh::Mesh mesh = icosphere(4);
  std::vector<Pixel> paint;

  PaintedBall() {
    for (const mesh::Float3& p : mesh.positions)
      paint.push_back({uint8_t(127.5f + 127.5f * p[0]), uint8_t(127.5f + 127.5f * p[1]),
                       p[2] > 0 ? uint8_t(200) : uint8_t(30)});
  }
  std::string ply(bool binary) const {
    std::string text = std::string("ply\nformat ") + (binary ? "binary_little_endian" : "ascii") + " 1.0\n";
    text += "element vertex " + std::to_string(mesh.positions.size()) +
            "\nproperty float x\nproperty float y\nproperty float z\n"
            "property uchar red\nproperty uchar green\nproperty uchar blue\n";
    text += "element face " + std::to_string(mesh.triangles.size()) +
            "\nproperty list uchar int vertex_indices\nend_header\n";
    for (size_t i = 0; i < mesh.positions.size(); ++i) {
      if (binary) {
        text += raw(std::vector<float>(mesh.positions[i].begin(), mesh.positions[i].end()));
        text += raw(std::vector<uint8_t>(paint[i].begin(), paint[i].end()));
        continue;
      }
      char line[200];
      std::snprintf(line, sizeof(line), "%.9g %.9g %.9g %d %d %d\n", double(mesh.positions[i][0]),
                    double(mesh.positions[i][1]), double(mesh.positions[i][2]), paint[i][0], paint[i][1],
                    paint[i][2]);
      text += line;
    }
    for (const mesh::Triangle& t : mesh.triangles) {
      if (binary)
        text += char(3) + raw(std::vector<uint32_t>(t.begin(), t.end()));
      else
        text += "3 " + std::to_string(t[0]) + " " + std::to_string(t[1]) + " " + std::to_string(t[2]) + "\n";
    }
    return text;
  }
  std::string obj() const {
    std::string text;
    for (size_t i = 0; i < mesh.positions.size(); ++i) {
      char line[200];
      std::snprintf(line, sizeof(line), "v %.9g %.9g %.9g %.9g %.9g %.9g\n", double(mesh.positions[i][0]),
                    double(mesh.positions[i][1]), double(mesh.positions[i][2]), paint[i][0] / 255.0,
                    paint[i][1] / 255.0, paint[i][2] / 255.0);
      text += line;
    }
    for (const mesh::Triangle& t : mesh.triangles)
      text += "f " + std::to_string(t[0] + 1) + " " + std::to_string(t[1] + 1) + " " +
              std::to_string(t[2] + 1) + "\n";
    return text;
  }
};

/// The mean over each voxel equals that of many points spread evenly over the surface.
TEST(Colors, AreTheMeanOverAVoxel) {
  const PaintedBall ball;
  const mesh::Scene scene = mesh::read("ball.ply", ball.ply(true), with_colors());
  const std::vector<Color>& painted = scene.meshes[0].look.colors;
  ASSERT_EQ(painted.size(), ball.paint.size());
  for (size_t i = 0; i < painted.size(); ++i)
    for (size_t c = 0; c < 3; ++c)
      ASSERT_NEAR(painted[i][c], mesh::linear_of(ball.paint[i][c] / 255.0), 1e-6);
  for (const auto& [name, text] : {std::pair("ball.ply", ball.ply(false)), {"ball.obj", ball.obj()}}) {
    const mesh::Scene other = mesh::read(name, text, with_colors());
    ASSERT_EQ(other.meshes[0].look.colors.size(), painted.size()) << name;
    for (size_t i = 0; i < painted.size(); ++i)
      for (size_t c = 0; c < 3; ++c)
        ASSERT_NEAR(other.meshes[0].look.colors[i][c], painted[i][c], 1e-5) << name;
  }

  const bake::BakeResult result = bake_quietly(scene, options_for("exact"));
  const kernels::PlanesField field = format::field_of(*result.asset.objects[0].planes);
  const format::Colors& colors = *result.asset.objects[0].colors;
  ASSERT_EQ(colors.size(), field.surface_voxels);
  std::vector<Color> sums(colors.size());
  std::vector<double> counts(colors.size());
  Random random(1);
  std::vector<double> areas{0};
  const mesh::Mesh& mesh = scene.meshes[0];
  const auto corner = [&](const mesh::Triangle& t, size_t k) { return to_double(mesh.positions[t[k]]); };
  for (const mesh::Triangle& t : mesh.triangles)
    areas.push_back(areas.back() + length(cross(corner(t, 1) - corner(t, 0), corner(t, 2) - corner(t, 0))));
  for (int i = 0; i < 400'000; ++i) {
    const double at = double(random.unit()) * areas.back();
    const size_t triangle =
        std::min(size_t(std::upper_bound(areas.begin(), areas.end(), at) - areas.begin()) - 1,
                 mesh.triangles.size() - 1);
    const mesh::Triangle& t = mesh.triangles[triangle];
    double u = double(random.unit()), v = double(random.unit());
    if (u + v > 1) u = 1 - u, v = 1 - v;
    const double weights[3] = {1 - u - v, u, v};
    Double3 point{};
    Double3 color{};
    for (size_t k = 0; k < 3; ++k) {
      point = point + corner(t, k) * weights[k];
      color = color + to_double(painted[t[k]]) * weights[k];
    }
    int32_t voxel[3];
    for (size_t a = 0; a < 3; ++a)
      voxel[a] = int32_t(std::floor((point[a] - double(field.origin[a])) * double(field.voxels_per_unit)));
    uint32_t index = 0;
    ASSERT_TRUE(kernels::surface_voxel(field, voxel, index));
    for (size_t c = 0; c < 3; ++c) sums[index][c] += float(color[c]);
    ++counts[index];
  }
  size_t compared = 0;
  for (size_t i = 0; i < colors.size(); ++i) {
    if (counts[i] < 200) continue;  // a corner of the surface
    ++compared;
    float seen[3];
    kernels::unpack_color(colors[i], seen);
    expect_near(std::to_array(seen),
                {float(sums[i][0] / counts[i]), float(sums[i][1] / counts[i]), float(sums[i][2] / counts[i])},
                "mean", 0.03f);
  }
  EXPECT_GT(compared, 500u);
}

/// Meshes that differ only in colour become separate objects; equal ones are baked once.
TEST(Colors, TellMeshesApart) {
  mesh::Scene scene = scene_of({icosphere(2), icosphere(2), icosphere(2)});
  for (mesh::Mesh& mesh : scene.meshes) mesh.look.colors.assign(mesh.positions.size(), {1, 0, 0});
  for (Color& color : scene.meshes[2].look.colors) color = {0, 0, 1};
  EXPECT_EQ(bake_quietly(scene, options_for("exact")).asset.objects.size(), 2u);
  // One object has colours and the other has none.
  scene.meshes[2].look = {};
  const bake::BakeResult result = bake_quietly(scene, options_for("exact"));
  ASSERT_EQ(result.asset.objects.size(), 2u);
  EXPECT_TRUE(result.asset.objects[0].colors.has_value());
  EXPECT_FALSE(result.asset.objects[1].colors.has_value());
}

TEST(Colors, GoWithMeshesThatAreFlattened) {
  mesh::Scene scene = scene_of({icosphere(1), cube()});
  scene.materials = {{}, {{0.5f, 0.25f, 1}}};
  scene.meshes[1].look.materials.assign(scene.meshes[1].triangles.size(), 1);
  scene.instances[1].transform[3] = 4;
  const mesh::Mesh flat = mesh::flatten(scene, "both");
  ASSERT_EQ(flat.look.materials.size(), flat.triangles.size());
  EXPECT_EQ(flat.look.materials.front(), 0u);
  EXPECT_EQ(flat.look.materials.back(), 1u);
  scene.meshes = {flat};
  scene.instances.resize(1);
  const Colors colors(bake_quietly(scene, options_for("exact")));
  expect_near(colors.at(0, 0), {1, 1, 1}, "white, as it has no material");
  expect_near(colors.at(4, 0), {0.5f, 0.25f, 1}, "cube");
}

/// Small objects, which "auto" would otherwise bake as `bvh`, and objects for which `exact` would drop its
/// planes.
TEST(Colors, KeepObjectsFromBecomingABvh) {
  mesh::Scene scene = scene_of({icosphere(2)});
  bake::BakeOptions options = options_for("auto");
  options.resolution.reset();
  options.max_error = 0;
  EXPECT_FALSE(bake_quietly(scene, options).asset.objects[0].planes) << "no colours to keep";
  scene.meshes[0].look.colors.assign(scene.meshes[0].positions.size(), {1, 0, 0});
  const bake::BakeResult result = bake_quietly(scene, options);
  EXPECT_TRUE(result.asset.objects[0].planes && result.asset.objects[0].triangles);
  EXPECT_TRUE(result.asset.objects[0].colors.has_value());
}

/// Objects without colours return the grey that nif.h specifies.
TEST(Colors, AreGreyWhereThereAreNone) {
  bake::BakeOptions options = options_for("bvh");
  options.resolution.reset();
  options.colors = false;
  EXPECT_EQ(Colors(bake_quietly(scene_of({icosphere(2)}), options)).at(0, 0), (Color{0.5f, 0.5f, 0.5f}));
}

}  // namespace
}  // namespace nif::test
