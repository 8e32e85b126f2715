// Generated meshes are closed, face outwards, have as many triangles as they say, and depend on the request
// alone.
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <set>

#include "formats/mesh/clean.hpp"
#include "formats/mesh/ply_writer.hpp"
#include "formats/mesh/read.hpp"
#include "mesh/generate/shape.hpp"
#include "mesh/generate/turn.hpp"
#include "tests/support/surfaces.hpp"
#include "tests/support/temp_dir.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::generate {
namespace {

std::vector<std::string> names() {
  std::vector<std::string> all;
  for (const Shape& shape : shapes()) all.emplace_back(shape.name);
  return all;
}

mesh::Mesh whole(const mesh::MeshSource& source) {
  mesh::Mesh mesh;
  mesh.positions.resize(source.vertex_count());
  mesh.triangles.resize(source.triangle_count());
  source.vertices(0, mesh.positions);
  source.triangles(0, mesh.triangles);
  return mesh;
}

class Generated : public testing::TestWithParam<std::string> {
 protected:
  static mesh::Mesh make(uint64_t triangles, uint64_t seed = 1) {
    return whole(*make_shape(GetParam(), {triangles, seed}));
  }
};

TEST_P(Generated, IsClosedAndFacesOutwards) {
  for (const auto& [triangles, seed] :
       {std::pair{150, 1}, {151, 2}, {1'000, 3}, {10'001, 4}, {10'000, 5}, {77'777, 6}, {100'000, 1}}) {
    SCOPED_TRACE(testing::Message() << triangles << " triangles, seed " << seed);
    const mesh::Mesh mesh = make(uint64_t(triangles), uint64_t(seed));
    std::set<uint32_t> used;
    for (const mesh::Triangle& t : mesh.triangles) used.insert(t.begin(), t.end());
    ASSERT_EQ(used.size(), mesh.positions.size());
    ASSERT_EQ(*used.rbegin(), mesh.positions.size() - 1);
    test::expect_closed(mesh);
    size_t inside_out = 0;
    for (const mesh::Mesh& surface : test::surfaces(mesh)) inside_out += test::signed_volume(surface) <= 0;
    EXPECT_EQ(inside_out, 0u);
    const mesh::CleanReport report = mesh::clean(mesh).report;
    EXPECT_EQ(report.degenerate, 0u);
    EXPECT_EQ(report.duplicate, 0u);
    EXPECT_EQ(report.welded_positions, 0u);
  }
}

TEST_P(Generated, HasAsManyTrianglesAsItMay) {
  for (const uint64_t triangles : {150, 999, 1'000, 10'000, 12'345, 100'000, 1'000'000, 50'000'000}) {
    const uint64_t made = make_shape(GetParam(), {triangles, 1})->triangle_count();
    EXPECT_LE(made, triangles);
    EXPECT_GE(double(made), (triangles < 10'000 ? 0.6 : 0.8) * double(triangles)) << triangles;
  }
  for (uint64_t triangles = 10'000; triangles < 1'000'000; triangles += triangles / 23) {
    const uint64_t made = make_shape(GetParam(), {triangles, 1})->triangle_count();
    EXPECT_TRUE(made <= triangles && double(made) >= 0.8 * double(triangles)) << made << " of " << triangles;
  }
}

TEST_P(Generated, KeepsItsBoundsWhateverTheTriangles) {
  for (const uint64_t seed : {1, 2, 3, 4, 5, 6, 7, 8}) {
    const mesh::Mesh mesh = make(20'000, seed);
    for (const mesh::Float3& p : mesh.positions)
      for (const float x : p) ASSERT_TRUE(std::fabs(x) < 12) << seed;  // also false for NaN
  }
  const auto height = [&](uint64_t triangles) {
    float low = 1e9f, high = -1e9f;
    for (const mesh::Float3& p : make(triangles).positions)
      low = std::min(low, p[1]), high = std::max(high, p[1]);
    return high - low;
  };
  EXPECT_NEAR(height(200'000) / height(50'000), 1, 0.25);
}

TEST_P(Generated, IsTheSameInPieces) {
  const std::unique_ptr<mesh::MeshSource> source = make_shape(GetParam(), {5'000, 9});
  const mesh::Mesh mesh = whole(*source);
  for (size_t first = 0; first < mesh.positions.size(); first += 97) {
    std::vector<mesh::Float3> piece(std::min<size_t>(97, mesh.positions.size() - first));
    source->vertices(first, piece);
    ASSERT_TRUE(std::equal(piece.begin(), piece.end(), mesh.positions.begin() + ptrdiff_t(first))) << first;
  }
  for (size_t first = 0; first < mesh.triangles.size(); first += 89) {
    std::vector<mesh::Triangle> piece(std::min<size_t>(89, mesh.triangles.size() - first));
    source->triangles(first, piece);
    ASSERT_TRUE(std::equal(piece.begin(), piece.end(), mesh.triangles.begin() + ptrdiff_t(first))) << first;
  }
}

TEST_P(Generated, DependsOnTheRequestAlone) {
  const test::TempDir folder;
  const auto bytes = [&](uint64_t triangles, uint64_t seed, size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    const std::string file = folder.path() / "a.ply";
    const std::atomic<bool> cancel{false};
    mesh::write_ply(
        file, *make_shape(GetParam(), {triangles, seed}), "", [](double) {}, cancel);
    return test::read_bytes(file);
  };
  const std::string once = bytes(60'000, 1, 1);
  EXPECT_TRUE(once == bytes(60'000, 1, 4));
  EXPECT_FALSE(once == bytes(60'000, 2, 4));
  EXPECT_FALSE(once == bytes(60'000, uint64_t{1} << 40, 4));
}

INSTANTIATE_TEST_SUITE_P(All, Generated, testing::ValuesIn(names()), [](const auto& instance) {
  std::string name = instance.param;
  std::erase(name, '-');
  return name;
});

TEST(GeneratedShapes, AreRefusedByNameAndRange) {
  const auto sentence = [](const char* name, uint64_t triangles) {
    try {
      make_shape(name, {triangles, 1});
    } catch (const Error& error) {
      EXPECT_EQ(error.status(), Status::usage);
      return std::string(error.what());
    }
    return std::string();
  };
  const std::string unknown = sentence("teapot", 1000);
  for (const Shape& shape : shapes()) {
    EXPECT_NE(unknown.find(shape.name), std::string::npos) << unknown;
    const std::string name(shape.name), fewest = std::to_string(shape.fewest_triangles);
    EXPECT_EQ(sentence(name.c_str(), shape.fewest_triangles), "");
    EXPECT_EQ(sentence(name.c_str(), kMostTriangles), "");
    EXPECT_NE(sentence(name.c_str(), shape.fewest_triangles - 1).find(fewest), std::string::npos);
    EXPECT_NE(sentence(name.c_str(), kMostTriangles + 1).find(std::to_string(kMostTriangles)),
              std::string::npos);
  }
}

TEST(GeneratedShapes, AreWhatTheyAreNamedAfter) {
  const mesh::Mesh torus = whole(*make_shape("torus", {200'000, 3}));
  constexpr double kPi = 3.141592653589793;
  EXPECT_NEAR(test::signed_volume(torus), 2 * kPi * kPi * 0.35 * 0.35, 0.002);
  EXPECT_EQ(test::surfaces(whole(*make_shape("tori", {5'000, 3}))).size(), 2u);
  EXPECT_EQ(test::surfaces(whole(*make_shape("statue", {5'000, 3}))).size(), 1u);
  EXPECT_EQ(test::surfaces(whole(*make_shape("terrain", {5'000, 3}))).size(), 1u);
  EXPECT_GT(test::surfaces(whole(*make_shape("chain-mail", {50'000, 3}))).size(), 100u);
  // Each leaf is a surface of four triangles.
  size_t of_leaves = 0;
  for (const mesh::Mesh& surface : test::surfaces(whole(*make_shape("tree", {50'000, 3}))))
    if (surface.triangles.size() == 4) of_leaves += 4;
  EXPECT_GT(of_leaves, 50'000u * 3 / 4);
}

/// Wires of the shape's rings are at least this fraction of their radius apart.
void expect_apart(const std::string& name, uint64_t triangles, float least) {
  const std::vector<mesh::Mesh> rings = test::surfaces(whole(*make_shape(name, {triangles, 5})));
  for (size_t i = 0; i < rings.size(); ++i)
    for (size_t k = i + 1; k < rings.size(); ++k) {
      float nearest = 1e9f;
      for (const mesh::Float3& p : rings[i].positions)
        for (const mesh::Float3& q : rings[k].positions)
          nearest = std::min(nearest, std::hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]));
      EXPECT_GT(nearest, least) << name << ": " << i << " and " << k;
    }
}

TEST(GeneratedShapes, RingsDoNotTouch) {
  expect_apart("tori", 3'000, 0.05f);
  expect_apart("chain-mail", 4'000, 0.005f);
}

TEST(Turn, IsThatOfTheMathematicalLibrary) {
  for (double turns = -2; turns <= 2; turns += 1.0 / 1024) {
    EXPECT_NEAR(turn(turns).cos, std::cos(2 * 3.141592653589793 * turns), 3e-15) << turns;
    EXPECT_NEAR(turn(turns).sin, std::sin(2 * 3.141592653589793 * turns), 3e-15) << turns;
  }
}

}  // namespace
}  // namespace nif::generate
