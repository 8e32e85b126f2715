// Which triangles of a glTF let light through: every rule of materials, pictures, and what meshes keep of it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "formats/mesh/clean.hpp"
#include "formats/mesh/flat_scene.hpp"
#include "formats/mesh/read.hpp"
#include "tests/support/gltf.hpp"
#include "tests/support/pictures.hpp"

namespace nif::test {
namespace {

using mesh::AlphaOptions;
using mesh::NoteKind;
using mesh::Scene;
using mesh::TriangleAlpha;
using nlohmann::json;
using Alphas = std::vector<TriangleAlpha>;

constexpr TriangleAlpha kSolid = TriangleAlpha::solid, kCut = TriangleAlpha::cut,
                        kClear = TriangleAlpha::clear;

/// Triangles, all of one material. Triangle k has its corners at texture coordinates around the middle of column k of
/// a picture of `columns`.
Gltf strip(size_t count, size_t columns, const json& material) {
  Gltf gltf;
  std::vector<mesh::Float3> positions;
  std::vector<float> places;
  for (size_t k = 0; k < count; ++k)
    for (size_t corner = 0; corner < 3; ++corner) {
      positions.push_back({float(k) + (corner == 1 ? 0.5f : 0.0f), corner == 2 ? 1.0f : 0.0f, 0});
      places.push_back((float(k) + (corner == 1 ? 0.7f : 0.3f)) / float(columns));
      places.push_back(corner == 2 ? 0.9f : 0.1f);
    }
  const int accessor = gltf.positions(positions);
  const int coordinates = gltf.accessor(raw(places), 5126, "VEC2", positions.size());
  gltf.mesh(accessor, -1, "strip");
  json& primitive = gltf.json["meshes"][0]["primitives"][0];
  primitive["attributes"]["TEXCOORD_0"] = coordinates;
  primitive["material"] = 0;
  gltf.json["materials"] = {material};
  gltf.scene({gltf.node({{"mesh", 0}})});
  return gltf;
}

/// A material with the only picture of its file.
json pictured(json material) {
  material["pbrMetallicRoughness"]["baseColorTexture"] = {{"index", 0}};
  return material;
}

/// A PNG of one row whose texels have these alphas.
std::string row_of(const std::vector<uint8_t>& alphas) {
  std::vector<std::array<uint8_t, 4>> pixels;
  for (const uint8_t alpha : alphas) pixels.push_back({255, 255, 255, alpha});
  return png(uint32_t(alphas.size()), 1, pixels);
}

void give_picture(Gltf& gltf, const std::string& picture) {
  gltf.json["images"] = {{{"bufferView", gltf.view(picture)}, {"mimeType", "image/png"}}};
  gltf.json["textures"] = {{{"source", 0}}};
}

Scene read(const Gltf& gltf, AlphaOptions alpha = {}) {
  alpha.read = true;
  mesh::ReadLimits limits;
  limits.alpha = alpha;
  return mesh::read("a.glb", gltf.glb(), limits);
}

/// What a strip of triangles over these texels becomes.
Alphas strip_of(const std::vector<uint8_t>& texels, const json& material, const AlphaOptions& options = {}) {
  Gltf gltf = strip(texels.size(), texels.size(), pictured(material));
  give_picture(gltf, row_of(texels));
  return read(gltf, options).meshes[0].alpha;
}

/// What a triangle becomes whose material has no picture.
TriangleAlpha one_of(const json& material, const AlphaOptions& options = {}) {
  const Alphas alpha = read(strip(1, 1, material), options).meshes[0].alpha;
  return alpha.empty() ? kSolid : alpha[0];
}

json factor(double alpha) { return {{"baseColorFactor", {1, 1, 1, alpha}}}; }

TEST(GltfAlpha, RulesOfMaterials) {
  const json mask{{"alphaMode", "MASK"}}, blend{{"alphaMode", "BLEND"}};
  EXPECT_EQ(strip_of({0, 127, 128, 255}, mask), (Alphas{kClear, kClear, kSolid, kSolid}));
  EXPECT_EQ(strip_of({0, 127, 128, 255}, blend), (Alphas{kClear, kClear, kSolid, kSolid}));
  EXPECT_EQ(strip_of({0, 127, 128, 255}, {{"name", "wall"}}), Alphas()) << "OPAQUE";
  json low = mask;
  low["alphaCutoff"] = 0.1;
  EXPECT_EQ(strip_of({25, 26}, low), (Alphas{kClear, kSolid}));
  low["alphaCutoff"] = 0;
  EXPECT_EQ(strip_of({0, 255}, low), Alphas()) << "nothing is below 0";
  low["alphaCutoff"] = 1.5;
  EXPECT_EQ(strip_of({0, 255}, low), (Alphas{kClear, kClear}));
  low["alphaCutoff"] = double(0.2f);
  EXPECT_EQ(strip_of({50, 51}, low), (Alphas{kClear, kSolid})) << "51 / 255 is 0.2, as a float, too";
  json half = mask;
  half["pbrMetallicRoughness"] = factor(0.6);
  EXPECT_EQ(strip_of({212, 213}, half), (Alphas{kClear, kSolid})) << "0.6 times 213 / 255 is 0.501";
  half["pbrMetallicRoughness"] = factor(0);
  EXPECT_EQ(strip_of({255}, half), Alphas{kClear});

  EXPECT_EQ(one_of({{"alphaMode", "MASK"}, {"pbrMetallicRoughness", factor(0.4)}}), kClear);
  EXPECT_EQ(one_of({{"alphaMode", "MASK"}, {"pbrMetallicRoughness", factor(0.5)}}), kSolid);
  EXPECT_EQ(one_of({{"pbrMetallicRoughness", factor(0)}}), kSolid) << "OPAQUE";
  EXPECT_EQ(one_of({{"alphaMode", "BLEND"}}), kSolid);
  const json glass{{"extensions", {{"KHR_materials_transmission", {{"transmissionFactor", 0.9}}}}}};
  EXPECT_EQ(one_of(glass), kClear);
  EXPECT_EQ(one_of(glass, {.opaque_glass = true}), kSolid);
}

TEST(GltfAlpha, OptionsForMaterialsThatBlend) {
  using Blend = AlphaOptions::Blend;
  const json mask{{"alphaMode", "MASK"}}, blend{{"alphaMode", "BLEND"}};
  EXPECT_EQ(strip_of({76, 77}, blend, {.cutoff = 0.3}), (Alphas{kClear, kSolid}));
  EXPECT_EQ(strip_of({76, 77}, mask, {.cutoff = 0.3}), (Alphas{kClear, kClear})) << "has its own";
  EXPECT_EQ(strip_of({0, 255}, blend, {.blend = Blend::opaque}), Alphas());
  EXPECT_EQ(strip_of({0, 255}, blend, {.blend = Blend::ignore}), (Alphas{kClear, kClear}));
  EXPECT_EQ(strip_of({0, 255}, mask, {.blend = Blend::ignore}), (Alphas{kClear, kSolid}));
}

TEST(GltfAlpha, TrianglesOverBothKindsOfTexelsAreCut) {
  Gltf gltf = strip(2, 1, pictured({{"name", "leaf"}, {"alphaMode", "MASK"}}));
  give_picture(gltf, row_of({0, 255, 0, 255}));
  const Scene scene = read(gltf);
  EXPECT_EQ(scene.meshes[0].alpha, (Alphas{kCut, kCut}));
  ASSERT_EQ(scene.see_through.size(), 1u);
  EXPECT_EQ(scene.see_through[0].name, "leaf");
  EXPECT_EQ(scene.see_through[0].cut, 2u);
  ASSERT_EQ(scene.notes.size(), 1u);
  EXPECT_EQ(scene.notes[0].kind, NoteKind::see_through);
  EXPECT_EQ(
      scene.notes[0].text,
      "a.glb: 2 triangles of 1 material ('leaf') have holes, which are filled: they block as if solid.");
}

TEST(GltfAlpha, PlacesInPictures) {
  const json mask{{"alphaMode", "MASK"}};
  // Triangle k of four is over texel k, as far as nothing moves it.
  const auto moved = [&](const json& info, const json& sampler = {}) {
    Gltf gltf = strip(4, 4, pictured(mask));
    give_picture(gltf, row_of({0, 255, 255, 255}));
    gltf.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"].update(info);
    if (!sampler.is_null()) {
      gltf.json["samplers"] = {sampler};
      gltf.json["textures"][0]["sampler"] = 0;
    }
    return read(gltf).meshes[0].alpha;
  };
  const auto by = [](double u) {
    return json{{"extensions", {{"KHR_texture_transform", {{"offset", {u, 0}}}}}}};
  };
  EXPECT_EQ(moved(json::object()), (Alphas{kClear, kSolid, kSolid, kSolid}));
  EXPECT_EQ(moved(by(0.25)), (Alphas{kSolid, kSolid, kSolid, kClear}));
  EXPECT_EQ(moved(by(-2.5)), (Alphas{kSolid, kSolid, kClear, kSolid}));
  EXPECT_EQ(moved(by(1), {{"wrapS", 33648}}), (Alphas{kSolid, kSolid, kSolid, kClear})) << "mirrored";
  EXPECT_EQ(moved(by(-0.5), {{"wrapS", 33071}}), (Alphas{kClear, kClear, kClear, kSolid})) << "clamped";
  // A set of coordinates that the mesh does not have: there is only the factor.
  EXPECT_EQ(moved({{"texCoord", 1}}), Alphas());
  // Coordinates that are not numbers count as 0.
  Gltf gltf = strip(2, 2, pictured(mask));
  give_picture(gltf, row_of({0, 255}));
  const int places = gltf.accessor(raw(std::vector<float>(12, NAN)), 5126, "VEC2", 6);
  gltf.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = places;
  EXPECT_EQ(read(gltf).meshes[0].alpha[1], kCut) << "0 lies on the border of two texels";
}

TEST(GltfAlpha, VertexColoursMultiply) {
  Gltf gltf = strip(3, 1, {{"alphaMode", "MASK"}});
  std::vector<uint8_t> bytes;
  for (const int alpha : {255, 200, 128, 127, 100, 0, 255, 0, 0}) {
    bytes.resize(bytes.size() + 3, 9);
    bytes.push_back(uint8_t(alpha));
  }
  const int colors = gltf.accessor(raw(bytes), 5121, "VEC4", 9);
  gltf.json["accessors"][colors]["normalized"] = true;
  json& primitive = gltf.json["meshes"][0]["primitives"][0];
  primitive["attributes"]["COLOR_0"] = colors;
  EXPECT_EQ(read(gltf).meshes[0].alpha, (Alphas{kSolid, kClear, kCut})) << "the last one blocks at a corner";
  // An accessor of another type matters only to materials with alpha.
  primitive["attributes"]["COLOR_0"] = primitive["attributes"]["TEXCOORD_0"];
  EXPECT_EQ(read(gltf).meshes[0].alpha, Alphas());
  primitive["attributes"]["COLOR_0"] = 99;
  const Scene scene = read(gltf);
  EXPECT_EQ(scene.meshes[0].alpha, Alphas());
  ASSERT_EQ(scene.notes.size(), 1u);
  EXPECT_EQ(scene.notes[0].kind, NoteKind::pictures);
  gltf.json["materials"] = {json::object()};
  EXPECT_EQ(read(gltf).meshes[0].alpha, Alphas());
}

/// Primitives that share vertices do not make reading take long.
TEST(GltfAlpha, BoundsWhatIsRead) {
  constexpr int kPrimitives = 100;
  Gltf gltf = strip(1000, 1, pictured({{"alphaMode", "MASK"}}));
  give_picture(gltf, row_of({0, 255}));
  json& primitives = gltf.json["meshes"][0]["primitives"];
  primitives[0]["indices"] = gltf.indices({0, 1, 2});
  for (int i = 1; i < kPrimitives; ++i) {
    primitives.push_back(primitives[0]);
    gltf.json["accessors"].push_back(gltf.json["accessors"][1]);
    primitives[size_t(i)]["attributes"]["TEXCOORD_0"] = gltf.json["accessors"].size() - 1;
  }
  mesh::ReadLimits limits;
  limits.alpha.read = true;
  limits.max_triangles = 50'000;  // of 100,000 that would be read
  EXPECT_THROW(mesh::read("a.glb", gltf.glb(), limits), Error);
  limits.max_triangles = 200'000;
  EXPECT_EQ(mesh::read("a.glb", gltf.glb(), limits).meshes[0].triangles.size(), size_t(kPrimitives));
}

TEST(GltfAlpha, PicturesThatCannotBeReadCountAsOpaque) {
  for (const auto& [uri, why] : {std::pair{"missing.png", "is at 'missing.png', which is missing"},
                                 {"data:image/png;base64,AAAA", "is neither PNG nor JPEG nor WebP"}}) {
    Gltf gltf = strip(2, 2, pictured({{"name", "leaf"}, {"alphaMode", "BLEND"}}));
    gltf.json["images"] = {{{"uri", uri}}};
    gltf.json["textures"] = {{{"source", 0}}};
    const Scene scene = read(gltf);
    EXPECT_EQ(scene.meshes[0].alpha, Alphas());
    ASSERT_EQ(scene.notes.size(), 1u);
    EXPECT_EQ(scene.notes[0].kind, NoteKind::pictures);
    EXPECT_NE(scene.notes[0].text.find("material 'leaf' " + std::string(why)), std::string::npos)
        << scene.notes[0].text;
  }
  Gltf gltf = strip(1, 1, pictured({{"alphaMode", "BLEND"}}));
  give_picture(gltf, jpeg(8, 8, {64, {9, 9, 9}}));
  EXPECT_EQ(read(gltf).meshes[0].alpha, Alphas()) << "a JPEG has no alpha";
}

/// The lists go on to fit after triangles are merged or dropped.
TEST(GltfAlpha, StaysWithItsTriangles) {
  Gltf gltf = strip(3, 3, pictured({{"alphaMode", "MASK"}}));
  give_picture(gltf, row_of({255, 0, 255}));
  gltf.scene({0, gltf.node({{"mesh", 0}, {"translation", {0, 5, 0}}})});
  const Scene scene = read(gltf);
  const mesh::Mesh flat = flatten(mesh::FlatScene(scene.meshes, scene.instances), "both");
  EXPECT_EQ(flat.alpha, (Alphas{kSolid, kClear, kSolid, kSolid, kClear, kSolid}));

  const mesh::CleanMesh clean = mesh::clean(flat);
  EXPECT_EQ(clean.triangles.size(), 4u);
  EXPECT_EQ(clean.positions.size(), 12u);
  EXPECT_EQ(clean.dropped, (std::vector<uint32_t>{1, 4}));
  EXPECT_EQ(clean.report.clear, 2u);
  EXPECT_EQ(source_triangles(clean), (std::vector<uint32_t>{0, 2, 3, 5}));

  mesh::Mesh gone = scene.meshes[0];
  std::ranges::fill(gone.alpha, kClear);
  EXPECT_THROW(mesh::clean(gone), Error);
}

}  // namespace
}  // namespace nif::test
