// Every format gives back the geometry and the names that were written.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>

#include "formats/mesh/read.hpp"
#include "tests/mesh/encode.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

using mesh::Mesh;
using mesh::Scene;

/// Corner positions in order: equal for two meshes with the same triangles, indexed or not.
std::vector<std::array<mesh::Float3, 3>> corners(const Mesh& mesh) {
  std::vector<std::array<mesh::Float3, 3>> out;
  for (const auto& [a, b, c] : mesh.triangles) {
    out.push_back({mesh.positions[a], mesh.positions[b], mesh.positions[c]});
  }
  return out;
}

Scene read_one(const std::string& name, std::string_view bytes) {
  const TempDir folder;
  Scene scene = mesh::read(folder.write(name, bytes));
  EXPECT_EQ(scene.meshes.size(), 1u);
  EXPECT_EQ(scene.instances.size(), 1u);
  EXPECT_EQ(scene.instances.at(0).transform, mesh::kIdentity);
  EXPECT_EQ(scene.instances.at(0).mesh, 0u);
  return scene;
}

void expect_same(const std::string& file, std::string_view bytes, const Mesh& wanted,
                 const std::string& name) {
  const Scene scene = read_one(file, bytes);
  EXPECT_EQ(scene.meshes[0].positions, wanted.positions);
  EXPECT_EQ(scene.meshes[0].triangles, wanted.triangles);
  EXPECT_EQ(scene.meshes[0].name, name);
  EXPECT_TRUE(scene.notes.empty()) << scene.notes[0].text;
}

/// Positions with floats of every kind, so that any rounding shows.
Mesh awkward() {
  Mesh mesh = icosphere(2);
  mesh.positions[0] = {1e-42f, -3.4e38f, 0.1f};
  mesh.positions[1] = {-0.0f, 16777217.0f, 1.17549435e-38f};
  return mesh;
}

TEST(Formats, KeepGeometryExactly) {
  const Mesh mesh = awkward();
  expect_same("a.ply", ply_text(mesh), mesh, "a");
  expect_same("b.PLY", ply_binary(mesh), mesh, "b");
  expect_same("c.ply", ply_binary(mesh, true), mesh, "c");
  expect_same("d.obj", obj_text(mesh), mesh, "icosphere");
  expect_same("e.off", off_text(mesh), mesh, "e");
  expect_same("f.glb", gltf_of(mesh).glb(), mesh, "icosphere");
  expect_same("g.gltf", gltf_of(mesh).embedded(), mesh, "icosphere");
}

TEST(Formats, StlKeepsCornersAndNames) {
  const Mesh mesh = awkward();
  const Scene text = read_one("a.stl", stl_text(mesh));
  EXPECT_EQ(corners(text.meshes[0]), corners(mesh));
  EXPECT_EQ(text.meshes[0].name, "icosphere");
  const Scene binary = read_one("b.c.stl", stl_binary(mesh));
  EXPECT_EQ(corners(binary.meshes[0]), corners(mesh));
  EXPECT_EQ(binary.meshes[0].name, "b.c");
}

TEST(Formats, BinaryStlMayBeginWithSolidAndHaveTrailingBytes) {
  std::string bytes = stl_binary(cube());
  bytes.replace(0, 12, "solid binary");
  EXPECT_EQ(read_one("a.stl", bytes).meshes[0].triangles.size(), 12u);
  bytes += std::string(7, '\0');
  EXPECT_EQ(read_one("a.stl", bytes).meshes[0].triangles.size(), 12u);
}

TEST(Formats, BinaryStlsThatWereJoinedAreReadInPartWithANote) {
  const TempDir folder;
  const Scene scene = mesh::read(folder.write("a.stl", stl_binary(cube()) + stl_binary(cube())));
  EXPECT_EQ(scene.meshes[0].triangles.size(), 12u);
  ASSERT_EQ(scene.notes.size(), 1u);
  EXPECT_NE(scene.notes[0].text.find("684 bytes follow the 12 triangles"), std::string::npos)
      << scene.notes[0].text;
}

TEST(Formats, EachSolidOfAnStlTextIsAMesh) {
  Mesh first = cube(), second = icosphere(0);
  first.name = "part one";
  second.name = "";
  const TempDir folder;
  const Scene scene = mesh::read(folder.write("two.stl", stl_text(first) + "\n" + stl_text(second)));
  ASSERT_EQ(scene.meshes.size(), 2u);
  EXPECT_EQ(scene.meshes[0].name, "part one");
  EXPECT_EQ(scene.meshes[1].name, "two");
  EXPECT_EQ(scene.meshes[1].triangles.size(), 20u);
  EXPECT_EQ(scene.instances[1].mesh, 1u);
}

TEST(Formats, DracoKeepsTheTriangles) {
  const Mesh mesh = icosphere(2);
  const Scene scene = read_one("ball.drc", draco(mesh));
  auto got = corners(scene.meshes[0]), wanted = corners(mesh);
  // Draco may rotate and reorder triangles.
  for (auto* list : {&got, &wanted}) {
    for (auto& t : *list) std::rotate(t.begin(), std::ranges::min_element(t), t.end());
    std::ranges::sort(*list);
  }
  EXPECT_EQ(got, wanted);
  EXPECT_EQ(scene.meshes[0].name, "ball");
}

TEST(Formats, CompressionIsToldByContent) {
  const Mesh mesh = cube();
  const std::string plain = ply_binary(mesh);
  const auto hash = read_one("a.ply", plain).source_hash;
  for (const std::string& packed :
       {gzip(plain), zstd(plain), gzip(plain.substr(0, 99)) + gzip(plain.substr(99)),
        zstd(plain.substr(0, 99)) + zstd(plain.substr(99))}) {
    for (const char* name : {"a.ply.gz", "a.ply.zst", "a.ply"}) {
      const Scene scene = read_one(name, packed);
      EXPECT_EQ(scene.meshes[0].triangles, mesh.triangles);
      EXPECT_EQ(scene.meshes[0].name, "a");
      EXPECT_EQ(scene.source_hash, hash);
    }
  }
  EXPECT_EQ(read_one("a.obj.gz", gzip(obj_text(mesh))).meshes[0].triangles, mesh.triangles);
  EXPECT_EQ(read_one("a.glb.zst", zstd(gltf_of(mesh).glb())).meshes[0].triangles, mesh.triangles);
}

TEST(Formats, ContentBeatsTheExtension) {
  const Mesh mesh = cube();
  EXPECT_EQ(read_one("a.obj", ply_text(mesh)).meshes[0].triangles.size(), 12u);
  EXPECT_EQ(read_one("a", stl_binary(mesh)).meshes[0].triangles.size(), 12u);
  EXPECT_EQ(read_one("a.ply", gltf_of(mesh).glb()).meshes[0].triangles.size(), 12u);
  EXPECT_EQ(read_one("a.dat", off_text(mesh)).meshes[0].triangles.size(), 12u);
}

TEST(Formats, SourceHashDependsOnEveryByte) {
  const std::string bytes = ply_text(cube());
  std::string other = bytes;
  other[other.find("comment") + 8] = 'T';
  EXPECT_NE(read_one("a.ply", bytes).source_hash, read_one("a.ply", other).source_hash);
  EXPECT_NE(read_one("a.ply", bytes).source_hash, 0u);
}

TEST(Ply, AnyLayoutOfPropertiesIsFollowed) {
  const std::string text =
      "ply\r\nformat ascii 1.0\r\nobj_info x\r\nelement camera 2\r\nproperty list uchar float values\r\n"
      "property int id\r\nelement vertex 4\r\nproperty uchar red\r\nproperty double z\r\nproperty int y\r\n"
      "property list uchar int tags\r\nproperty float x\r\nelement face 2\r\nproperty int flags\r\n"
      "property list uint uint vertex_index\r\nproperty list uchar float texcoord\r\nelement edge 1\r\n"
      "property int a\r\nend_header\r\n2 0.5 0.5 7\r\n0 8\r\n"
      "255 0 0 2 5 6 0\r\n255 0 0 0 1\r\n255 0 1 0 1\r\n255 0 1 1 9 0\r\n"
      "1 4 0 1 2 3 8 0 0 1 0 1 1 0 1\r\n1 3 0 1 2 0\r\n4\r\n";
  const Scene scene = read_one("a.ply", text);
  const std::vector<mesh::Float3> positions{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  const std::vector<mesh::Triangle> triangles{{0, 1, 2}, {0, 2, 3}, {0, 1, 2}};
  EXPECT_EQ(scene.meshes[0].positions, positions);
  EXPECT_EQ(scene.meshes[0].triangles, triangles);
}

TEST(Ply, BinaryLayoutsAreFollowed) {
  std::string bytes =
      "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty double x\nproperty short y\nproperty "
      "float z\n"
      "property list uchar ushort tags\nelement face 1\nproperty uchar flags\nproperty list ushort ushort "
      "vertex_indices\n"
      "property list uchar float texcoord\nend_header\n";
  const auto vertex = [&](double x, int16_t y, float z) {
    bytes += raw(std::vector{x}) + raw(std::vector{y}) + raw(std::vector{z}) + '\1' +
             raw(std::vector<uint16_t>{7});
  };
  vertex(0, 0, 0.5f);
  vertex(0.1, 0, 0.5f);
  vertex(0, -2, 0.5f);
  bytes += '\0' + raw(std::vector<uint16_t>{3, 0, 1, 2}) + '\2' + raw(std::vector<float>{0, 1});
  const Scene scene = read_one("a.ply", bytes);
  const std::vector<mesh::Float3> positions{{0, 0, 0.5f}, {0.1f, 0, 0.5f}, {0, -2, 0.5f}};
  EXPECT_EQ(scene.meshes[0].positions, positions);
  EXPECT_EQ(scene.meshes[0].triangles, (std::vector<mesh::Triangle>{{0, 1, 2}}));
}

TEST(Ply, StripsBecomeTriangles) {
  const Scene scene = read_one("a.ply",
                               "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\n"
                               "property float z\nelement tristrips 1\nproperty list int int vertex_indices\n"
                               "end_header\n0 0 0\n0 1 0\n1 0 0\n1 1 0\n2 0 0\n9 0 2 1 3 -1 2 4 3 -1\n");
  EXPECT_EQ(scene.meshes[0].triangles, (std::vector<mesh::Triangle>{{0, 2, 1}, {1, 2, 3}, {2, 4, 3}}));
}

TEST(Obj, ReadsRelativeIndicesPolygonsAndJoinedLines) {
  const Scene scene =
      read_one("a.obj",
               "# comment\nmtllib /dev/zero\nv 0 0 0 1 1 1\nv 1 0 0\nvn 0 0 1\nv 1 1 0\nv 0 1 0\ng a b\n"
               "usemtl m\ns off\nf 1/1/1 2//1 3/2 4\nf -4 -3 \\\n-2\nf 1 2\nl 1 2\n");
  EXPECT_EQ(scene.meshes[0].triangles, (std::vector<mesh::Triangle>{{0, 1, 2}, {0, 2, 3}, {0, 1, 2}}));
  EXPECT_EQ(scene.meshes[0].name, "a");
  EXPECT_EQ(scene.notes.size(), 2u);
}

TEST(Obj, ABackslashJoinsLinesOnlyAsTheLastCharacter) {
  const Scene scene =
      read_one("a.obj", "# from C:\\models\\ \nv 0 0 0\no ends in \\ \nv 1 0 0\nv 0 \\\r\n1 0\nf 1 2 3\n");
  EXPECT_EQ(scene.meshes[0].positions, (std::vector<mesh::Float3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}));
  EXPECT_EQ(scene.meshes[0].name, "ends in \\");
}

TEST(Obj, ObjectsBecomeMeshesWithTheirOwnVertices) {
  const TempDir folder;
  const Scene scene =
      mesh::read(folder.write("a.obj",
                              "v 9 9 9\no left wing\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 4 3 2\no empty\n"
                              "o right\nv 5 0 0\nf 2 5 4\n"));
  ASSERT_EQ(scene.meshes.size(), 2u);
  EXPECT_EQ(scene.meshes[0].name, "left wing");
  EXPECT_EQ(scene.meshes[1].name, "right");
  EXPECT_EQ(scene.meshes[0].positions, (std::vector<mesh::Float3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}));
  EXPECT_EQ(scene.meshes[0].triangles, (std::vector<mesh::Triangle>{{2, 1, 0}}));
  EXPECT_EQ(scene.meshes[1].positions, (std::vector<mesh::Float3>{{0, 0, 0}, {0, 1, 0}, {5, 0, 0}}));
  EXPECT_EQ(scene.meshes[1].triangles, (std::vector<mesh::Triangle>{{0, 2, 1}}));
  EXPECT_EQ(scene.instances[1].name, "right");
}

TEST(Obj, NamesAreMadeValidUtf8) {
  std::string name = "caf\xE9 \xC3\xA9 \x1B[31m";
  const Scene scene = read_one("a.obj", "o " + name + "\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  EXPECT_EQ(scene.meshes[0].name, "caf\xEF\xBF\xBD \xC3\xA9 [31m");
}

TEST(Off, ReadsVariantsAndSkipsAttributes) {
  const std::vector<mesh::Triangle> triangles{{0, 1, 2}, {0, 2, 3}};
  for (const char* text :
       {"OFF 4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3 0.5 0.5 0.5\n",
        "COFF\n4 1 0\n0 0 0 255 0 0 255\n1 0 0 1 1 1 1\n1 1 0 0 0 0 0\n0 1 0 0 0 0 0\n4 0 1 2 3\n",
        "# by hand\nNOFF # normals\n4 1 0\n0 0 0 0 0 1\n1 0 0 0 0 1\n# middle\n1 1 0 0 0 1\n0 1 0 0 0 1\n"
        "4 0 1 2 3",
        "4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n"}) {
    EXPECT_EQ(read_one("a.off", text).meshes[0].triangles, triangles) << text;
  }
}

TEST(Formats, AByteOrderMarkHidesNothing) {
  const std::string mark = "\xEF\xBB\xBF", text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  EXPECT_EQ(read_one("a.obj", mark + text).meshes[0].positions.size(), 3u);
  EXPECT_EQ(read_one("a.gltf", mark + gltf_of(cube()).embedded()).meshes[0].triangles.size(), 12u);
}

TEST(Formats, NonFiniteVerticesThatNothingUsesAreIgnored) {
  const Scene scene = read_one("a.obj", "v nan 0 0\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 2 3 4\n");
  EXPECT_EQ(scene.meshes[0].triangles.size(), 1u);
}

std::string with_ends(const std::string& text, std::string_view end) {
  std::string out;
  for (const char c : text) c == '\n' ? out += end : out += c;
  return out;
}

std::string refusal_of(const std::string& name, const std::string& text) {
  try {
    mesh::read(name, text);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(Formats, LinesEndAsTheyLike) {
  const std::string obj = "# all\nv 0 0 0\nv 1 0 \\\n0\nv 0 1 0 # here\no a b\nf 1 2 3\n";
  const std::string off = "OFF # key\n# all\n3 1 0\n0 0 0 9 9\n1 0 0\n0 1 0 # last\n3 0 1 2 7\n";
  for (const std::string end : {"\n", "\r", "\r\n"}) {
    SCOPED_TRACE(end.size() == 2 ? "CR LF" : end == "\r" ? "CR" : "LF");
    const Scene a = read_one("a.obj", with_ends(obj, end));
    EXPECT_EQ(a.meshes[0].name, "a b");
    EXPECT_EQ(a.meshes[0].triangles, (std::vector<mesh::Triangle>{{0, 1, 2}}));
    EXPECT_EQ(a.meshes[0].positions[1], (mesh::Float3{1, 0, 0}));
    EXPECT_EQ(read_one("a.off", with_ends(off, end)).meshes[0].triangles, a.meshes[0].triangles);
    const Mesh solid = read_one("a.stl", with_ends(stl_text(cube()), end)).meshes[0];
    EXPECT_EQ(corners(solid), corners(cube()));
    EXPECT_EQ(solid.name, "cube");
    expect_same("a.ply", with_ends(ply_text(cube()), end), cube(), "a");
    EXPECT_NE(
        refusal_of("a.off", with_ends("OFF\n3 1 0\n0 0 0\n\n1 x 0\n0 1 0\n3 0 1 2\n", end)).find("line 5 "),
        std::string::npos);
    EXPECT_NE(refusal_of("a.obj", with_ends("v 0 0 0\n\nv x 0 0\n", end)).find("line 3 "), std::string::npos);
  }
}

TEST(Ply, HeadersMayMixLineEnds) {
  const std::string text = ply_binary(cube());
  const size_t body = text.find("end_header\n") + 11;
  std::string mixed = text;
  mixed.insert(3, "\r");
  expect_same("a.ply", mixed, cube(), "a");
  // An LF after a CR may end a line or be the first byte of a coordinate.
  Mesh odd = cube();
  odd.positions[0][0] = std::bit_cast<float>(0x3f80000au);
  const std::string bytes = ply_binary(odd).substr(body);
  ASSERT_EQ(bytes[0], '\n');
  for (const char* end : {"\n", "\r", "\r\n"})
    expect_same("a.ply", with_ends(text.substr(0, body), end) + bytes, odd, "a");
}

TEST(Stl, EndsMayBeTwoWords) {
  for (const std::string word : {"loop", "facet", "solid"}) {
    std::string text = stl_text(cube());
    for (size_t at = 0; (at = text.find("end" + word, at)) != text.npos;) text.insert(at + 3, " ");
    EXPECT_EQ(corners(read_one("a.stl", text).meshes[0]), corners(cube())) << word;
  }
}

TEST(Stl, TheLengthCountsWhereTheHeaderDoesNot) {
  const Mesh mesh = cube();
  for (const int count : {0, 7}) {
    std::string bytes = stl_binary(mesh);
    bytes[80] = char(count);
    const Scene scene = mesh::read("a.stl", bytes);
    EXPECT_EQ(corners(scene.meshes.at(0)), corners(mesh));
    ASSERT_EQ(scene.notes.size(), 1u);
    EXPECT_EQ(scene.notes[0].kind, mesh::NoteKind::counted_by_length);
    EXPECT_EQ(scene.notes[0].text, "a.stl: its header counts " + std::to_string(count) +
                                       " triangles, but 12 follow to its end; all were read");
  }
  // The rest are not triangles.
  std::string bytes = stl_binary(mesh);
  bytes[80] = 7;
  EXPECT_EQ(mesh::read("a.stl", bytes + "x").notes.at(0).kind, mesh::NoteKind::bytes_after_end);
  std::fill(bytes.end() - 50, bytes.end(), '\xFF');
  const Scene scene = mesh::read("a.stl", bytes);
  EXPECT_EQ(scene.meshes.at(0).triangles.size(), 7u);
  EXPECT_EQ(scene.notes.at(0).kind, mesh::NoteKind::bytes_after_end);
}

}  // namespace
}  // namespace nif::test
