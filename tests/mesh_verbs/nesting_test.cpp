// Solids face outwards or inwards by how many others they are within.
#include "mesh/repair/nesting.hpp"

#include <gtest/gtest.h>

#include "mesh/inspect/inspect.hpp"
#include "mesh/repair/repair.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

using mesh::Mesh;
using repair::Nesting;

/// Boxes with these half sides around the origin; negative ones face inwards.
Mesh boxes(const std::vector<float>& halves) {
  Mesh mesh{"boxes", {}, {}};
  for (const float half : halves) append(mesh, cube(), std::abs(half), {0, 0, 0}, half < 0);
  return mesh;
}

TEST(Nesting, ACavityIsTurnedInwards) {
  // A corner of each box lies in the plane of a diagonal of the others' sides.
  Mesh mesh = boxes({1, 0.5f});
  const Nesting done = repair::turn_solids(mesh, false);
  EXPECT_EQ(done.turned, 1u);
  EXPECT_EQ(done.unclear, 0u);
  EXPECT_EQ(inspect::inspect(mesh).volume, 8 - 1);

  Mesh kept = boxes({1, 0.5f});
  EXPECT_EQ(repair::turn_solids(kept, true).turned, 0u);
}

TEST(Nesting, DeepOnesTakeTurns) {
  for (const std::vector<float>& halves :
       {std::vector<float>{4, 3, 2, 1}, {1, 2, 3, 4}, {-2, -4, 1, 3}, {-1, -2, -3, -4}}) {
    Mesh mesh = boxes(halves);
    EXPECT_EQ(repair::turn_solids(mesh, false).unclear, 0u);
    EXPECT_EQ(inspect::inspect(mesh).volume, 8 * (64 - 27 + 8 - 1));
  }
}

TEST(Nesting, SeveralInOne) {
  // Two cavities side by side, one of them with a solid; and another box outside.
  Mesh mesh;
  append(mesh, cube(), 1, {-2, 0, 0});
  append(mesh, cube(), 1, {2, 0, 0});
  append(mesh, icosphere(2), 0.5f, {2, 0, 0}, true);
  append(mesh, cube(), 5, {0, 0, 0});
  append(mesh, cube(), 1, {20, 0, 0}, true);
  EXPECT_EQ(repair::turn_solids(mesh, false).turned, 4u);
  EXPECT_NEAR(inspect::inspect(mesh).volume, 1000 - 16 + 8 + 4.0 / 3 * std::numbers::pi / 8, 0.05);
}

/// Within the bounds of a ring, but not in it.
TEST(Nesting, InTheHoleOfARing) {
  Mesh mesh = torus(24, 12);
  append(mesh, cube(), 0.01f, {0, 0, 0});
  append(mesh, cube(), 0.01f, {0, 0.05f, 0}, true);
  const double ring = inspect::inspect(torus(24, 12)).volume;
  EXPECT_EQ(repair::turn_solids(mesh, false).turned, 1u);
  EXPECT_NEAR(inspect::inspect(mesh).volume, ring + 2 * 8e-6, 1e-9);
}

TEST(Nesting, BoxesThatTouchOrCrossStay) {
  const auto check = [](const char* what, float scale, const mesh::Float3& offset, uint64_t unclear) {
    Mesh mesh = cube();
    append(mesh, cube(), scale, offset);
    const std::vector<mesh::Triangle> before = mesh.triangles;
    const Nesting done = repair::turn_solids(mesh, false);
    EXPECT_EQ(done.turned, 0u) << what;
    EXPECT_EQ(done.unclear, unclear) << what;
    EXPECT_EQ(mesh.triangles, before) << what;
  };
  check("side by side", 1, {2, 0, 0}, 0);
  check("on top of each other", 1, {0, 0, 0}, 0);
  check("through each other", 1, {0.5f, 0.5f, 0.5f}, 0);
  check("within, at a side", 0.5f, {0.5f, 0, 0}, 0);  // nothing behind it
  check("within, at the other side", 0.5f, {-0.5f, 0, 0}, 1);
  check("within, at a corner", 0.5f, {-0.5f, -0.5f, -0.5f}, 1);
}

/// Something within one of two intersecting boxes may be within both.
TEST(Nesting, WithinWhatCrosses) {
  Mesh mesh = cube();
  append(mesh, cube(), 1, {0.5f, 0, 0});
  append(mesh, cube(), 0.1f, {0.25f, 0, 0});
  const Nesting done = repair::turn_solids(mesh, false);
  EXPECT_EQ(done.turned, 0u);
  EXPECT_EQ(done.unclear, 1u);
}

/// Its bounds lie within the other's, but it sticks out of the other's hollow side.
TEST(Nesting, ABarThroughARing) {
  Mesh mesh = torus(48, 24);
  Mesh bar = cube();
  for (mesh::Float3& p : bar.positions) p[0] *= 1.2f, p[1] *= 0.02f, p[2] *= 0.02f;
  append(mesh, bar);
  EXPECT_EQ(repair::turn_solids(mesh, false).turned, 0u);
}

TEST(Nesting, OpenOnesStay) {
  Mesh mesh = boxes({1, 0.5f});
  mesh.triangles.pop_back();
  EXPECT_EQ(repair::turn_solids(mesh, false).turned, 0u);
}

TEST(Nesting, ManyInARowAndMuchNested) {
  Mesh deep{"deep", {}, {}};
  constexpr int kCount = 3000;
  for (int i = 1; i <= kCount; ++i) append(deep, cube(), float(i), {0, 0, 0});
  EXPECT_EQ(repair::turn_solids(deep, false).turned, uint64_t(kCount / 2));
  Mesh row{"row", {}, {}};
  for (int i = 0; i < kCount; ++i) append(row, cube(), 1, {3 * float(i), 0, 0}, true);
  EXPECT_EQ(repair::turn_solids(row, false).turned, uint64_t(kCount));
}

TEST(Nesting, TinyAndHuge) {
  for (const float scale : {1e-30f, 1e30f, 1e37f}) {
    Mesh mesh = boxes({4 * scale, 3 * scale, 2 * scale, scale});
    EXPECT_EQ(repair::turn_solids(mesh, false).turned, 2u) << scale;
  }
}

}  // namespace
}  // namespace nif::test
