// Each way to be broken has a status of its own and a sentence that names the file and the place.
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <fstream>
#include <thread>

#include "formats/mesh/read.hpp"
#include "tests/mesh/encode.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

using mesh::ReadLimits;
using nlohmann::json;

void expect_refusal(const std::filesystem::path& file, Status status, const std::string& fragment = "",
                    const ReadLimits& limits = {}) {
  try {
    mesh::read(file, limits);
    ADD_FAILURE() << file << " was read";
  } catch (const Error& error) {
    const std::string sentence = error.what();
    EXPECT_EQ(error.status(), status) << sentence;
    EXPECT_NE(sentence.find(file.filename().string()), std::string::npos) << sentence;
    EXPECT_NE(sentence.find(fragment), std::string::npos) << sentence;
    EXPECT_FALSE(sentence.ends_with('.')) << sentence;
    EXPECT_EQ(sentence.find('\n'), std::string::npos) << sentence;
  }
}

class Errors : public testing::Test {
 protected:
  void refused(const std::string& name, std::string_view bytes, Status status,
               const std::string& fragment = "", const ReadLimits& limits = {}) {
    expect_refusal(folder_.write(name, bytes), status, fragment, limits);
  }
  TempDir folder_;
};

std::string ply(const std::string& vertices, const std::string& faces, int vertex_count = 3,
                int face_count = 1) {
  return "ply\nformat ascii 1.0\nelement vertex " + std::to_string(vertex_count) +
         "\nproperty float x\nproperty float y\nproperty float z\nelement face " +
         std::to_string(face_count) + "\nproperty list uchar int vertex_indices\nend_header\n" + vertices +
         faces;
}
const std::string kPoints = "0 0 0\n1 0 0\n0 1 0\n";

TEST_F(Errors, Files) {
  expect_refusal(folder_.path() / "none.ply", Status::file_not_found, "no such file");
  expect_refusal(folder_.path() / "none" / "none.ply", Status::file_not_found);
  expect_refusal(folder_.path(), Status::file_unreadable, "folder");
  expect_refusal("/dev/zero", Status::file_unreadable);
  refused("a.ply", "", Status::file_empty, "empty");
  refused("a.ply.gz", gzip(""), Status::file_empty);
  if (::geteuid() != 0) {  // root may read everything
    const auto locked = folder_.write("locked.ply", ply_text(cube()));
    std::filesystem::permissions(locked, std::filesystem::perms::none);
    expect_refusal(locked, Status::file_unreadable);
  }
}

/// An untrusted file must neither wait for a pipe nor read endless data from the kernel.
TEST_F(Errors, FilesThatGltfNames) {
  ASSERT_EQ(::mkfifo((folder_.path() / "pipe").c_str(), 0600), 0);
  for (const char* uri : {"pipe", "/dev/stdin", "/dev/zero", "/proc/self/maps", "."})
    refused("a.gltf", gltf_of(cube()).gltf(uri), Status::file_unreadable, "cannot be read");
}

TEST_F(Errors, Strangers) {
  refused("a.txt", "hello world", Status::not_a_mesh, "not in a known mesh format");
  refused("a.obj", "hello world", Status::not_a_mesh);
  refused("a.ply", "hello world", Status::not_a_mesh);
  refused("a.off", "hello world", Status::not_a_mesh);
  refused("a.stl", std::string(2000, 'x'), Status::not_a_mesh);
  refused("a.glb", "hello world", Status::not_a_mesh);
  refused("a.gltf", "{\"hello\": 1}", Status::not_a_mesh, "not glTF");
  refused("a.gltf", R"({"asset": {"version": "1.0"}})", Status::not_a_mesh, "glTF 1.0");
  refused("a.nif", "\xABNIF 10\xBB\r\n\x1A\n", Status::not_a_mesh, "baked");
  refused("a.nif", "NetImmerse File Format, Version 4.0.0.2\n", Status::foreign_nif, "NetImmerse");
  refused("a.nif", "Gamebryo File Format, Version 20.0.0.5\n", Status::foreign_nif);
  refused("a.off", "4OFF\n1 1 1\n0 0 0 0\n", Status::not_a_mesh);
  refused("a.off", "OFF BINARY\n....", Status::not_a_mesh, "binary");
}

TEST_F(Errors, Truncation) {
  refused("a.ply", "ply\nformat ascii 1.0\nelement vertex 3\n", Status::file_truncated, "end_header");
  refused("a.ply", ply(kPoints, ""), Status::file_truncated);
  refused("a.ply", ply(kPoints, "3 0 1"), Status::file_truncated, "'face' 0 of 1");
  refused("a.ply", ply(kPoints, "3 0 1 2", 3, 2000000000), Status::file_truncated, "2000000000");
  std::string binary = ply_binary(cube());
  refused("a.ply", binary.substr(0, binary.size() - 1), Status::file_truncated, "'face' 11 of 12");
  binary = stl_binary(cube());
  refused("a.stl", binary.substr(0, binary.size() - 1), Status::file_truncated, "12 triangles");
  refused("a.stl", std::string_view(binary).substr(0, 50), Status::file_truncated);
  const std::string text = stl_text(cube());
  refused("a.stl", text.substr(0, text.size() / 2), Status::file_truncated, "endsolid");
  refused("a.off", "OFF\n4 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2", Status::file_truncated);
  refused("a.off", "OFF\n4000000000 1 0\n0 0 0\n", Status::file_truncated);
  const std::string glb = gltf_of(cube()).glb();
  refused("a.glb", glb.substr(0, glb.size() - 4), Status::file_truncated);
  refused("a.gltf", gltf_of(cube()).embedded().substr(0, 300), Status::file_truncated, "byte 300");
  const std::string packed = gzip(text), packed2 = zstd(text);
  refused("a.stl.gz", packed.substr(0, packed.size() - 9), Status::file_truncated, "gzip");
  refused("a.stl.zst", packed2.substr(0, packed2.size() - 1), Status::file_truncated, "Zstandard");
}

TEST_F(Errors, Contradictions) {
  refused("a.ply", ply("0 zero 0\n", "", 1, 0), Status::malformed_mesh, "'vertex' 0 of 1 has 'zero'");
  refused("a.ply", "ply\nproperty float x\nend_header\n", Status::malformed_mesh, "line 2");
  refused("a.ply", "ply\nformat ascii 1.0\nelement vertex -1\nend_header\n", Status::malformed_mesh,
          "line 3");
  refused("a.ply", "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nend_header\n",
          Status::malformed_mesh);
  refused("a.ply", "ply\nformat ascii 1.0\nelement face 0\nend_header\n", Status::malformed_mesh);
  refused("a.ply", "ply\nformat klingon 1.0\nend_header\n", Status::malformed_mesh, "klingon");
  refused("a.obj", "v 0 0\nf 1 1 1\n", Status::malformed_mesh, "line 1");
  refused("a.obj", "v 0 0 0\nf 1 x 1\n", Status::malformed_mesh, "line 2");
  refused("a.stl", "solid a\nfacet normal 0 0 0\nouter loop\nvertex 0 0 0\nendloop\n", Status::malformed_mesh,
          "line 5");
  refused("a.off", "OFF\n1 1 0\n0 0 nought\n3 0 0 0\n", Status::malformed_mesh, "line 3");
  refused("a.drc", "DRACO but not really", Status::malformed_mesh);
  std::string packed = gzip(ply_text(icosphere(3)));
  packed[packed.size() / 2] ^= 0x55;
  refused("a.ply.gz", packed, Status::malformed_mesh, "gzip");
}

TEST_F(Errors, NoTriangles) {
  refused("a.ply", ply(kPoints, "", 3, 0), Status::no_triangles);
  refused("a.obj", "v 0 0 0\n", Status::no_triangles);
  refused("a.stl", stl_binary({}), Status::no_triangles);
  refused("a.stl", "solid a\nendsolid a\n", Status::no_triangles);
  refused("a.stl", stl_binary({}) + std::string(70, '\1'), Status::no_triangles, "the 70 bytes that follow");
  refused("a.ply",
          "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
          "element face 1\nproperty list uchar int indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
          Status::no_triangles, "'face' or 'tristrips', but 'indices' in 'face'");
  refused("a.off", "OFF\n1 0 0\n0 0 0\n", Status::no_triangles);
  refused("a.drc", draco_points(cube()), Status::no_triangles, "point cloud");
  refused("a.gltf", R"({"asset": {"version": "2.0"}})", Status::no_triangles);
}

TEST_F(Errors, NonFiniteVertices) {
  refused("a.ply", ply("0 0 0\n1 0 0\n0 nan 0\n", "3 0 1 2\n"), Status::non_finite_vertex,
          "vertex 2 of mesh 'a'");
  refused("a.obj", "v 0 0 0\nv 1e39 0 0\nv 0 1 0\nf 1 2 3\n", Status::non_finite_vertex, "vertex 1");
  refused("a.obj", "v 0 0 0\nv 1.#QNAN 0 0\nv 0 1 0\nf 1 2 3\n", Status::non_finite_vertex, "vertex 1");
  refused("a.off", "OFF\n3 1 0\n-inf 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", Status::non_finite_vertex);
  mesh::Mesh bad = cube();
  bad.positions[3][1] = std::numeric_limits<float>::infinity();
  refused("a.stl", stl_text(bad), Status::non_finite_vertex);
  refused("b.stl", stl_binary(bad), Status::non_finite_vertex);
  refused("a.glb", gltf_of(bad).glb(), Status::non_finite_vertex, "'cube'");
}

/// A repair reads the rest of such a file.
TEST_F(Errors, NonFiniteVerticesMayBeDropped) {
  mesh::Mesh bad = cube();
  bad.positions[3][1] = std::numeric_limits<float>::quiet_NaN();
  const auto uses = uint64_t(std::count_if(bad.triangles.begin(), bad.triangles.end(), [](const auto& t) {
    return std::find(t.begin(), t.end(), 3u) != t.end();
  }));
  for (const auto& [name, bytes] : {std::pair{"a.ply", ply_text(bad)}, std::pair{"b.ply", ply_binary(bad)},
                                    std::pair{"a.obj", obj_text(bad)}, std::pair{"a.off", off_text(bad)},
                                    std::pair{"a.stl", stl_text(bad)}, std::pair{"b.stl", stl_binary(bad)},
                                    std::pair{"a.glb", gltf_of(bad).glb()}}) {
    const mesh::Scene scene = mesh::read(folder_.write(name, bytes), {.drop_non_finite = true});
    EXPECT_EQ(scene.meshes.at(0).triangles.size(), 12 - uses) << name;
    ASSERT_EQ(scene.notes.size(), 1u) << name;
    EXPECT_EQ(scene.notes[0].kind, mesh::NoteKind::non_finite_faces);
    EXPECT_NE(scene.notes[0].text.find(std::to_string(uses) + " triangles that use"), std::string::npos)
        << scene.notes[0].text;
  }
  // An object without remaining triangles is dropped, with its instance; a file without other objects is
  // refused.
  const std::string first = "v nan 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\no a\nf 1 2 3\n";
  const mesh::Scene scene =
      mesh::read(folder_.write("two.obj", first + "o b\nf 2 3 4\n"), {.drop_non_finite = true});
  ASSERT_EQ(scene.meshes.size(), 1u);
  EXPECT_EQ(scene.meshes[0].name, "b");
  ASSERT_EQ(scene.instances.size(), 1u);
  EXPECT_EQ(scene.instances[0].mesh, 0u);
  try {
    mesh::read(folder_.write("one.obj", first), {.drop_non_finite = true});
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.status(), Status::non_finite_vertex);
  }
}

TEST_F(Errors, IndicesOutOfRange) {
  refused("a.ply", ply(kPoints, "3 0 1 3\n"), Status::index_out_of_range, "vertex 3");
  refused("a.ply", ply(kPoints, "3 0 1 -1\n"), Status::index_out_of_range, "'face' 0");
  refused("a.obj", "v 0 0 0\nf 1 2 1\n", Status::index_out_of_range, "triangle 0");
  refused("a.obj", "v 0 0 0\no a\nf 1 1 1\no b\nf 1 2 1\n", Status::index_out_of_range, "triangle 1");
  refused("a.obj", "v 0 0 0\nf 1 -2 1\n", Status::index_out_of_range, "line 2");
  refused("a.obj", "v 0 0 0\nf 0 1 1\n", Status::index_out_of_range, "line 2");
  refused("a.obj", "v 0 0 0\nf 1 9223372036854775807 1\n", Status::index_out_of_range, "line 2");
  refused("a.off", "OFF\n1 1 0\n0 0 0\n3 0 0 1\n", Status::index_out_of_range, "line 4");
  mesh::Mesh bad = cube();
  bad.triangles[4][2] = 8;
  refused("a.glb", gltf_of(bad).glb(), Status::index_out_of_range, "index 14");
}

TEST_F(Errors, Limits) {
  const std::string text = ply_text(cube());
  refused("a.ply.gz", gzip(text), Status::too_large, "limit", {.max_decompressed_bytes = text.size() - 1});
  refused("a.ply.zst", zstd(text), Status::too_large, "limit", {.max_decompressed_bytes = text.size() - 1});
  refused("a.ply", text, Status::too_large, "limit", {.max_decompressed_bytes = text.size() - 1});
  refused("a.zst", zstd(std::string(100 << 20, ' ')), Status::too_large, "",
          {.max_decompressed_bytes = 1 << 20});
  EXPECT_EQ(
      mesh::read(folder_.write("b.gz", gzip(text)), {.max_decompressed_bytes = text.size()}).meshes.size(),
      1u);
  const ReadLimits eleven{.max_triangles = 11};
  for (const auto& [name, bytes] :
       {std::pair{"a.ply", text}, std::pair{"b.ply", ply_binary(cube())},
        std::pair{"a.obj", obj_text(cube())}, std::pair{"a.off", off_text(cube())},
        std::pair{"a.stl", stl_text(cube())}, std::pair{"b.stl", stl_binary(cube())},
        std::pair{"a.drc", draco(cube())}, std::pair{"a.glb", gltf_of(cube()).glb()}}) {
    refused(name, bytes, Status::too_large, "11 triangles", eleven);
  }
}

TEST_F(Errors, GltfBuffersAndExtensions) {
  Gltf gltf = gltf_of(cube());
  refused("a.gltf", gltf.gltf("gone.bin"), Status::missing_buffer, "gone.bin");
  refused("a.gltf", gltf.gltf("https://example.org/a.bin"), Status::missing_buffer, "example.org");
  refused("a.gltf", gltf.gltf("data:text/plain,abc"), Status::malformed_mesh, "base64");
  folder_.write("short.bin", gltf.data.substr(1));
  refused("a.gltf", gltf.gltf("short.bin"), Status::file_truncated, "short.bin");
  json without = json::parse(gltf.embedded());
  without["buffers"][0].erase("uri");
  refused("a.gltf", without.dump(), Status::missing_buffer, "buffer 0");
  without["bufferViews"][0]["extensions"]["KHR_meshopt_compression"] = json::object();
  refused("a.gltf", without.dump(), Status::unsupported_extension, "KHR_meshopt_compression");
  gltf.json["extensionsRequired"] = {"KHR_materials_unlit", "KHR_meshopt_compression"};
  refused("a.glb", gltf.glb(), Status::unsupported_extension, "KHR_meshopt_compression");
}

TEST_F(Errors, GltfStructure) {
  const auto broken = [&](const char* pointer, const json& value, Status status = Status::malformed_mesh) {
    Gltf gltf = gltf_of(cube());
    gltf.json[json::json_pointer(pointer)] = value;
    SCOPED_TRACE(pointer);
    refused("a.glb", gltf.glb(), status);
  };
  broken("/accessors/0/bufferView", 7);
  broken("/accessors/0/byteOffset", 4);
  broken("/accessors/0/byteOffset", 18446744073709551615u);
  broken("/accessors/0/count", 9);
  broken("/accessors/0/count", 4294967295u);
  broken("/accessors/0/count", 1u << 31);
  broken("/accessors/0/type", "VEC4");
  broken("/accessors/0/componentType", 5125);
  broken("/accessors/1/componentType", 5126);
  broken("/accessors/1/type", "VEC3");
  broken("/accessors/0/sparse", {{"count", -1}});
  broken("/bufferViews/0/buffer", 3);
  broken("/bufferViews/0/byteOffset", 1u << 30);
  broken("/bufferViews/0/byteLength", 1u << 30);
  broken("/bufferViews/0/byteStride", 4);
  broken("/meshes/0/primitives/0/mode", 12);
  broken("/meshes/0/primitives/0/indices", 55);
  broken("/meshes/0/primitives/0/attributes/POSITION", 55);
  broken("/nodes/0/mesh", 4);
  broken("/nodes/0/children", {0});
  broken("/nodes/0/children", {9});
  broken("/nodes/0/scale", {1e300, 1e300, 1e300});
  broken("/scenes/0/nodes", {5});
  broken("/scene", 5);
  broken("/meshes/0/primitives/0/extensions/KHR_draco_mesh_compression", {{"bufferView", 9}});
  broken("/meshes/0/primitives/0/extensions/KHR_draco_mesh_compression",
         {{"bufferView", 0}, {"attributes", {{"POSITION", 0}}}});
}

TEST_F(Errors, GltfDepth) {
  Gltf gltf = gltf_of(cube());
  for (int i = 1; i < 100000; ++i) gltf.json["nodes"].push_back({{"children", {i - 1}}});
  gltf.json["scenes"][0]["nodes"] = {99999};
  EXPECT_EQ(mesh::read(folder_.write("deep.glb", gltf.glb())).instances.size(), 1u);
  gltf = gltf_of(cube());
  std::string text = gltf.embedded();
  text.insert(1, "\"extras\": " + std::string(1000000, '[') + std::string(1000000, ']') + ",");
  refused("a.gltf", text, Status::malformed_mesh, "nests");
  gltf.json["nodes"] = {{{"children", {1}}}, {{"children", {0}}}};
  gltf.json.erase("scenes");
  refused("a.glb", gltf.glb(), Status::malformed_mesh, "cycle");
}

TEST_F(Errors, FilesThatChangeWhileTheyAreRead) {
  const std::filesystem::path file = folder_.write("growing.obj", std::string(size_t{16} << 20, '\n'));
  std::atomic<bool> stop{false};
  std::thread writer([&] {
    std::ofstream out(file, std::ios::app);
    while (!stop) out.put('\n').flush();
  });
  bool seen = false;
  for (int i = 0; i < 100 && !seen; ++i) {  // the writer may miss some of them
    try {
      mesh::read(file);
      ADD_FAILURE() << "it has no triangles";
    } catch (const Error& error) {
      seen = error.status() == Status::file_unreadable &&
             std::string(error.what())
                 .ends_with("growing.obj: changed while it was read; try again once it is complete");
    }
  }
  stop = true;
  writer.join();
  EXPECT_TRUE(seen);
  expect_refusal(file, Status::not_a_mesh);  // it is complete now
}

}  // namespace
}  // namespace nif::test
