// What the PLY writer writes is what the PLY reader reads, whole or not at all.
#include "formats/mesh/ply_writer.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>

#include "formats/mesh/read.hpp"
#include "tests/support/temp_dir.hpp"

namespace nif::mesh {
namespace {

/// A strip of triangles of any length, on a parabola.
class Strip final : public MeshSource {
 public:
  explicit Strip(uint64_t triangles) : triangles_(triangles) {}
  uint64_t vertex_count() const override { return triangles_ + 2; }
  uint64_t triangle_count() const override { return triangles_; }
  void vertices(uint64_t first, std::span<Float3> out) const override {
    for (Float3& p : out) {
      p = {float(first), float(first % 2), -0.5f * float(first) * float(first)};
      ++first;
    }
  }
  void triangles(uint64_t first, std::span<Triangle> out) const override {
    for (Triangle& t : out) {
      t = {uint32_t(first), uint32_t(first + 1), uint32_t(first + 2)};
      ++first;
    }
  }

 private:
  uint64_t triangles_;
};

/// A source that claims vertices but has none.
class Endless final : public MeshSource {
 public:
  uint64_t vertex_count() const override { return uint64_t{1} << 31; }
  uint64_t triangle_count() const override { return 0; }
  void vertices(uint64_t, std::span<Float3>) const override {}
  void triangles(uint64_t, std::span<Triangle>) const override {}
};

const std::atomic<bool> kGoOn{false};

TEST(PlyWriter, WritesWhatTheReaderReads) {
  const test::TempDir folder;
  const std::string file = folder.path() / "strip.ply";
  for (const uint64_t triangles : {1, 2, 16'382, 16'384, 50'000}) {
    const Strip strip(triangles);
    double last = 0;
    const PlyFile written = write_ply(
        file, strip, "made of a formula",
        [&](double fraction) {
          EXPECT_GT(fraction, last);
          last = fraction;
        },
        kGoOn);
    EXPECT_EQ(last, 1);
    EXPECT_EQ(written.bytes, std::filesystem::file_size(file));
    EXPECT_EQ(written.low, (Float3{0, 0, -0.5f * float(triangles + 1) * float(triangles + 1)}));
    EXPECT_EQ(written.high, (Float3{float(triangles + 1), 1, 0}));
    EXPECT_NE(test::read_bytes(file).find("\ncomment made of a formula\n"), std::string::npos);

    const Scene scene = read(file);
    ASSERT_EQ(scene.meshes.size(), 1u);
    const Mesh& mesh = scene.meshes[0];
    ASSERT_EQ(mesh.positions.size(), strip.vertex_count());
    ASSERT_EQ(mesh.triangles.size(), strip.triangle_count());
    std::vector<Float3> positions(mesh.positions.size());
    std::vector<Triangle> indices(mesh.triangles.size());
    strip.vertices(0, positions);
    strip.triangles(0, indices);
    EXPECT_TRUE(mesh.positions == positions);
    EXPECT_TRUE(mesh.triangles == indices);
  }
}

TEST(PlyWriter, LeavesNothingWhereItIsCancelled) {
  const test::TempDir folder;
  const std::filesystem::path kept = folder.write("kept.ply", "what was there before");
  std::atomic<bool> cancel{false};
  try {
    write_ply(
        kept, Strip(2'000'000), "", [&](double fraction) { cancel = fraction > 0.3; }, cancel);
    ADD_FAILURE() << "not cancelled";
  } catch (const Error& error) {
    EXPECT_EQ(error.status(), Status::interrupted);
  }
  EXPECT_EQ(test::read_bytes(kept), "what was there before");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1);
}

TEST(PlyWriter, FailsByName) {
  const test::TempDir folder;
  const auto status = [&](const std::string& path, const MeshSource& source) {
    try {
      write_ply(
          path, source, "", [](double) {}, kGoOn);
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find(path), std::string::npos) << error.what();
      return error.status();
    }
    return Status::ok;
  };
  EXPECT_EQ(status(folder.path() / "no" / "a.ply", Strip(9)), Status::output_folder_missing);
  EXPECT_EQ(status(folder.path(), Strip(9)), Status::output_not_writable);
  EXPECT_EQ(status(folder.path() / "a.ply", Endless()), Status::too_large);
  EXPECT_EQ(status("/dev/null", Strip(100'000)), Status::ok);
  if (std::filesystem::exists("/dev/full")) {
    EXPECT_EQ(status("/dev/full", Strip(100'000)), Status::output_not_writable);
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

}  // namespace
}  // namespace nif::mesh
