// Every kind of bad file gives one sentence that names it and its own exit code, and nothing is written.
#include <gtest/gtest.h>
#include <unistd.h>

#include <functional>

#include "formats/base/status.hpp"
#include "formats/nif/writer.hpp"
#include "tests/cli/mesh_text.hpp"
#include "tests/cli/program.hpp"
#include "tests/support/random_asset.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

std::string asset_bytes() {
  const std::vector<std::byte> bytes = format::encode(random_asset(7));
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// Runs a command that must fail. Checks the exit code, the streams, and that the folder is unchanged.
void expect_failure(std::vector<std::string> arguments, Status status, const std::string& named,
                    const std::filesystem::path& folder, const std::string& fragment = "") {
  SCOPED_TRACE(testing::PrintToString(arguments));
  const std::vector<std::string> before = listing(folder);
  const Outcome outcome = nif(arguments);
  EXPECT_EQ(outcome.code, int(status)) << outcome.err;
  EXPECT_EQ(outcome.out, "");
  const std::vector<std::string> lines = without_progress(outcome.err);
  ASSERT_EQ(lines.size(), 1u) << outcome.err;
  EXPECT_NE(lines[0].find(named), std::string::npos) << "'" << named << "' in: " << lines[0];
  EXPECT_NE(lines[0].find(fragment), std::string::npos) << "'" << fragment << "' in: " << lines[0];
  EXPECT_EQ(lines_of(outcome.err).back(), lines[0]) << "the reason comes last";
  EXPECT_TRUE(outcome.err.ends_with('\n'));
  EXPECT_EQ(listing(folder), before);
}

// ---- Meshes -----------------------------------------------------------------------------------------------

struct BadMesh {
  const char* test;
  const char* file;
  std::string bytes;
  Status status;
  const char* place;  ///< what the sentence must say beside the file's name
};
void PrintTo(const BadMesh& bad, std::ostream* out) { *out << bad.file; }

const std::string kCorners = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
const std::string kPlyHeader =
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 1\nproperty list uchar int vertex_indices\nend_header\n";

/// A triangle whose only buffer is `buffer`.
std::string gltf(const std::string& buffer, const std::string& more = "") {
  return R"({"asset":{"version":"2.0"},)" + more + R"("scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
    "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
    "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}],
    "bufferViews":[{"buffer":0,"byteLength":36}],"buffers":[)" +
         buffer + "]}";
}

std::vector<BadMesh> bad_meshes() {
  return {
      {"Empty", "empty.ply", "", Status::file_empty, "empty"},
      {"TruncatedHeader", "header.ply", kPlyHeader.substr(0, 60), Status::file_truncated, ""},
      {"TruncatedVertices", "vertices.ply", kPlyHeader + "0 0 0\n1 0 0\n", Status::file_truncated, "vertex"},
      {"TruncatedGlb", "a.glb", std::string("glTF\2\0\0\0\0\1\0\0", 12), Status::file_truncated, "byte"},
      {"TruncatedGzip", "a.ply.gz", std::string("\x1f\x8b\x08\0\0\0\0\0\0\3", 10), Status::file_truncated,
       "gzip"},
      {"Letter", "letter.txt", "Dear reader,\nthis is no mesh.\n", Status::not_a_mesh, ""},
      {"LetterNamedObj", "letter.obj", "Dear reader,\nthis is no mesh.\n", Status::not_a_mesh, ""},
      {"LetterNamedGlb", "letter.glb", "Dear reader,\nthis is no mesh.\n", Status::not_a_mesh, ".glb"},
      {"Picture", "picture.png", "\x89PNG\r\n\x1a\n", Status::not_a_mesh, ""},
      {"Asset", "asset.nif", asset_bytes(), Status::not_a_mesh, "baked"},
      {"Gamebryo", "model.nif", "Gamebryo File Format, Version 20.0.0.5\n", Status::foreign_nif, "Gamebryo"},
      {"NetImmerse", "model.nif", "NetImmerse File Format, Version 4.0.0.2\n", Status::foreign_nif,
       "NetImmerse"},
      {"Contradiction", "word.ply", kPlyHeader + "0 zero 0\n1 0 0\n0 1 0\n3 0 1 2\n", Status::malformed_mesh,
       "zero"},
      {"NoTriangles", "points.obj", kCorners, Status::no_triangles, "triangles"},
      {"NaN", "nan.ply", kPlyHeader + "0 0 0\n1 0 0\n0 nan 0\n3 0 1 2\n", Status::non_finite_vertex,
       "vertex 2"},
      {"Infinite", "inf.obj", "v 0 0 0\nv 1e39 0 0\nv 0 1 0\nf 1 2 3\n", Status::non_finite_vertex,
       "vertex 1"},
      {"IndexTooLarge", "index.obj", kCorners + "f 1 2 4\n", Status::index_out_of_range, "vertex"},
      {"IndexNegative", "index.ply", kPlyHeader + "0 0 0\n1 0 0\n0 1 0\n3 0 1 -1\n",
       Status::index_out_of_range, ""},
      {"AllDegenerate", "flat.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\nf 1 1 2\n", Status::all_degenerate,
       "area"},
      {"MissingBuffer", "a.gltf", gltf(R"({"byteLength":36,"uri":"gone.bin"})"), Status::missing_buffer,
       "gone.bin"},
      {"Meshopt", "packed.gltf",
       gltf(R"({"byteLength":36,"uri":"gone.bin"})", R"("extensionsRequired":["KHR_meshopt_compression"],)"),
       Status::unsupported_extension, "KHR_meshopt_compression"},
  };
}

class BadMeshes : public testing::TestWithParam<BadMesh> {};

TEST_P(BadMeshes, AreRefusedByBakeAndByEval) {
  const BadMesh& bad = GetParam();
  TempDir folder, assets;
  const std::string mesh = folder.write(bad.file, bad.bytes).string();
  const std::string asset = assets.write("random.nif", asset_bytes()).string();
  expect_failure({"bake", mesh, "-o", (folder.path() / "out.nif").string(), "--preset", "fast"}, bad.status,
                 mesh, folder.path(), bad.place);
  // The random asset belongs to another mesh, but these files are refused before that is checked.
  expect_failure({"eval", asset, "--mesh", mesh}, bad.status, mesh, folder.path());
}

INSTANTIATE_TEST_SUITE_P(All, BadMeshes, testing::ValuesIn(bad_meshes()),
                         [](const auto& instance) { return std::string(instance.param.test); });

TEST(BadFiles, MissingMesh) {
  TempDir folder;
  const std::string mesh = (folder.path() / "none.ply").string(), out = (folder.path() / "out.nif").string();
  expect_failure({"bake", mesh, "-o", out}, Status::file_not_found, mesh, folder.path());
}

TEST(BadFiles, FolderInPlaceOfAMesh) {
  TempDir folder;
  const std::string mesh = folder.path().string(), out = (folder.path() / "out.nif").string();
  expect_failure({"bake", mesh, "-o", out}, Status::file_unreadable, mesh, folder.path(), "folder");
}

TEST(BadFiles, MeshThatMayNotBeRead) {
  if (::geteuid() == 0) GTEST_SKIP() << "root may read every file";
  TempDir folder;
  const std::filesystem::path mesh = folder.write("locked.obj", kCorners + "f 1 2 3\n");
  std::filesystem::permissions(mesh, std::filesystem::perms::none);
  expect_failure({"bake", mesh.string(), "-o", (folder.path() / "out.nif").string()}, Status::file_unreadable,
                 mesh.string(), folder.path());
}

TEST(BadFiles, QuietMeansOneLineAndNoMore) {
  TempDir folder;
  const std::string mesh = (folder.path() / "none.ply").string(), out = (folder.path() / "out.nif").string();
  const Outcome outcome = nif({"bake", mesh, "-o", out, "--quiet", "--json"});
  EXPECT_EQ(outcome.code, int(Status::file_not_found));
  EXPECT_EQ(outcome.out, "");
  EXPECT_EQ(lines_of(outcome.err).size(), 1u) << outcome.err;
}

// ---- Assets -----------------------------------------------------------------------------------------------

struct BadAsset {
  const char* test;
  std::function<std::string()> bytes;
  Status status;
  const char* place;
};
void PrintTo(const BadAsset& bad, std::ostream* out) { *out << bad.test; }

std::string with_byte_changed(size_t from_end) {
  std::string bytes = asset_bytes();
  bytes[bytes.size() - from_end] = static_cast<char>(bytes[bytes.size() - from_end] ^ 0x10);
  return bytes;
}

class BadAssets : public testing::TestWithParam<BadAsset> {};

TEST_P(BadAssets, AreRefusedByWhateverReadsThem) {
  TempDir folder;
  const std::string asset = folder.write("asset.nif", GetParam().bytes()).string();
  const std::string mesh = folder.write("mesh.obj", obj_text(cube())).string();
  for (const std::vector<std::string>& command :
       std::vector<std::vector<std::string>>{{"info", asset},
                                             {"info", asset, "--json"},
                                             {"eval", asset, "--mesh", mesh, "--rays", "1000"},
                                             {"bench", asset, "--mesh", mesh, "--rays", "1000"}}) {
    expect_failure(command, GetParam().status, asset, folder.path(), GetParam().place);
  }
}

INSTANTIATE_TEST_SUITE_P(
    All, BadAssets,
    testing::Values(
        BadAsset{"Empty", [] { return std::string(); }, Status::file_empty, ""},
        BadAsset{"TruncatedHeader", [] { return asset_bytes().substr(0, 40); }, Status::file_truncated, ""},
        BadAsset{"Truncated", [] { return asset_bytes().substr(0, asset_bytes().size() - 1); },
                 Status::file_truncated, ""},
        BadAsset{"NoAsset", [] { return obj_text(cube()); }, Status::not_a_nif, ""},
        BadAsset{"Gamebryo", [] { return std::string("Gamebryo File Format, Version 20.0.0.5\n\0", 40); },
                 Status::foreign_nif, "Gamebryo"},
        BadAsset{"NetImmerse", [] { return std::string("NetImmerse File Format, Version 4.0.0.2\n"); },
                 Status::foreign_nif, "NetImmerse"},
        BadAsset{"ChangedByte", [] { return with_byte_changed(100); }, Status::damaged_nif, ""},
        BadAsset{"TextMode",
                 [] {
                   std::string bytes = asset_bytes();
                   bytes.erase(bytes.find("\r\n"), 1);
                   return bytes;
                 },
                 Status::damaged_nif, ""}),
    [](const auto& instance) { return std::string(instance.param.test); });

TEST(BadFiles, MissingAsset) {
  TempDir folder;
  const std::string asset = (folder.path() / "none.nif").string();
  const std::string mesh = folder.write("mesh.obj", obj_text(cube())).string();
  expect_failure({"info", asset}, Status::file_not_found, asset, folder.path());
  expect_failure({"eval", asset, "--mesh", mesh}, Status::file_not_found, asset, folder.path());
  expect_failure({"info", folder.path().string()}, Status::file_unreadable, folder.path().string(),
                 folder.path());
}

TEST(BadFiles, AssetOfAnotherMesh) {
  TempDir folder;
  const std::string asset = folder.write("asset.nif", asset_bytes()).string();
  const std::string mesh = folder.write("mesh.obj", obj_text(cube())).string();
  expect_failure({"eval", asset, "--mesh", mesh}, Status::mesh_mismatch, asset, folder.path(), mesh);
}

// ---- Outputs ----------------------------------------------------------------------------------------------

class BadOutputs : public testing::Test {
 protected:
  void refused(const std::filesystem::path& output, Status status) {
    expect_failure({"bake", mesh_, "-o", output.string(), "--preset", "fast"}, status, output.string(),
                   folder_.path());
  }
  TempDir folder_;
  std::string mesh_ = folder_.write("mesh.obj", obj_text(cube())).string();
};

TEST_F(BadOutputs, FolderMissing) {
  refused(folder_.path() / "none" / "out.nif", Status::output_folder_missing);
}

TEST_F(BadOutputs, FileInPlaceOfTheFolder) {
  refused(folder_.write("file", "") / "out.nif", Status::output_not_writable);
}

TEST_F(BadOutputs, FolderInPlaceOfTheFile) { refused(folder_.path(), Status::output_not_writable); }

TEST_F(BadOutputs, FolderThatMayNotBeWritten) {
  const std::filesystem::path locked = folder_.path() / "locked";
  std::filesystem::create_directory(locked);
  std::filesystem::permissions(locked,
                               std::filesystem::perms::owner_read | std::filesystem::perms::owner_exec);
  if (::access(locked.c_str(), W_OK) == 0) GTEST_SKIP() << "root may write into every folder";
  refused(locked / "out.nif", Status::output_not_writable);
}

TEST_F(BadOutputs, RefusedBeforeTheMeshIsRead) {
  mesh_ = (folder_.path() / "none.obj").string();
  refused(folder_.path() / "none" / "out.nif", Status::output_folder_missing);
}

TEST_F(BadOutputs, FullStandardOutput) {
  const std::string asset = folder_.write("asset.nif", asset_bytes()).string();
  const Outcome outcome = Process(nif_path(), {"info", asset}, "/dev/full").finish();
  EXPECT_EQ(outcome.code, int(Status::output_not_writable));
  EXPECT_EQ(lines_of(outcome.err).size(), 1u) << outcome.err;
}

}  // namespace
}  // namespace nif::test
