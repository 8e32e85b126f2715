// Which meshes of a file are the same.
#include "formats/mesh/alike.hpp"

#include <gtest/gtest.h>

#include <memory>

#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

TEST(Alike, WhatIsEqualAndNothingElse) {
  mesh::Mesh ball = icosphere(3), moved = ball, turned = ball, red = ball, signs = ball;
  moved.positions.back()[2] = 7;
  std::swap(turned.triangles.back()[0], turned.triangles.back()[1]);
  red.look.set_color(0, {1, 0, 0});
  red.look.complete(red.positions.size(), red.triangles.size());
  ball.positions[0][0] = 0.0f, signs.positions[0][0] = -0.0f;
  const std::vector<mesh::Mesh> meshes{ball, moved, turned, red, signs, moved, cube(), red};
  const std::vector<uint32_t> shapes = mesh::first_alike(meshes), looks = mesh::first_alike(meshes, true);
  EXPECT_EQ(shapes, (std::vector<uint32_t>{0, 1, 2, 3, 0, 1, 6, 3}));
  EXPECT_EQ(looks, (std::vector<uint32_t>{0, 1, 2, 3, 0, 1, 6, 3}));
  mesh::Mesh plain = red;
  plain.look = {};
  EXPECT_EQ(mesh::first_alike(std::vector{red, plain, red}), (std::vector<uint32_t>{0, 0, 0}));
  EXPECT_EQ(mesh::first_alike(std::vector{red, plain, red}, true), (std::vector<uint32_t>{0, 1, 0}));
  EXPECT_TRUE(mesh::first_alike({}).empty());
  EXPECT_EQ(mesh::first_alike(std::vector{red}), (std::vector<uint32_t>{0}));
}

TEST(Alike, MeshesWithTheSameHoles) {
  mesh::Mesh leaf{"", {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}};
  leaf.alpha = {mesh::TriangleAlpha::cut};
  leaf.alpha_maps = {std::make_shared<const mesh::AlphaMap>(mesh::AlphaMap{1, 1, {}, {1}})};
  leaf.holes = {{.map = 0, .places = {{{0, 0}, {9, 0}, {0, 9}}}}};
  mesh::Mesh copied = leaf, other = leaf, moved = leaf, filled = leaf;
  copied.alpha_maps = {std::make_shared<const mesh::AlphaMap>(*leaf.alpha_maps[0])};
  other.alpha_maps = {std::make_shared<const mesh::AlphaMap>(mesh::AlphaMap{1, 1, {}, {0}})};
  moved.holes[0].places[2][1] = 8;
  filled.holes.clear(), filled.alpha_maps.clear();
  const std::vector<mesh::Mesh> meshes{leaf, other, leaf, moved, copied, filled};
  EXPECT_EQ(mesh::first_alike(meshes), (std::vector<uint32_t>{0, 1, 0, 3, 0, 5}));
}

/// Many of one size: comparing each with all others would take minutes.
TEST(Alike, ManyOfOneSize) {
  std::vector<mesh::Mesh> meshes(200000, mesh::Mesh{"", {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}});
  for (size_t m = 0; m < meshes.size(); ++m) meshes[m].positions[2][2] = float(m);
  const std::vector<uint32_t> firsts = mesh::first_alike(meshes);
  for (uint32_t m = 0; m < meshes.size(); ++m) ASSERT_EQ(firsts[m], m);
}

}  // namespace
}  // namespace nif::test
