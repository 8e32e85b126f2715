// glTF: hierarchy, instances, primitive modes, accessor types, compression, buffers.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <meshoptimizer.h>

#include "formats/mesh/read.hpp"
#include "tests/mesh/encode.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/support/test_shapes.hpp"

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
  ASSERT_EQ(scene.notes.size(), 1u);
  EXPECT_NE(scene.notes[0].text.find("has 1 primitives of points or lines"), std::string::npos);
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

/// A buffer that refers to a file takes few bytes: a hundred buffers must not become a hundred copies.
TEST(Gltf, ReadsEachFileOnceAndAllWithinALimit) {
  const TempDir folder;
  Gltf gltf = gltf_of(cube());
  folder.write("a.bin", gltf.data + std::string(1000, '\0'));
  folder.write("b.bin", std::string(1000, '\0'));
  for (int i = 0; i < 100; ++i)
    gltf.more_buffers.push_back({{"uri", i % 2 ? "a.bin" : "./a.bin"}, {"byteLength", 1}});
  const auto file = [&] { return folder.write("file.gltf", gltf.gltf("a.bin")); };
  const uint64_t most = gltf.data.size() + 2500 + gltf.gltf("a.bin").size();
  const Scene scene = mesh::read(file(), {.max_decompressed_bytes = most});
  EXPECT_EQ(scene.files.size(), 2u);
  EXPECT_EQ(scene.meshes[0].triangles, cube().triangles);
  for (int i = 0; i < 20; ++i) {
    folder.write(fmt::format("{}.bin", i), std::string(1000, '\0'));
    gltf.more_buffers.push_back({{"uri", fmt::format("{}.bin", i)}, {"byteLength", 1}});
  }
  try {
    mesh::read(file(), {.max_decompressed_bytes = most});
    ADD_FAILURE() << "20 kB more";
  } catch (const Error& error) {
    EXPECT_EQ(error.status(), Status::too_large) << error.what();
  }
}

/// Any number of nodes can use a mesh, and each instance takes the name.
TEST(Gltf, NamesOfMeshesAreCut) {
  Gltf gltf;
  const int shape =
      gltf.mesh(gltf.positions(kSquare), gltf.indices({0, 1, 2}), std::string(5000, 'x').c_str());
  gltf.scene({gltf.node({{"mesh", shape}}), gltf.node({{"mesh", shape}, {"name", "named"}})});
  const Scene scene = read_glb(gltf);
  EXPECT_EQ(scene.instances[0].name, std::string(128, 'x'));
  EXPECT_EQ(scene.instances[1].name, "named");
}

/// Accessors without a buffer view take no bytes in a file.
TEST(Gltf, BoundsZerosOverAllAccessors) {
  Gltf gltf;
  const int points = gltf.positions(kSquare);
  const auto zeros = [&](uint64_t count) {
    gltf.json["accessors"].push_back({{"componentType", 5126}, {"type", "VEC3"}, {"count", count}});
    return int(gltf.json["accessors"].size() - 1);
  };
  gltf.mesh(points, gltf.indices({0, 1, 2}));
  gltf.mesh(zeros(300), gltf.indices({0, 1, 2}));
  EXPECT_EQ(read_glb(gltf).meshes.size(), 2u);
  gltf.mesh(zeros((1 << 25) - 299), gltf.indices({0, 1, 2}));
  try {
    read_glb(gltf);
    ADD_FAILURE() << "more than 2^25 in all";
  } catch (const Error& error) {
    EXPECT_EQ(error.status(), Status::too_large) << error.what();
  }
}

/// tinygltf keeps only their lower 32 bits.
TEST(Gltf, RefusesIndicesBeyond32Bits) {
  for (const char* place :
       {"/nodes/0/mesh", "/scenes/0/nodes/0", "/meshes/0/primitives/0/attributes/POSITION",
        "/meshes/0/primitives/0/indices", "/accessors/0/bufferView", "/scene"}) {
    for (const int64_t turn : {int64_t{1} << 32, -(int64_t{1} << 32)}) {
      Gltf gltf;
      gltf.scene({gltf.node({{"mesh", gltf.mesh(gltf.positions(kSquare), gltf.indices({0, 1, 2}))}})});
      gltf.json["scene"] = 0;
      json& index = gltf.json.at(json::json_pointer(place));
      index = index.get<int64_t>() + turn;
      try {
        read_glb(gltf);
        ADD_FAILURE() << place << ' ' << index;
      } catch (const Error& error) {
        EXPECT_EQ(error.status(), Status::malformed_mesh) << error.what();
        EXPECT_NE(std::string(error.what()).find(index.dump()), std::string::npos) << error.what();
      }
    }
  }
}

TEST(Gltf, ReadsSkinsAndMorphTargetsAtRestWithWarnings) {
  Gltf gltf = gltf_of(cube());
  gltf.json["skins"] = {{{"joints", {0}}}};
  gltf.json["nodes"][0]["skin"] = 0;
  gltf.json["meshes"][0]["primitives"][0]["targets"] = {{{"POSITION", 0}}};
  const Scene scene = read_glb(gltf);
  EXPECT_EQ(scene.meshes[0].positions, cube().positions);
  EXPECT_EQ(scene.notes.size(), 2u);
}

TEST(Gltf, MorphsByTheWeightsThatTheFileSets) {
  Gltf gltf;
  const Points moves{{0, 0, 1}, {0, 0, 2}, {0, 0, 0}, {0, 0, 4}},
      others{{1, 0, 0}, {1, 0, 0}, {1, 0, 0}, {1, 0, 0}};
  const int shape = gltf.mesh(gltf.positions(kSquare), gltf.indices({0, 1, 2, 0, 2, 3}), "face");
  json& mesh = gltf.json["meshes"][0];
  mesh["primitives"][0]["targets"] = {
      {{"POSITION", gltf.positions(moves)}}, {{"NORMAL", 0}}, {{"POSITION", gltf.positions(others)}}};
  gltf.scene({gltf.node({{"mesh", shape}, {"name", "as the mesh"}}),
              gltf.node({{"mesh", shape}, {"name", "as the node"}, {"weights", {0.5, 1, -1}}}),
              gltf.node({{"mesh", shape}, {"name", "at rest"}, {"weights", {0, 0, 0}}}),
              gltf.node({{"mesh", shape}, {"name", "the same"}, {"weights", {0.5, 1, -1}}})});
  EXPECT_EQ(read_glb(gltf).meshes.size(), 2u) << "weights are 0 where nobody sets them";
  gltf.json["meshes"][0]["weights"] = {2, 0, 0};
  const Scene scene = read_glb(gltf);
  ASSERT_EQ(scene.meshes.size(), 3u);
  ASSERT_EQ(scene.instances.size(), 4u);
  EXPECT_EQ(scene.meshes[scene.instances[0].mesh].positions,
            (Points{{0, 0, 2}, {1, 0, 4}, {1, 1, 0}, {0, 1, 8}}));
  EXPECT_EQ(scene.meshes[scene.instances[1].mesh].positions,
            (Points{{-1, 0, 0.5f}, {0, 0, 1}, {0, 1, 0}, {-1, 1, 2}}));
  EXPECT_EQ(scene.meshes[scene.instances[2].mesh].positions, kSquare);
  EXPECT_EQ(scene.instances[3].mesh, scene.instances[1].mesh);
  mesh["primitives"][0]["targets"][0]["POSITION"] = gltf.positions({{0, 0, 1}});
  EXPECT_THROW(read_glb(gltf), Error);
}

TEST(Gltf, BoundsVerticesThatMeshesShare) {
  Gltf gltf;
  const int points = gltf.positions(kSquare), corners = gltf.indices({0, 1, 2});
  std::vector<int> roots;
  for (int i = 0; i < 3; ++i) roots.push_back(gltf.node({{"mesh", gltf.mesh(points, corners)}}));
  gltf.scene(roots);
  EXPECT_EQ(mesh::read("a.glb", gltf.glb(), {.max_triangles = 4}).meshes.size(), 3u);
  try {
    mesh::read("a.glb", gltf.glb(), {.max_triangles = 3});
    ADD_FAILURE() << "12 vertices are more than three triangles have corners";
  } catch (const Error& error) {
    EXPECT_EQ(error.status(), Status::too_large);
  }
}

/// Meshes without triangles are also read once per set of weights.
TEST(Gltf, BoundsVerticesThatNoTriangleUses) {
  Gltf gltf;
  const int points = gltf.positions(kSquare), none = gltf.accessor("", 5125, "SCALAR", 0);
  gltf.scene({gltf.node({{"mesh", gltf.mesh(points, gltf.indices({0, 1, 2}))}}),
              gltf.node({{"mesh", gltf.mesh(points, none)}}),
              gltf.node({{"mesh", gltf.mesh(points, none)}})});
  EXPECT_EQ(mesh::read("a.glb", gltf.glb(), {.max_triangles = 4}).meshes.size(), 1u);
  EXPECT_THROW(mesh::read("a.glb", gltf.glb(), {.max_triangles = 3}), Error);
}

/// A square with a moved node, bound to two joints below a rotated and scaled root.
Gltf skinned(const Points& joints_moved) {
  Gltf gltf;
  const int shape = gltf.mesh(gltf.positions(kSquare), gltf.indices({0, 1, 2}), "skin");
  // Column-major inverses of translations: the joints were bound at x = 1 and x = 2.
  std::vector<float> inverses;
  for (const float x : {1.0f, 2.0f})
    inverses.insert(inverses.end(), {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, -x, 0, 0, 1});
  gltf.json["skins"] = {
      {{"joints", {2, 3}}, {"inverseBindMatrices", gltf.accessor(raw(inverses), 5126, "MAT4", 2)}}};
  const double half = std::sqrt(0.5);
  gltf.scene({gltf.node({{"mesh", shape}, {"skin", 0}, {"translation", {50, 50, 50}}}),
              gltf.node({{"children", {2, 3}}, {"scale", {2, 2, 2}}, {"rotation", {0, 0, half, half}}})});
  for (size_t i = 0; i < 2; ++i)
    gltf.node({{"translation", {joints_moved[i][0] + float(i) + 1, joints_moved[i][1], joints_moved[i][2]}}});
  return gltf;
}

TEST(Gltf, PutsSkinsWhereTheirJointsHaveThem) {
  const Scene bound = read_glb(skinned({{0, 0, 0}, {0, 0, 0}}));
  ASSERT_EQ(bound.instances.size(), 1u);
  const mesh::Transform wanted{0, -2, 0, 0, 2, 0, 0, 0, 0, 0, 2, 0};
  for (size_t k = 0; k < 12; ++k) EXPECT_NEAR(bound.instances[0].transform[k], wanted[k], 1e-6) << k;
  ASSERT_EQ(bound.notes.size(), 1u);
  EXPECT_NE(bound.notes[0].text.find("read in the bind pose"), std::string::npos);

  const Scene moved = read_glb(skinned({{5, 0, 0}, {5, 0, 0}}));  // the whole square
  EXPECT_NEAR(moved.instances[0].transform[7], 10, 1e-5);

  // Without weights, everything moves with the first joint.
  const Scene posed = read_glb(skinned({{0, 0, 0}, {0, 1, 0}}));
  ASSERT_EQ(posed.notes.size(), 2u);
  EXPECT_EQ(posed.notes[0].kind, mesh::NoteKind::pose);
  EXPECT_EQ(posed.notes[1].kind, mesh::NoteKind::posed_skin);
  for (size_t k = 0; k < 12; ++k) EXPECT_NEAR(posed.instances[0].transform[k], k % 5 == 0 ? 1 : 0, 1e-6) << k;
  const mesh::Float3 corner{0, 2, 0};
  for (size_t a = 0; a < 3; ++a) EXPECT_NEAR(posed.meshes[0].positions[1][a], corner[a], 1e-6) << a;

  // With a malformed skin, the pose is lost but not the mesh.
  for (const json& skin : {json{{"joints", {2, 99}}}, json{{"joints", "all"}}, json(5), json{{"joints", {2}}},
                           json{{"joints", {2, 3}}, {"inverseBindMatrices", 0}}}) {
    Gltf gltf = skinned({{0, 0, 0}, {0, 1, 0}});
    gltf.json["skins"][0] = skin;
    EXPECT_EQ(read_glb(gltf).meshes.size(), 1u) << skin;
  }
}

TEST(Gltf, DecodesMeshopt) {
  const mesh::Mesh ball = icosphere(2);
  std::vector<uint32_t> flat;
  for (const auto& t : ball.triangles) flat.insert(flat.end(), t.begin(), t.end());
  const size_t vertices = ball.positions.size();
  const auto encode = [&](const void* elements, size_t stride) {
    std::vector<unsigned char> bytes(meshopt_encodeVertexBufferBound(vertices, stride));
    bytes.resize(meshopt_encodeVertexBuffer(bytes.data(), bytes.size(), elements, vertices, stride));
    return bytes;
  };
  Points exponential(vertices);
  meshopt_encodeFilterExp(exponential.data(), vertices, sizeof(mesh::Float3), 20, ball.positions[0].data());
  std::vector<std::array<int16_t, 4>> quantised;
  for (const mesh::Float3& p : ball.positions)
    quantised.push_back({int16_t(p[0] * 1000), int16_t(p[1] * 1000), int16_t(p[2] * 1000), 0});
  std::vector<unsigned char> corners(meshopt_encodeIndexBufferBound(flat.size(), vertices)),
      sequence(meshopt_encodeIndexSequenceBound(flat.size(), vertices));
  corners.resize(meshopt_encodeIndexBuffer(corners.data(), corners.size(), flat.data(), flat.size()));
  sequence.resize(meshopt_encodeIndexSequence(sequence.data(), sequence.size(), flat.data(), flat.size()));

  Gltf gltf;
  gltf.json["extensionsRequired"] = {"EXT_meshopt_compression"};
  const auto add = [&](const std::vector<unsigned char>& bytes, const char* mode, size_t count, size_t stride,
                       int component, const char* type) {
    const int compressed = gltf.view(raw(bytes));
    json& views = gltf.json["bufferViews"];
    const json where = views[size_t(compressed)];
    views[size_t(compressed)] = {{"buffer", 1},
                                 {"byteLength", count * stride},
                                 {"extensions",
                                  {{"EXT_meshopt_compression",
                                    {{"buffer", 0},
                                     {"byteOffset", where["byteOffset"]},
                                     {"byteLength", where["byteLength"]},
                                     {"byteStride", stride},
                                     {"mode", mode},
                                     {"count", count}}}}}};
    if (mode[0] == 'A') views[size_t(compressed)]["byteStride"] = stride;
    gltf.json["accessors"].push_back(
        {{"bufferView", compressed}, {"componentType", component}, {"type", type}, {"count", count}});
  };
  add(encode(ball.positions.data(), sizeof(mesh::Float3)), "ATTRIBUTES", vertices, 12, 5126, "VEC3");
  add(corners, "TRIANGLES", flat.size(), 4, 5125, "SCALAR");
  add(sequence, "INDICES", flat.size(), 4, 5125, "SCALAR");
  gltf.mesh(0, 1);
  gltf.mesh(0, 2);
  add(encode(exponential.data(), sizeof(mesh::Float3)), "ATTRIBUTES", vertices, 12, 5126, "VEC3");
  gltf.json["bufferViews"].back()["extensions"]["EXT_meshopt_compression"]["filter"] = "EXPONENTIAL";
  add(encode(quantised.data(), sizeof quantised[0]), "ATTRIBUTES", vertices, 8, 5122, "VEC3");
  gltf.mesh(3, 1);
  gltf.mesh(4, 1);
  gltf.more_buffers = {{{"byteLength", 1000000}}};  // filled by a decoder
  const Scene scene = mesh::read("a.glb", gltf.glb());
  ASSERT_EQ(scene.meshes.size(), 4u);
  EXPECT_EQ(scene.meshes[0].positions, ball.positions);
  for (size_t i = 0; i < vertices; ++i)
    for (size_t k = 0; k < 3; ++k) {
      EXPECT_NEAR(scene.meshes[2].positions[i][k], ball.positions[i][k], 1e-5);
      EXPECT_EQ(scene.meshes[3].positions[i][k], float(quantised[i][k]));
    }
  EXPECT_EQ(scene.meshes[1].triangles, ball.triangles) << "a sequence is kept as it is";
  EXPECT_EQ(scene.meshes[0].triangles.size(), ball.triangles.size());
  EXPECT_NEAR(signed_volume(scene.meshes[0]), signed_volume(ball), 1e-6);

  const auto refused = [&](const char* key, const json& value, const char* fragment) {
    Gltf bad = gltf;
    bad.json["bufferViews"][0]["extensions"]["EXT_meshopt_compression"][key] = value;
    try {
      mesh::read("a.glb", bad.glb());
      ADD_FAILURE() << key << ' ' << value;
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find(fragment), std::string::npos) << error.what();
    }
  };
  refused("mode", "SPHERES", "unknown mode 'SPHERES'");
  refused("byteStride", 10, "elements of 10 bytes");
  refused("count", 1000000000, "more than");
  refused("count", -1, "lacks count");
  refused("byteLength", 100, "cannot be decoded");
  refused("byteLength", 2000000000, "spans 2000000000 bytes");
  refused("buffer", 7, "buffer 7");
  refused("filter", "QUATERNION", "does not fit");
}

TEST(Gltf, LeavesOutWhatNoSceneShows) {
  Gltf gltf = gltf_of(cube());
  gltf.mesh(gltf.positions(kSquare), -1, "unused");
  const Scene scene = read_glb(gltf);
  EXPECT_EQ(scene.meshes.size(), 1u);
  ASSERT_EQ(scene.notes.size(), 1u);
  EXPECT_NE(scene.notes[0].text.find("mesh 1 is not in the scene"), std::string::npos);
}

TEST(Gltf, KeepsTheHierarchyOfItsInstances) {
  Gltf gltf;
  const int shape = gltf.mesh(gltf.positions(kSquare), gltf.indices({0, 1, 2}), "shape");
  gltf.node({{"mesh", shape}, {"name", "leaf"}});
  gltf.node({{"children", {0, 3}}, {"scale", {-1, 1, 1}}});
  gltf.node({{"children", {1, 4}}, {"name", "root"}});
  gltf.node({{"mesh", shape}});
  gltf.node({{"name", "carries nothing"}});
  gltf.scene({2});
  const Scene scene = read_glb(gltf);
  ASSERT_EQ(scene.nodes.size(), 4u);
  const std::vector<std::tuple<uint32_t, std::string, uint32_t>> wanted{
      {2, "root", mesh::kNoNode}, {1, "", 0}, {0, "leaf", 1}, {3, "", 1}};
  for (size_t i = 0; i < wanted.size(); ++i)
    EXPECT_EQ(std::tuple(scene.nodes[i].number, scene.nodes[i].name, scene.nodes[i].parent), wanted[i]) << i;
  ASSERT_EQ(scene.instances.size(), 2u);
  EXPECT_EQ(scene.instances[0].node, 2u);
  EXPECT_EQ(scene.instances[1].node, 3u);
  EXPECT_EQ(scene.instances[1].name, "shape");
  EXPECT_EQ(scene.instances[0].transform, (mesh::Transform{-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}));
}

TEST(Gltf, ExtensionsOfAppearanceDoNotMatter) {
  Gltf gltf = gltf_of(cube());
  gltf.json["extensionsRequired"] = {"KHR_texture_transform", "KHR_materials_unlit"};
  EXPECT_EQ(read_glb(gltf).meshes.size(), 1u);
}

}  // namespace
}  // namespace nif::test
