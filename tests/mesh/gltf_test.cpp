// glTF: hierarchy, instances, primitive modes, accessor types, compression, buffers.
#include <gtest/gtest.h>

#include "formats/mesh/read.hpp"
#include "tests/mesh/encode.hpp"
#include "tests/support/shapes.hpp"
#include "tests/support/temp_dir.hpp"

namespace nif::test {
namespace {

using mesh::Scene;
using Triangles = std::vector<mesh::Triangle>;
using Points = std::vector<mesh::Float3>;
using nlohmann::json;

const Points kSquare{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};

Scene read_glb(const Gltf& gltf) {
  const TempDir folder;
  return mesh::read(folder.write("file.glb", gltf.glb()));
}

TEST(Gltf, FlattensTheHierarchy) {
  Gltf gltf;
  const int shape = gltf.mesh(gltf.positions(kSquare), gltf.indices({0, 1, 2}), "shape");
  // A quarter turn about z, then a child scaled and moved by a column-major matrix.
  gltf.node({{"children", {1, 2}},
             {"translation", {10, 0, 0}},
             {"rotation", {0, 0, std::sqrt(0.5), std::sqrt(0.5)}}});
  gltf.node(
      {{"mesh", shape}, {"name", "child"}, {"matrix", {2, 0, 0, 0, 0, 3, 0, 0, 0, 0, -1, 0, 1, 2, 3, 1}}});
  gltf.node({{"mesh", shape}, {"scale", {0.5, 0.5, 0.5}}});
  gltf.node({{"mesh", shape}, {"name", "not in the scene"}});
  gltf.scene({3});
  gltf.scene({0});
  const Scene scene = read_glb(gltf);
  ASSERT_EQ(scene.meshes.size(), 1u);
  ASSERT_EQ(scene.instances.size(), 2u);
  EXPECT_EQ(scene.instances[0].name, "child");
  EXPECT_EQ(scene.instances[1].name, "shape");
  const mesh::Transform wanted[]{{0, -3, 0, 8, 2, 0, 0, 1, 0, 0, -1, 3},
                                 {0, -0.5f, 0, 10, 0.5f, 0, 0, 0, 0, 0, 0.5f, 0}};
  for (size_t i = 0; i < 2; ++i) {
    for (size_t k = 0; k < 12; ++k)
      EXPECT_NEAR(scene.instances[i].transform[k], wanted[i][k], 1e-6) << i << ' ' << k;
  }
}

TEST(Gltf, WithoutAScenePlacesAllRootsAndWithoutNodesAllMeshes) {
  Gltf gltf;
  const int shape = gltf.mesh(gltf.positions(kSquare), gltf.indices({0, 1, 2}));
  EXPECT_EQ(read_glb(gltf).instances.size(), 1u);
  EXPECT_EQ(read_glb(gltf).meshes[0].name, "file");
  gltf.node({{"children", {1}}});
  gltf.node({{"mesh", shape}});
  gltf.node({{"mesh", shape}});
  EXPECT_EQ(read_glb(gltf).instances.size(), 2u);
}

TEST(Gltf, ReadsEveryModeOfTriangles) {
  const Points five{{0, 0, 0}, {0, 1, 0}, {1, 0, 0}, {1, 1, 0}, {2, 0, 0}};
  const auto triangles = [&](int mode, std::vector<uint32_t> indices) {
    Gltf gltf;
    gltf.mesh(gltf.positions(five), indices.empty() ? -1 : gltf.indices(indices), nullptr, mode);
    return read_glb(gltf).meshes[0].triangles;
  };
  EXPECT_EQ(triangles(4, {}), (Triangles{{0, 1, 2}}));
  EXPECT_EQ(triangles(4, {4, 3, 2, 2, 1, 0}), (Triangles{{4, 3, 2}, {2, 1, 0}}));
  EXPECT_EQ(triangles(5, {}), (Triangles{{0, 1, 2}, {2, 1, 3}, {2, 3, 4}}));
  EXPECT_EQ(triangles(5, {0, 2, 1, 3, 3, 3, 4, 2}), (Triangles{{0, 2, 1}, {1, 2, 3}, {4, 3, 2}}));
  EXPECT_EQ(triangles(6, {0, 2, 3, 1}), (Triangles{{0, 2, 3}, {0, 3, 1}}));
}

TEST(Gltf, MergesPrimitivesSharesVerticesAndSkipsLines) {
  Gltf gltf;
  const int points = gltf.positions(kSquare), others = gltf.positions({{5, 0, 0}, {6, 0, 0}, {5, 1, 0}});
  const int index8 = gltf.accessor(std::string("\0\1\2", 3), 5121, "SCALAR", 3);
  gltf.mesh(points, index8);
  auto& primitives = gltf.json["meshes"][0]["primitives"];
  primitives.push_back({{"attributes", {{"POSITION", points}}}, {"indices", gltf.indices16({0, 2, 3})}});
  primitives.push_back({{"attributes", {{"POSITION", others}}}});
  primitives.push_back({{"attributes", {{"POSITION", points}}}, {"mode", 1}});
  const Scene scene = read_glb(gltf);
  EXPECT_EQ(scene.meshes[0].positions.size(), 7u);
  EXPECT_EQ(scene.meshes[0].triangles, (Triangles{{0, 1, 2}, {0, 2, 3}, {4, 5, 6}}));
  ASSERT_EQ(scene.warnings.size(), 1u);
  EXPECT_NE(scene.warnings[0].find("lost 1 primitives"), std::string::npos);
}

TEST(Gltf, FollowsStridesAndOffsets) {
  Gltf gltf;
  std::vector<float> interleaved{-1};
  for (const auto& p : kSquare) interleaved.insert(interleaved.end(), {p[0], p[1], p[2], 77});
  interleaved.pop_back();  // the last element needs no padding
  gltf.mesh(gltf.accessor(raw(interleaved), 5126, "VEC3", 4), -1, nullptr, 6);
  gltf.json["bufferViews"][0]["byteStride"] = 16;
  gltf.json["accessors"][0]["byteOffset"] = 4;
  EXPECT_EQ(read_glb(gltf).meshes[0].positions, kSquare);
}

TEST(Gltf, AppliesSparseAccessors) {
  Gltf gltf;
  const auto sparse = [&](int component, std::string_view indices) {
    return json{{"count", 2},
                {"indices", {{"bufferView", gltf.view(indices)}, {"componentType", component}}},
                {"values", {{"bufferView", gltf.view(raw(Points{{7, 8, 9}, {4, 5, 6}}))}}}};
  };
  const int dense = gltf.positions(kSquare);
  gltf.json["accessors"][0]["sparse"] = sparse(5123, raw(std::vector<uint16_t>{1, 3}));
  gltf.json["accessors"].push_back({{"componentType", 5126},
                                    {"type", "VEC3"},
                                    {"count", 3},
                                    {"sparse", sparse(5121, std::string_view("\0\2", 2))}});
  gltf.mesh(dense, -1);
  gltf.mesh(1, -1);
  const Scene scene = read_glb(gltf);
  EXPECT_EQ(scene.meshes[0].positions, (Points{{0, 0, 0}, {7, 8, 9}, {1, 1, 0}, {4, 5, 6}}));
  EXPECT_EQ(scene.meshes[1].positions, (Points{{7, 8, 9}, {0, 0, 0}, {4, 5, 6}}));
}

TEST(Gltf, DecodesQuantisedPositions) {
  Gltf gltf;
  gltf.json["extensionsRequired"] = {"KHR_mesh_quantization"};
  const auto add = [&](int component, const std::string& bytes, bool normalized) {
    const int accessor = gltf.accessor(bytes, component, "VEC3", 3);
    gltf.json["accessors"][static_cast<size_t>(accessor)]["normalized"] = normalized;
    gltf.mesh(accessor, -1);
  };
  add(5120, raw(std::vector<int8_t>{-128, 127, 0, 1, 2, 3, 4, 5, 6}), true);
  add(5121, raw(std::vector<uint8_t>{255, 0, 51, 1, 2, 3, 4, 5, 6}), true);
  add(5122, raw(std::vector<int16_t>{-32768, 32767, 0, 1, 2, 3, 4, 5, 6}), true);
  add(5123, raw(std::vector<uint16_t>{65535, 0, 13107, 1, 2, 3, 4, 5, 6}), true);
  add(5122, raw(std::vector<int16_t>{-32768, 32767, 0, 1, 2, 3, 4, 5, 6}), false);
  const Scene scene = read_glb(gltf);
  ASSERT_EQ(scene.meshes.size(), 5u);
  EXPECT_EQ(scene.meshes[0].positions[0], (mesh::Float3{-1, 1, 0}));
  EXPECT_EQ(scene.meshes[1].positions[0], (mesh::Float3{1, 0, 0.2f}));
  EXPECT_EQ(scene.meshes[2].positions[0], (mesh::Float3{-1, 1, 0}));
  EXPECT_EQ(scene.meshes[3].positions[0], (mesh::Float3{1, 0, 0.2f}));
  EXPECT_EQ(scene.meshes[4].positions[0], (mesh::Float3{-32768, 32767, 0}));
}

TEST(Gltf, DecodesDraco) {
  const mesh::Mesh ball = icosphere(2);
  Gltf gltf;
  gltf.json["extensionsRequired"] = {"KHR_draco_mesh_compression"};
  gltf.json["accessors"] = {{{"componentType", 5126}, {"type", "VEC3"}, {"count", 162}},
                            {{"componentType", 5125}, {"type", "SCALAR"}, {"count", 960}}};
  gltf.mesh(0, 1, "ball");
  gltf.json["meshes"][0]["primitives"][0]["extensions"]["KHR_draco_mesh_compression"] = {
      {"bufferView", gltf.view(draco(ball))}, {"attributes", {{"POSITION", 0}}}};
  const Scene scene = read_glb(gltf);
  EXPECT_EQ(scene.meshes[0].name, "ball");
  EXPECT_EQ(scene.meshes[0].triangles.size(), ball.triangles.size());
  EXPECT_NEAR(signed_volume(scene.meshes[0]), signed_volume(ball), 1e-5);
}

TEST(Gltf, LoadsExternalBuffersAndIgnoresImages) {
  const TempDir folder;
  Gltf gltf = gltf_of(cube());
  gltf.json["images"] = {{{"uri", "missing.png"}}, {{"bufferView", 99}, {"mimeType", "image/png"}}};
  gltf.json["materials"] = {{{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 12}}}}}}};
  folder.write("a b.bin", gltf.data + "more than the buffer needs");
  const Scene plain = mesh::read(folder.write("file.gltf", gltf.gltf("a%20b.bin")));
  EXPECT_EQ(plain.meshes[0].triangles, cube().triangles);
  EXPECT_EQ(plain.files,
            (std::vector{(folder.path() / "file.gltf").string(), (folder.path() / "a b.bin").string()}));
  EXPECT_EQ(mesh::read(folder.write("file.gltf.gz", gzip(gltf.gltf("a b.bin")))).meshes[0].triangles,
            cube().triangles);
  folder.write("a b.bin", gltf.data + "more than the buffer needed");
  EXPECT_NE(mesh::read(folder.path() / "file.gltf").source_hash, plain.source_hash);
}

TEST(Gltf, ReadsSkinsAndMorphTargetsAtRestWithWarnings) {
  Gltf gltf = gltf_of(cube());
  gltf.json["skins"] = {{{"joints", {0}}}};
  gltf.json["nodes"][0]["skin"] = 0;
  gltf.json["meshes"][0]["primitives"][0]["targets"] = {{{"POSITION", 0}}};
  const Scene scene = read_glb(gltf);
  EXPECT_EQ(scene.meshes[0].positions, cube().positions);
  EXPECT_EQ(scene.warnings.size(), 2u);
}

TEST(Gltf, ExtensionsOfAppearanceDoNotMatter) {
  Gltf gltf = gltf_of(cube());
  gltf.json["extensionsRequired"] = {"KHR_texture_transform", "KHR_materials_unlit"};
  EXPECT_EQ(read_glb(gltf).meshes.size(), 1u);
}

}  // namespace
}  // namespace nif::test
