// Cleaning: what is welded, what is dropped and what is kept for closure tests.
#include "formats/mesh/clean.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <random>

#include "formats/base/collinear.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

using mesh::clean;
using mesh::CleanMesh;
using mesh::Mesh;
using Triangles = std::vector<mesh::Triangle>;

/// The same triangles with separate vertices.
Mesh unwelded(const Mesh& mesh) {
  Mesh out{mesh.name, {}, {}};
  for (const auto& t : mesh.triangles) {
    const auto base = static_cast<uint32_t>(out.positions.size());
    for (const uint32_t v : t) out.positions.push_back(mesh.positions[v]);
    out.triangles.push_back({base, base + 1, base + 2});
  }
  return out;
}

TEST(Clean, WeldsEqualPositions) {
  const Mesh ball = icosphere(3);
  const CleanMesh out = clean(unwelded(ball));
  EXPECT_EQ(out.positions.size(), ball.positions.size());
  EXPECT_EQ(out.report.welded_positions, ball.triangles.size() * 3 - ball.positions.size());
  EXPECT_EQ(out.report.degenerate + out.report.duplicate, 0u);
  EXPECT_EQ(open_edges({"", out.positions, out.triangles}), 0u);
}

TEST(Clean, SaysWhichTrianglesAreKept) {
  const CleanMesh out =
      clean({"",
             {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {2, 0, 0}, {0, 0, 1}},
             {{0, 0, 1}, {0, 1, 2}, {0, 1, 3}, {1, 2, 0}, {0, 2, 1}, {3, 0, 1}, {1, 2, 4}}});
  EXPECT_EQ(out.triangles, (Triangles{{0, 1, 2}, {0, 2, 1}, {1, 2, 4}}));
  EXPECT_EQ(out.dropped, (std::vector<uint32_t>{0, 2, 3, 5}));
  EXPECT_EQ(source_triangles(out), (std::vector<uint32_t>{1, 4, 6}));
  const CleanMesh whole = clean(torus(9, 7));
  EXPECT_TRUE(whole.dropped.empty());
  EXPECT_EQ(source_triangles(whole).back(), whole.triangles.size() - 1);
}

TEST(Clean, LeavesACleanMeshAsItIs) {
  const Mesh mesh = torus(9, 7);
  const CleanMesh out = clean(mesh);
  EXPECT_EQ(out.positions, mesh.positions);
  EXPECT_EQ(out.triangles, mesh.triangles);
}

TEST(Clean, NegativeZeroIsZero) {
  const CleanMesh out =
      clean({"", {{-0.0f, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, -0.0f, 0}, {0, 0, 1}}, {{0, 1, 2}, {3, 2, 4}}});
  EXPECT_EQ(out.positions.size(), 4u);
  EXPECT_FALSE(std::signbit(out.positions[0][0]));
  EXPECT_EQ(out.triangles, (Triangles{{0, 1, 2}, {0, 2, 3}}));
}

TEST(Clean, DropsPositionsThatNothingUses) {
  const float nan = std::nanf("");
  const CleanMesh out = clean({"", {{nan, 0, 0}, {0, 0, 0}, {9, 9, 9}, {1, 0, 0}, {0, 1, 0}}, {{1, 3, 4}}});
  EXPECT_EQ(out.positions, (std::vector<mesh::Float3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}));
}

TEST(Clean, DropsDuplicatesOfEitherRotationButKeepsTwins) {
  const Mesh mesh{
      "", {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}, {1, 2, 0}, {2, 1, 0}, {2, 0, 1}, {0, 2, 1}}};
  const CleanMesh out = clean(mesh);
  EXPECT_EQ(out.triangles, (Triangles{{0, 1, 2}, {2, 1, 0}}));
  EXPECT_EQ(out.report.duplicate, 3u);
}

/// Holes over one map. The first place is `first`.
mesh::TriangleHoles holes_from(int32_t first) {
  return {.map = 0, .places = {{{first, 0}, {first + 5, 0}, {first, 5}}}};
}

/// A triangle with holes covers only one with the same; one without covers all.
TEST(Clean, HolesDecideWhatIsADuplicate) {
  Mesh mesh{"",
            {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {2, 0, 0}},
            {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {0, 1, 3}}};
  mesh.alpha.assign(5, mesh::TriangleAlpha::cut);
  mesh.alpha_maps = {std::make_shared<const mesh::AlphaMap>()};
  const mesh::TriangleHoles a = holes_from(0), b = holes_from(7);
  mesh::TriangleHoles turned = a;
  turned.places = {a.places[1], a.places[2], a.places[0]};
  mesh.holes = {a, turned, b, a, a};
  const CleanMesh out = clean(mesh);
  EXPECT_EQ(out.triangles, (Triangles{{0, 1, 2}, {2, 0, 1}, {0, 2, 1}}));
  EXPECT_EQ(out.holes, (std::vector{a, b, a}));
  EXPECT_EQ(out.alpha_maps, mesh.alpha_maps);
  EXPECT_EQ(out.dropped, (std::vector<uint32_t>{1, 4}));
  EXPECT_EQ(out.report.duplicate, 1u);
  EXPECT_EQ(out.report.degenerate, 1u);
  EXPECT_TRUE(out.slivers.empty()) << "with holes, it closes nothing";

  mesh.holes[2] = {};  // it is solid, or may be
  const CleanMesh covered = clean(mesh);
  EXPECT_EQ(covered.triangles, (Triangles{{0, 1, 2}, {0, 2, 1}}));
  EXPECT_EQ(covered.holes, (std::vector{mesh::TriangleHoles(), a}));
  EXPECT_EQ(covered.report.duplicate, 2u);
  mesh.holes[4] = {};
  mesh.alpha[3] = mesh::TriangleAlpha::clear, mesh.holes[3] = {};
  const CleanMesh solid = clean(mesh);
  EXPECT_EQ(solid.triangles, (Triangles{{0, 1, 2}}));
  EXPECT_EQ(solid.slivers, (Triangles{{0, 1, 3}}));
  EXPECT_TRUE(solid.holes.empty());
  EXPECT_TRUE(solid.alpha_maps.empty());
}

/// Comparing each with all others would take minutes.
TEST(Clean, ManyHolesInOnePlace) {
  constexpr uint32_t kCount = 200'000;
  Mesh mesh{"", {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, Triangles(kCount, {0, 1, 2})};
  mesh.alpha.assign(kCount, mesh::TriangleAlpha::cut);
  mesh.alpha_maps = {std::make_shared<const mesh::AlphaMap>()};
  for (uint32_t i = 0; i < kCount; ++i) mesh.holes.push_back(holes_from(int32_t(i / 2)));
  EXPECT_EQ(clean(mesh).triangles.size(), kCount / 2);
}

TEST(Clean, KeepsSliversApart) {
  // A square with one side split in the middle: the sliver closes the gap.
  const Mesh mesh{"",
                  {{0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {0, 2, 0}, {1, 0, 0}},
                  {{0, 1, 2}, {0, 4, 1}, {0, 2, 3}, {4, 1, 0}, {3, 3, 2}}};
  const CleanMesh out = clean(mesh);
  EXPECT_EQ(out.triangles, (Triangles{{0, 1, 2}, {0, 2, 3}}));
  EXPECT_EQ(out.slivers, (Triangles{{0, 4, 1}}));
  EXPECT_EQ(out.report.degenerate, 3u);
  EXPECT_EQ(out.report.duplicate, 0u);
}

TEST(Clean, RefusesAMeshWithoutArea) {
  const Mesh mesh{"needle", {{0, 0, 0}, {1, 1, 1}, {2, 2, 2}}, {{0, 1, 2}, {0, 0, 1}}};
  try {
    clean(mesh);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.status(), Status::all_degenerate);
    EXPECT_NE(std::string(error.what()).find("needle"), std::string::npos);
  }
}

TEST(Collinear, IsExact) {
  EXPECT_TRUE(collinear({0, 0, 0}, {1, 2, 3}, {2, 4, 6}));
  EXPECT_FALSE(collinear({0, 0, 0}, {1, 2, 3}, {2, 4, std::nextafter(6.0f, 7.0f)}));
  EXPECT_TRUE(collinear({5, 5, 5}, {5, 5, 5}, {1, 2, 3}));
  // Differences of these are not representable, even in double.
  EXPECT_FALSE(collinear({1e30f, 1e30f, 0}, {1e-30f, 1e-30f, 0}, {1e-30f, 2e-30f, 0}));
  EXPECT_TRUE(collinear({1e30f, 1e30f, 0}, {1e-30f, 1e-30f, 0}, {-7, -7, 0}));
  EXPECT_FALSE(collinear({1e-45f, 0, 0}, {0, 1e-45f, 0}, {0, 0, 1e-45f}));
  EXPECT_FALSE(collinear({3e38f, 0, 0}, {0, 3e38f, 0}, {0, 0, 3e38f}));
}

TEST(Collinear, AgreesWithIntegerArithmetic) {
  std::mt19937 random(1);
  std::uniform_int_distribution<int> small(-4, 4), large(-(1 << 20), 1 << 20);
  int on_a_line = 0;
  for (int i = 0; i < 20000; ++i) {
    const std::array<int64_t, 3> a{large(random), large(random), large(random)};
    const std::array<int64_t, 3> d{small(random), small(random), small(random)};
    const int64_t s = large(random), t = large(random);
    std::array<int64_t, 3> b{}, c{};
    for (size_t k = 0; k < 3; ++k) b[k] = a[k] + s * d[k], c[k] = a[k] + t * d[k] + (k == 0 && i % 2);
    const auto point = [](const auto& p) {
      return mesh::Float3{static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2])};
    };
    bool exact = true;  // as floats
    for (const auto& p : {a, b, c}) {
      for (const int64_t x : p) exact &= static_cast<int64_t>(static_cast<float>(x)) == x;
    }
    if (!exact) continue;
    bool wanted = true;
    for (size_t k = 0; k < 3; ++k) {
      const size_t x = k, y = (k + 1) % 3;
      wanted &= (b[x] - a[x]) * (c[y] - a[y]) == (b[y] - a[y]) * (c[x] - a[x]);
    }
    on_a_line += wanted;
    EXPECT_EQ(collinear(point(a), point(b), point(c)), wanted);
  }
  EXPECT_GT(on_a_line, 1000);
}

}  // namespace
}  // namespace nif::test
