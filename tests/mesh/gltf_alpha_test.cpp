// Which triangles of a glTF let light through: every rule of materials, pictures, and what meshes keep of it.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <random>

#include "formats/mesh/clean.hpp"
#include "formats/mesh/flat_scene.hpp"
#include "formats/mesh/read.hpp"
#include "tests/support/gltf.hpp"
#include "tests/support/pictures.hpp"
#include "tests/support/triangle_alpha.hpp"

namespace nif::test {
namespace {

using mesh::AlphaOptions;
using mesh::NoteKind;
using mesh::Scene;
using mesh::TriangleAlpha;
using nlohmann::json;

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
  for (const json& below : {json(-1), json(-1e300)}) {
    low["alphaCutoff"] = below;
    EXPECT_EQ(strip_of({0, 255}, low), Alphas()) << below;
  }
  for (const json& above : {json(1.5), json(1e300)}) {
    low["alphaCutoff"] = above;
    EXPECT_EQ(strip_of({0, 255}, low), (Alphas{kClear, kClear})) << above;
  }
  for (const json& none : {json("0.1"), json(nullptr), json::array({0.1})}) {
    low["alphaCutoff"] = none;
    EXPECT_EQ(strip_of({127, 128}, low), (Alphas{kClear, kSolid}))
        << none << ": 0.5, as if it were not there";
  }
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

/// KHR_materials_pbrSpecularGlossiness has a factor and a picture of its own; the others are for readers that do not know
/// it.
TEST(GltfAlpha, SpecularGlossinessReplacesTheBaseColour) {
  const auto glossy = [](const json& said) {
    return json{{"alphaMode", "MASK"}, {"extensions", {{"KHR_materials_pbrSpecularGlossiness", said}}}};
  };
  const json picture{{"diffuseTexture", {{"index", 0}}}}, faint{{"diffuseFactor", {1, 1, 1, 0.4}}};
  const auto over = [](const std::vector<uint8_t>& texels, const json& material) {
    Gltf gltf = strip(texels.size(), texels.size(), material);
    give_picture(gltf, row_of(texels));
    return read(gltf).meshes[0].alpha;
  };
  EXPECT_EQ(over({0, 127, 128, 255}, glossy(picture)), (Alphas{kClear, kClear, kSolid, kSolid}));
  EXPECT_EQ(one_of(glossy(faint)), kClear);
  json both = picture;
  both["diffuseFactor"] = {1, 1, 1, 0.6};
  EXPECT_EQ(over({212, 213}, glossy(both)), (Alphas{kClear, kSolid})) << "0.6 times 213 / 255 is 0.501";
  EXPECT_EQ(one_of(glossy(json::object())), kSolid) << "alpha is 1";

  // It wins, also with what it does not say.
  json fallback = glossy(json::object());
  fallback["pbrMetallicRoughness"] = factor(0);
  EXPECT_EQ(one_of(fallback), kSolid);
  EXPECT_EQ(over({0, 255}, pictured(glossy(json::object()))), Alphas()) << "only the fallback has a picture";
  json other = glossy(faint);
  other["pbrMetallicRoughness"] = factor(1);
  EXPECT_EQ(one_of(other), kClear);
  EXPECT_EQ(over({0, 255}, pictured(glossy(faint))), (Alphas{kClear, kClear}));
  // What is no extension does not.
  json broken = pictured(glossy("none"));
  EXPECT_EQ(over({0, 255}, broken), (Alphas{kClear, kSolid}));

  json moved = picture;
  moved["diffuseTexture"]["extensions"]["KHR_texture_transform"] = {{"offset", {0.5, 0}}};
  EXPECT_EQ(over({0, 255}, glossy(moved)), (Alphas{kSolid, kClear}));
  json opaque = glossy(faint);
  opaque.erase("alphaMode");
  EXPECT_EQ(one_of(opaque), kSolid);
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
  EXPECT_EQ(scene.see_through[0].filled, 0u);
  EXPECT_TRUE(scene.notes.empty()) << "nothing is lost";
  const mesh::Mesh& mesh = scene.meshes[0];
  ASSERT_EQ(mesh.alpha_maps.size(), 1u);
  EXPECT_EQ(mesh.alpha_maps[0]->tiles, std::vector<uint64_t>{0b1010});
  ASSERT_EQ(mesh.holes.size(), 2u);
  EXPECT_EQ(mesh.holes[1].map, 0u);
  EXPECT_EQ(mesh.holes[1].shift, 0u);
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

/// Triangles with these texture coordinates.
using Places = std::vector<std::array<std::array<float, 2>, 3>>;
Gltf placed_triangles(const Places& places, const json& material) {
  Gltf gltf = strip(places.size(), 1, material);
  std::vector<float> numbers;
  for (const auto& triangle : places)
    for (const auto& corner : triangle) numbers.insert(numbers.end(), corner.begin(), corner.end());
  gltf.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] =
      gltf.accessor(raw(numbers), 5126, "VEC2", 3 * places.size());
  return gltf;
}

/// Three places that span the whole picture.
const std::array<std::array<float, 2>, 3> kWhole{{{0, 0}, {2, 0}, {0, 2}}};

using Pixels = std::vector<std::array<uint8_t, 4>>;

/// Texels of one of two kinds, in no order.
Pixels noise(uint32_t width, uint32_t height) {
  std::mt19937 random(width * 100 + height);
  Pixels pixels;
  for (uint32_t i = 0; i < width * height; ++i) pixels.push_back({1, 2, 3, uint8_t(random() % 2 ? 255 : 99)});
  return pixels;
}

bool blocks(const mesh::AlphaMap& map, uint32_t x, uint32_t y) {
  return map.tiles[y / 8 * map.tiles_of_row() + x / 8] >> (x % 8 + 8 * (y % 8)) & 1;
}

TEST(GltfAlpha, MapsHaveABitForEachTexel) {
  for (const auto& [width, height] : {std::pair{3u, 5u}, {9u, 17u}, {8u, 8u}, {64u, 1u}, {1u, 65u}}) {
    const Pixels pixels = noise(width, height);
    Gltf gltf = placed_triangles({kWhole}, pictured({{"alphaMode", "MASK"}}));
    give_picture(gltf, png(width, height, pixels));
    const Scene scene = read(gltf);
    ASSERT_EQ(scene.meshes[0].alpha_maps.size(), 1u);
    const mesh::AlphaMap& map = *scene.meshes[0].alpha_maps[0];
    ASSERT_EQ(map.width, width);
    ASSERT_EQ(map.height, height);
    ASSERT_EQ(map.tiles.size(), size_t((width + 7) / 8) * ((height + 7) / 8));
    uint32_t bits = 0, expected = 0;
    for (uint32_t y = 0; y < height; ++y)
      for (uint32_t x = 0; x < width; ++x) {
        EXPECT_EQ(blocks(map, x, y), pixels[y * width + x][3] == 255) << x << " " << y;
        expected += pixels[y * width + x][3] == 255;
      }
    for (const uint64_t tile : map.tiles) bits += uint32_t(std::popcount(tile));
    EXPECT_EQ(bits, expected) << "beyond the picture, there are none";
    const std::array<std::array<int32_t, 2>, 3> places{
        {{0, 0}, {int32_t(2 * width << 16), 0}, {0, int32_t(2 * height << 16)}}};
    EXPECT_EQ(scene.meshes[0].holes[0].places, places);
  }
}

/// Where a picture is sampled, along one axis.
uint32_t texel_at(double place, uint32_t size, mesh::Wrap wrap) {
  const double at = std::floor(place);
  if (wrap == mesh::Wrap::clamp) return uint32_t(std::clamp(at, 0.0, size - 1.0));
  const double period = wrap == mesh::Wrap::mirror ? 2.0 * size : size,
               inside = at - period * std::floor(at / period);
  return uint32_t(inside < size ? inside : period - 1 - inside);
}

/// Points of triangles at random places, near and far, meet the same texels in the map as in the picture.
TEST(GltfAlpha, HolesAreWhereThePictureHasThem) {
  constexpr uint32_t kWidth = 6, kHeight = 5;
  const Pixels pixels = noise(kWidth, kHeight);
  std::mt19937 random(7);
  std::uniform_real_distribution<float> unit(0, 1);
  const int codes[] = {10497, 33648, 33071};
  for (const double reach : {2.0, 100.0, 3000.0})
    for (size_t s = 0; s < 3; ++s)
      for (size_t t = 0; t < 3; ++t) {
        Places places(40);
        for (auto& triangle : places)
          for (size_t axis = 0; axis < 2; ++axis) {
            const auto from = float((unit(random) - 0.5) * reach);
            for (auto& corner : triangle) corner[axis] = from + 3 * unit(random);
          }
        Gltf gltf = placed_triangles(places, pictured({{"alphaMode", "MASK"}}));
        give_picture(gltf, png(kWidth, kHeight, pixels));
        gltf.json["samplers"] = {{{"wrapS", codes[s]}, {"wrapT", codes[t]}}};
        gltf.json["textures"][0]["sampler"] = 0;
        const Scene scene = read(gltf);
        const mesh::Mesh& mesh = scene.meshes[0];
        for (size_t i = 0; i < mesh.holes.size(); ++i) {
          const mesh::TriangleHoles& holes = mesh.holes[i];
          if (!holes.any()) continue;
          EXPECT_EQ(mesh.alpha[i], kCut);
          const mesh::AlphaMap& map = *mesh.alpha_maps[holes.map];
          for (int sample = 0; sample < 50; ++sample) {
            double a = unit(random), b = unit(random);
            if (a + b > 1) a = 1 - a, b = 1 - b;
            const std::array weights{1 - a - b, a, b};
            std::array<double, 2> known{}, kept{};
            for (size_t k = 0; k < 3; ++k)
              for (size_t axis = 0; axis < 2; ++axis) {
                known[axis] += weights[k] * places[i][k][axis] * (axis == 0 ? kWidth : kHeight);
                kept[axis] += weights[k] * std::ldexp(holes.places[k][axis], int(holes.shift) - 16);
              }
            const auto near = [](double x) { return std::abs(x - std::round(x)) < 1e-4; };
            if (near(known[0]) || near(known[1])) continue;  // on a border
            const size_t texel =
                texel_at(known[1], kHeight, map.wrap[1]) * kWidth + texel_at(known[0], kWidth, map.wrap[0]);
            EXPECT_EQ(
                blocks(map, texel_at(kept[0], kWidth, map.wrap[0]), texel_at(kept[1], kHeight, map.wrap[1])),
                pixels[texel][3] == 255);
          }
        }
      }
}

/// Copies at other repetitions of the picture have the same holes.
TEST(GltfAlpha, RepetitionsDoNotMatter) {
  const auto holes_at = [](std::array<float, 2> by, const json& sampler) {
    Places places{{{{0.25f, 0.5f}, {1.75f, 0.5f}, {0.5f, 0.75f}}}};
    for (auto& corner : places[0]) corner[0] += by[0], corner[1] += by[1];
    Gltf gltf = placed_triangles(places, pictured({{"alphaMode", "MASK"}}));
    Pixels checks;
    for (int i = 0; i < 15; ++i) checks.push_back({1, 2, 3, uint8_t(i % 2 * 255)});
    give_picture(gltf, png(3, 5, checks));
    gltf.json["samplers"] = {sampler};
    gltf.json["textures"][0]["sampler"] = 0;
    return read(gltf);
  };
  const json repeated = json::object(), mirrored{{"wrapS", 33648}, {"wrapT", 33648}},
             clamped{{"wrapS", 33071}, {"wrapT", 33071}};
  const auto first = [&](std::array<float, 2> by, const json& sampler) {
    const Scene scene = holes_at(by, sampler);
    return scene.meshes[0].holes.empty() ? mesh::TriangleHoles() : scene.meshes[0].holes[0];
  };
  const mesh::TriangleHoles here = first({0, 0}, repeated);
  ASSERT_TRUE(here.any());
  EXPECT_EQ(here.places[0], (std::array<int32_t, 2>{3 << 14, 5 << 15}));
  EXPECT_EQ(first({-3, 1024}, repeated), here);
  EXPECT_EQ(first({65536, -1}, repeated), here);
  EXPECT_EQ(first({2, -4}, mirrored), here);
  EXPECT_NE(first({1, 0}, mirrored), here);
  EXPECT_NE(first({1, 1}, clamped), here);
  // Places beyond 2^15 texels have fewer digits, and those beyond 2^31 have none.
  EXPECT_EQ(holes_at({-65536, 0}, clamped).meshes[0].alpha, (Alphas{kCut}));
  EXPECT_EQ(first({-65536, 0}, clamped).shift, 3u) << "196,608 texels";
  const Scene far = holes_at({-0x1p30f, 0}, clamped);
  EXPECT_EQ(far.meshes[0].alpha, (Alphas{kCut}));
  EXPECT_TRUE(far.meshes[0].holes.empty());
  EXPECT_TRUE(far.meshes[0].alpha_maps.empty());
  EXPECT_EQ(far.see_through[0].cut, 0u);
  EXPECT_EQ(far.see_through[0].filled, 1u);
  ASSERT_EQ(far.notes.size(), 1u);
  EXPECT_EQ(far.notes[0].kind, NoteKind::see_through);
  EXPECT_EQ(
      far.notes[0].text,
      "a.glb: 1 triangle of 1 material ('material 0') has holes, which are filled (their texture coordinates "
      "are too far outside the picture): it blocks as if solid.");
}

TEST(GltfAlpha, TransformsMoveHoles) {
  Gltf gltf = placed_triangles({kWhole}, pictured({{"alphaMode", "MASK"}}));
  give_picture(gltf, png(4, 2, noise(4, 2)));
  gltf.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["extensions"]
           ["KHR_texture_transform"] = {{"offset", {0.25, -1.5}}, {"scale", {0.5, 3}}};
  const Scene scene = read(gltf);
  const std::array<std::array<int32_t, 2>, 3> places{
      {{1 << 16, 1 << 16}, {5 << 16, 1 << 16}, {1 << 16, 13 << 16}}};
  ASSERT_EQ(scene.meshes[0].holes.size(), 1u);
  EXPECT_EQ(scene.meshes[0].holes[0].places, places);
}

/// Cutoffs between the same two values of the picture have one map, others have others; all meshes share them.
TEST(GltfAlpha, MapsAreShared) {
  Gltf gltf = placed_triangles({kWhole}, pictured({{"alphaMode", "MASK"}}));
  give_picture(gltf, row_of({0, 100, 200, 255}));
  const json primitive = gltf.json["meshes"][0]["primitives"][0];
  json& primitives = gltf.json["meshes"][0]["primitives"];
  for (const double cutoff : {0.45, 0.2, 0.9}) {
    primitives.push_back(primitive);
    primitives.back()["material"] = gltf.json["materials"].size();
    json material = gltf.json["materials"][0];
    material["alphaCutoff"] = cutoff;
    gltf.json["materials"].push_back(material);
  }
  json solid = primitive;
  solid.erase("material");
  primitives.insert(primitives.begin(), solid);
  gltf.json["meshes"].push_back({{"name", "other"}, {"primitives", {primitives[3], primitive}}});
  gltf.scene({0, gltf.node({{"mesh", 1}})});
  const Scene scene = read(gltf);
  ASSERT_EQ(scene.meshes.size(), 2u);
  const mesh::Mesh &one = scene.meshes[0], &other = scene.meshes[1];
  const auto maps_of = [](const mesh::Mesh& mesh) {
    std::vector<uint32_t> maps;
    for (const mesh::TriangleHoles& holes : mesh.holes) maps.push_back(holes.map);
    return maps;
  };
  EXPECT_EQ(maps_of(one), (std::vector<uint32_t>{mesh::TriangleHoles::kNoMap, 0, 0, 1, 2}));
  ASSERT_EQ(one.alpha_maps.size(), 3u);
  EXPECT_EQ(one.alpha_maps[0]->tiles, std::vector<uint64_t>{0b1100});
  EXPECT_EQ(one.alpha_maps[1]->tiles, std::vector<uint64_t>{0b1110});
  EXPECT_EQ(one.alpha_maps[2]->tiles, std::vector<uint64_t>{0b1000});
  EXPECT_EQ(maps_of(other), (std::vector<uint32_t>{0, 1}));
  ASSERT_EQ(other.alpha_maps.size(), 2u);
  EXPECT_EQ(other.alpha_maps[0], one.alpha_maps[1]);
  EXPECT_EQ(other.alpha_maps[1], one.alpha_maps[0]);
}

TEST(GltfAlpha, MapsHaveALimit) {
  Gltf gltf = placed_triangles({kWhole}, pictured({{"alphaMode", "MASK"}}));
  Pixels pixels(mesh::AlphaMap::kMostSide + 1, {0, 0, 0, 255});
  pixels[7][3] = 0;
  give_picture(gltf, png(uint32_t(pixels.size()), 1, pixels));
  const Scene large = read(gltf);
  EXPECT_EQ(large.meshes[0].alpha, Alphas{kCut});
  EXPECT_TRUE(large.meshes[0].holes.empty());
  ASSERT_EQ(large.notes.size(), 1u);
  EXPECT_NE(large.notes[0].text.find("(a picture has more than 16384 texels along a side)"),
            std::string::npos);
  const Scene reduced = read(gltf, {.resolution = 16384});
  ASSERT_EQ(reduced.meshes[0].alpha_maps.size(), 1u);
  EXPECT_EQ(reduced.meshes[0].alpha_maps[0]->width, 8193u);
  EXPECT_TRUE(reduced.notes.empty());
}

TEST(GltfAlpha, PicturesAreHalved) {
  Gltf gltf = placed_triangles({{{{0.5f, 0}, {1, 0}, {0.5f, 1}}}, kWhole}, pictured({{"alphaMode", "MASK"}}));
  // The left half is solid; of the right half, one texel of four, then three.
  Pixels pixels;
  for (const int alpha : {1, 1, 1, 1, 1, 0, 1, 1, 1, 1, 1, 1, 0, 0, 1, 0})
    pixels.push_back({0, 0, 0, uint8_t(alpha * 255)});
  give_picture(gltf, png(8, 2, pixels));
  const Scene scene = read(gltf, {.resolution = 4});
  const mesh::Mesh& mesh = scene.meshes[0];
  ASSERT_EQ(mesh.alpha_maps.size(), 1u);
  EXPECT_EQ(mesh.alpha_maps[0]->width, 4u);
  EXPECT_EQ(mesh.alpha_maps[0]->height, 1u);
  EXPECT_EQ(mesh.alpha_maps[0]->tiles, std::vector<uint64_t>{0b1011});
  const std::array<std::array<int32_t, 2>, 3> places{{{2 << 16, 0}, {4 << 16, 0}, {2 << 16, 1 << 16}}};
  EXPECT_EQ(mesh.holes[0].places, places);
  EXPECT_EQ(read(gltf, {.resolution = 8}).meshes[0].alpha_maps[0]->width, 8u);
  // All of it is solid now, but the triangle is cut as before.
  const Scene one = read(gltf, {.resolution = 1});
  EXPECT_EQ(one.meshes[0].alpha, (Alphas{kCut, kCut}));
  EXPECT_EQ(one.meshes[0].alpha_maps[0]->tiles, std::vector<uint64_t>{1});
  // Of odd sides, texels belong to where their middles are, and the picture repeats as before.
  give_picture(gltf, row_of({255, 0, 0, 255, 255}));
  const Scene odd = read(gltf, {.resolution = 4});
  EXPECT_EQ(odd.meshes[0].alpha_maps[0]->width, 3u);
  EXPECT_EQ(odd.meshes[0].alpha_maps[0]->tiles, std::vector<uint64_t>{0b101});
  EXPECT_EQ(odd.meshes[0].holes[1].places[1][0], 6 << 16);
}

/// The alpha of vertices, three for each triangle.
void give_alphas(Gltf& gltf, const std::vector<float>& alphas) {
  std::vector<float> colors;
  for (const float alpha : alphas) colors.insert(colors.end(), {1, 1, 1, alpha});
  gltf.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] =
      gltf.accessor(raw(colors), 5126, "VEC4", alphas.size());
}

TEST(GltfAlpha, VertexAlphaAloneMakesARamp) {
  Gltf gltf = strip(3, 1, {{"alphaMode", "MASK"}, {"alphaCutoff", 0.25}});
  give_alphas(gltf, {0, 0.5f, 1, 0.125f, 0.25f, 0.375f, 0.25f, 1, 1});
  const Scene scene = read(gltf);
  const mesh::Mesh& mesh = scene.meshes[0];
  EXPECT_EQ(mesh.alpha, (Alphas{kCut, kCut, kSolid}));
  ASSERT_EQ(mesh.alpha_maps.size(), 1u);
  const mesh::AlphaMap ramp{2, 1, {mesh::Wrap::clamp, mesh::Wrap::clamp}, {0b10}};
  EXPECT_EQ(*mesh.alpha_maps[0], ramp);
  constexpr int32_t kHalf = 1 << 15;
  const std::array<std::array<int32_t, 2>, 3> wide{{{0, kHalf}, {4 * kHalf, kHalf}, {8 * kHalf, kHalf}}},
      narrow{{{kHalf, kHalf}, {2 * kHalf, kHalf}, {3 * kHalf, kHalf}}};
  EXPECT_EQ(mesh.holes[0].places, wide);
  EXPECT_EQ(mesh.holes[1].places, narrow);
  EXPECT_FALSE(mesh.holes[2].any());
  gltf.json["materials"][0]["alphaCutoff"] = 1e-30;
  const Scene tiny = read(gltf);
  EXPECT_EQ(tiny.meshes[0].alpha, (Alphas{kCut, kSolid, kSolid}));
  EXPECT_TRUE(tiny.meshes[0].holes.empty()) << "alpha is too many times the cutoff";
  EXPECT_EQ(tiny.see_through[0].filled, 1u);
}

TEST(GltfAlpha, ThePictureCountsWithTheMeanOfVertexAlpha) {
  Places places(4, kWhole);
  places[3] = {{{0.4f, 0.1f}, {0.9f, 0.1f}, {0.4f, 0.9f}}};  // not over the first texel
  Gltf gltf = placed_triangles(places, pictured({{"alphaMode", "MASK"}}));
  give_picture(gltf, row_of({100, 200, 255}));
  give_alphas(gltf, {0.9f, 1, 0.8f, 1, 0.5f, 0.75f, 0, 0.1f, 0, 1, 0.4f, 1});
  const Scene scene = read(gltf);
  const mesh::Mesh& mesh = scene.meshes[0];
  EXPECT_EQ(mesh.alpha, (Alphas{kCut, kCut, kClear, kSolid}))
      << "0.8 times 200 blocks, 0.4 times 200 would not";
  ASSERT_EQ(mesh.alpha_maps.size(), 1u);
  EXPECT_EQ(mesh.holes[0].map, 0u);
  EXPECT_EQ(mesh.holes[1].map, 0u);
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

/// A material whose picture does not exist, or has no place on a triangle, is not silently solid.
TEST(GltfAlpha, WhatIsMissingIsNoted) {
  const auto noted = [](const Gltf& gltf, const std::string& what) {
    const Scene scene = read(gltf);
    EXPECT_EQ(scene.meshes[0].alpha, Alphas()) << what;
    ASSERT_EQ(scene.notes.size(), 1u) << what;
    EXPECT_EQ(scene.notes[0].kind, NoteKind::pictures);
    EXPECT_EQ(scene.notes[0].text, "a.glb: the picture of material 'leaf' " + what);
  };
  const json leaf = pictured({{"name", "leaf"}, {"alphaMode", "MASK"}});
  const auto with = [&](const char* list, const json& content) {
    Gltf gltf = strip(2, 2, leaf);
    give_picture(gltf, row_of({0, 0}));
    gltf.json[list] = content;
    return gltf;
  };
  const std::string none = "does not exist; it counts as opaque";
  noted(with("textures", json::array()), none);
  noted(with("textures", {{{"source", 9}}}), none);
  noted(with("textures", {{{"source", "leaf.png"}}}), none);
  noted(with("images", json::array()), none);
  noted(with("textures", {{{"name", "of an extension"}}}),
        "is in a format that only an extension names; it counts as opaque");

  const std::string nowhere = "has no texture coordinates on some triangles; there it counts as opaque";
  Gltf bare = with("asset", {{"version", "2.0"}});
  json& info = bare.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"];
  info["texCoord"] = 1;
  noted(bare, nowhere);
  info["texCoord"] = 0;
  info["extensions"]["KHR_texture_transform"] = {{"texCoord", 3}};
  noted(bare, nowhere);
  info.erase("extensions");
  EXPECT_EQ(read(bare).meshes[0].alpha, (Alphas{kClear, kClear}));
  bare.json["meshes"][0]["primitives"][0]["attributes"].erase("TEXCOORD_0");
  noted(bare, nowhere);
  // A picture without alpha has nothing to lose.
  bare.json["images"][0]["bufferView"] = bare.view(jpeg(8, 8, {64, {9, 9, 9}}));
  EXPECT_TRUE(read(bare).notes.empty());
}

/// Texture coordinates and colours that do not fit count as none for every primitive that has them, also after others
/// were read.
TEST(GltfAlpha, ValuesOfVerticesThatDoNotFit) {
  Gltf gltf = strip(1, 1, pictured({{"name", "leaf"}, {"alphaMode", "MASK"}}));
  give_picture(gltf, row_of({0}));
  json& primitives = gltf.json["meshes"][0]["primitives"];
  const int few = gltf.accessor(raw(std::vector<float>{0.5f, 0.5f, 0.5f, 0.5f}), 5126, "VEC2", 2),
            wrong = gltf.accessor(raw(std::vector<float>(9, 0.5f)), 5126, "VEC3", 3);
  for (const int coordinates : {few, few, wrong, wrong, 99, 99}) {
    primitives.push_back(primitives[0]);
    primitives.back()["attributes"]["TEXCOORD_0"] = coordinates;
  }
  const Scene scene = read(gltf);
  EXPECT_EQ(scene.meshes[0].alpha, (Alphas{kClear, kSolid, kSolid, kSolid, kSolid, kSolid, kSolid}));
  ASSERT_EQ(scene.notes.size(), 2u) << "clear triangles, and this";
  EXPECT_NE(scene.notes[1].text.find("'leaf' has texture coordinates or vertex colours that cannot be read"),
            std::string::npos)
      << scene.notes[1].text;

  Gltf faded = strip(1, 1, {{"alphaMode", "MASK"}});
  const int half = faded.accessor(raw(std::vector<float>(8, 0.1f)), 5126, "VEC4", 2);
  faded.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = half;
  const Scene solid = read(faded);
  EXPECT_EQ(solid.meshes[0].alpha, Alphas());
  EXPECT_EQ(solid.notes.size(), 1u);
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

/// Holes follow their corners, and each map is listed once.
TEST(GltfAlpha, HolesStayWithTheirTriangles) {
  Gltf gltf = placed_triangles({{{{0.25f, 0.1f}, {0.3f, 0.1f}, {0.3f, 0.2f}}}, {{{0, 0}, {1, 0}, {0, 1}}}},
                               pictured({{"alphaMode", "MASK"}}));
  give_picture(gltf, row_of({255, 0}));
  gltf.scene({0, gltf.node({{"mesh", 0}, {"scale", {-1, 1, 1}}}),
              gltf.node({{"mesh", 0}, {"translation", {9, 0, 0}}})});
  Scene scene = read(gltf);
  ASSERT_EQ(scene.meshes[0].alpha, (Alphas{kSolid, kCut}));
  const mesh::TriangleHoles none, holes = scene.meshes[0].holes[1];
  EXPECT_FALSE(none.any());
  mesh::TriangleHoles mirrored = holes;
  std::swap(mirrored.places[1], mirrored.places[2]);
  mesh::Mesh flat = flatten(mesh::FlatScene(scene), "all");
  EXPECT_EQ(flat.alpha_maps, scene.meshes[0].alpha_maps);
  EXPECT_EQ(flat.holes, (std::vector{none, holes, none, mirrored, none, holes}));

  flat.alpha[1] = flat.alpha[3] = kClear;
  scene.meshes = {flat};
  scene.instances = {{"all", 0}};
  mesh::drop_clear(scene);
  EXPECT_EQ(scene.meshes[0].holes, (std::vector{none, none, none, holes}));
  EXPECT_EQ(scene.meshes[0].alpha_maps.size(), 1u);
  scene.meshes[0].alpha.back() = kClear;
  mesh::drop_clear(scene);
  EXPECT_TRUE(scene.meshes[0].holes.empty());
  EXPECT_TRUE(scene.meshes[0].alpha_maps.empty()) << "none is in use";
}

}  // namespace
}  // namespace nif::test
