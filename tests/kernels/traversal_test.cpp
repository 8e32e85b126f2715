// The reference's traversal at the limits of single precision.
#include <gtest/gtest.h>

#include <limits>
#include <memory>
#include <stdexcept>

#include "formats/nif/reader.hpp"
#include "formats/nif/writer.hpp"
#include "kernels/reference/planes/grid_traversal.hpp"
#include "tests/support/random_asset.hpp"

namespace nif::test {
namespace {

using kernels::Segment;
using kernels::TraversalResult;
using kernels::Verdict;

/// From so far away, with so short a direction, that t overflows before the grid is reached. This once never
/// ended.
TEST(Traversal, EndsWhereEveryCrossingOverflows) {
  const std::vector<std::byte> file = format::encode(random_asset(1));
  const format::AssetView asset = format::read_asset(file, "test");
  const kernels::SegmentField& field = asset.objects[0].as<kernels::SegmentField>();
  const float infinity = std::numeric_limits<float>::infinity();
  for (const float side : {-1.0f, 1.0f})
    for (int axis = 0; axis < 3; ++axis)
      for (const float tmin : {0.0f, -infinity}) {
        Segment segment{{field.origin[0], field.origin[1], field.origin[2]}, {0, 0, 0}, tmin, infinity};
        segment.origin[axis] = side * 1e37f;
        segment.direction[axis] = -side * 0x1p-58f / field.voxels_per_unit;
        TraversalResult traversal;
        uint32_t cubes = 0;
        kernels::follow_segment(
            field, segment, traversal, [](uint32_t, const kernels::Interval&) {},
            [&](const kernels::Cube&) {
              if (++cubes > 1000) throw std::runtime_error("the traversal does not end");
            });
        EXPECT_EQ(traversal.verdict, Verdict::visible);
        EXPECT_FALSE(traversal.certain);
      }
}

/// Tests of kernels need varied rays: random fields give every outcome often.
TEST(Traversal, RandomFieldsHaveEveryOutcome) {
  const auto traversal = std::make_unique<kernels::FullTraversal>();
  uint32_t visible = 0, occluded = 0, open = 0, proven = 0, by_wall = 0, intervals_2 = 0, intervals_4 = 0,
           parts = 0, empty_children = 0, inside = 0, starts = 0, ends = 0;
  constexpr uint64_t kSeeds = 40;
  constexpr uint32_t kSegments = 1000;
  for (uint64_t seed = 0; seed < kSeeds; ++seed) {
    const std::vector<std::byte> file = format::encode(random_asset(seed, {.objects = 1, .max_voxels = 40}));
    const format::AssetView asset = format::read_asset(file, "test");
    const kernels::SegmentField& field = asset.objects[0].as<kernels::SegmentField>();
    Random random(seed);
    for (uint32_t i = 0; i < kSegments; ++i) {
      bool cells = false, sides = false;
      kernels::traverse_segment(
          field, random_segment(random, field), *traversal, [&](const kernels::Cube& cube) {
            if (kernels::word_kind(cube.word) != kernels::kEmptyVoxel) cells = true;
            if (kernels::word_kind(cube.word) == kernels::kEmptyVoxel && kernels::empty_side(cube.word) != 0)
              sides = true;
            if (cube.size < 1 << field.levels) ++(cube.word == kernels::kEmptyChild ? empty_children : parts);
          });
      if (traversal->verdict == Verdict::visible) ++(cells ? proven : visible);
      if (traversal->verdict == Verdict::occluded) ++(sides ? occluded : by_wall);
      if (traversal->verdict != Verdict::open) continue;
      ++open;
      if (traversal->interval_count >= 2) ++intervals_2;
      if (traversal->interval_count >= 4) ++intervals_4;
      if (traversal->saw_inside) ++inside;
      if (traversal->starts_open) ++starts;
      if (traversal->ends_open) ++ends;
    }
  }
  const uint32_t often = kSeeds * kSegments / 100;
  EXPECT_GT(visible, often);
  EXPECT_GT(proven, often);
  EXPECT_GT(occluded, often);
  EXPECT_GT(by_wall, often);
  EXPECT_GT(open, 10 * often);
  EXPECT_GT(intervals_2, 5 * often);
  EXPECT_GT(intervals_4, often);
  EXPECT_GT(inside, often);
  EXPECT_GT(starts, often);
  EXPECT_GT(ends, often);
  EXPECT_GT(parts, 10 * often);
  EXPECT_GT(empty_children, 10 * often);
}

}  // namespace
}  // namespace nif::test
