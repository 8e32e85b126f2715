// Boxes around what blocks light of triangles with holes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "kernels/cpu/holes/blocking_boxes.hpp"
#include "tests/support/random_asset.hpp"

namespace nif::test {
namespace {

using kernels::cpu::BlockingBoxes;
using kernels::cpu::SharedCopies;

struct Box {
  float low[3], high[3];
};

struct Triangle {
  float corners[3][3];

  Box box() const {
    Box box;
    for (int a = 0; a < 3; ++a) {
      box.low[a] = std::min({corners[0][a], corners[1][a], corners[2][a]});
      box.high[a] = std::max({corners[0][a], corners[1][a], corners[2][a]});
    }
    return box;
  }
  Box shrunk(const BlockingBoxes& boxes, uint32_t number) const {
    Box box = this->box();
    const float* const at[3] = {corners[0], corners[1], corners[2]};
    boxes.shrink(number, at, box.low, box.high);
    return box;
  }
};

/// Weights of the second and the third corner: anywhere, on an edge, or where two texels touch.
void choose_weights(Random& random, const kernels::AlphaPatch& patch, double& second, double& third) {
  second = double(random.unit());
  third = double(random.unit()) * (1 - second);
  if (random.below(4) == 0) third = 1 - second;
  if (random.below(4) == 0) (random.below(2) ? second : third) = 0;
  if (random.below(2)) return;
  const uint32_t a = random.below(2);
  const double p = patch.places[0][a], q = patch.places[1][a] - p, r = patch.places[2][a] - p;
  const double texel = std::ldexp(1.0, int(kernels::kAlphaFraction) - int(patch.shift));
  if (q == 0) return;
  const double on_border = (std::round((p + second * q + third * r) / texel) * texel - p - third * r) / q;
  if (on_border >= 0 && on_border + third <= 1) second = on_border;
}

TEST(BlockingBoxes, HoldEveryPointThatBlocks) {
  Random random(7);
  uint64_t blocking = 0, smaller = 0;
  for (int round = 0; round < 400; ++round) {
    format::AlphaMaps maps;
    for (int i = 0; i < 3; ++i) add_random_alpha_map(random, maps);
    constexpr uint32_t kTriangles = 20;
    const format::HolesData data = random_holes(random, kTriangles, maps);
    const kernels::HolesField holes = format::field_of(data, maps);
    SharedCopies copies;
    const BlockingBoxes boxes(holes, copies, std::pmr::new_delete_resource());
    for (uint32_t number = 0; number < kTriangles; ++number) {
      const float centre = random.below(2) ? 0.0f : 1000.0f;
      Triangle triangle;
      for (auto& corner : triangle.corners)
        for (float& at : corner) at = centre + random.between(-1.0f, 1.0f);
      const Box whole = triangle.box(), box = triangle.shrunk(boxes, number);
      const kernels::AlphaPatch* const patch = kernels::patch_of(holes, number);
      ASSERT_EQ(boxes.has_holes(number), patch != nullptr);
      for (int a = 0; a < 3; ++a) {
        ASSERT_GE(box.low[a], whole.low[a]);
        ASSERT_LE(box.high[a], whole.high[a]);
        if (patch == nullptr) {
          ASSERT_EQ(box.low[a], whole.low[a]);
          ASSERT_EQ(box.high[a], whole.high[a]);
        }
        smaller += box.high[a] - box.low[a] < 0.8f * (whole.high[a] - whole.low[a]);
      }
      for (int i = 0; i < 300 && patch != nullptr; ++i) {
        double second, third;
        choose_weights(random, *patch, second, third);
        const kernels::TriangleCrossing<double> crossing{0, {1 - second - third, second, third}, 1};
        if (!kernels::blocks_light(holes, *patch, crossing)) continue;
        ++blocking;
        for (int a = 0; a < 3; ++a) {
          const double from = double{triangle.corners[0][a]};
          const double at = (from + second * (double{triangle.corners[1][a]} - from)) +
                            third * (double{triangle.corners[2][a]} - from);
          ASSERT_GE(at, double{box.low[a]} - 1e-12) << round << ' ' << number;
          ASSERT_LE(at, double{box.high[a]} + 1e-12) << round << ' ' << number;
        }
      }
    }
  }
  EXPECT_GT(blocking, 300'000u);
  EXPECT_GT(smaller, 500u);
}

TEST(BlockingBoxes, AreSmallAroundALeafOnACard) {
  // 600 x 600 texels, of which those from 200 to 299, and to 399 upwards, block.
  kernels::AlphaMap map;
  map.width = map.height = 600;
  const uint32_t columns = kernels::alpha_tiles(600);
  auto tiles = std::make_shared<std::vector<uint64_t>>(kernels::alpha_tiles(600, 600));
  for (uint32_t y = 200; y < 400; ++y)
    for (uint32_t x = 200; x < 300; ++x)
      (*tiles)[y / 8 * columns + x / 8] |= uint64_t{1} << (y % 8 * 8 + x % 8);
  format::AlphaMaps maps;
  maps.add(map, std::move(tiles));
  for (const uint32_t wrap : {kernels::kAlphaRepeat, kernels::kAlphaMirror, kernels::kAlphaClamp}) {
    kernels::AlphaMap shown = maps[0];
    shown.wrap[0] = shown.wrap[1] = wrap;
    // A card's half: x is a coordinate of space, and so is y.
    const int32_t side = 600 << kernels::kAlphaFraction;
    const kernels::AlphaPatch patch{0, 0, {{0, 0}, {side, 0}, {0, side}}};
    const uint32_t number = 1;
    kernels::HolesField holes{&shown, &patch, {}, 1, 1};
    format::HolesData data;
    data.patches = {patch};
    data.set_numbers(std::vector<uint32_t>{number});
    holes.numbers = format::field_of(data, maps).numbers;
    SharedCopies copies;
    const BlockingBoxes boxes(holes, copies, std::pmr::new_delete_resource());
    const Box box = Triangle{{{0, 0, 5}, {600, 0, 5}, {0, 600, 5}}}.shrunk(boxes, 0);
    const float expected[3][2] = {{200, 300}, {200, 400}, {5, 5}};
    for (int a = 0; a < 3; ++a) {
      EXPECT_LE(box.low[a], expected[a][0]);
      EXPECT_GE(box.high[a], expected[a][1]);
      // For a single triangle, within cells of 8 texels and one more.
      EXPECT_GE(box.low[a], expected[a][0] - 9);
      EXPECT_LE(box.high[a], expected[a][1] + 9);
    }
  }
}

}  // namespace
}  // namespace nif::test
