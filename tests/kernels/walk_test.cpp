// The reference's traversal at the limits of single precision.
#include <gtest/gtest.h>

#include <limits>
#include <memory>
#include <stdexcept>

#include "formats/nif/reader.hpp"
#include "formats/nif/writer.hpp"
#include "kernels/reference/planes/walk.hpp"
#include "tests/support/random_asset.hpp"

namespace nif::test {
namespace {

using kernels::Segment;
using kernels::Verdict;
using kernels::WalkResult;

/// From so far away, with so short a direction, that t overflows before the grid is reached. This once never
/// ended.
TEST(Walk, EndsWhereEveryCrossingOverflows) {
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
        WalkResult walk;
        uint32_t pieces = 0;
        kernels::follow_segment(
            field, segment, walk, [](uint32_t, const kernels::Run&) {},
            [&](const kernels::Piece&) {
              if (++pieces > 1000) throw std::runtime_error("the walk does not end");
            });
        EXPECT_EQ(walk.verdict, Verdict::visible);
        EXPECT_FALSE(walk.certain);
      }
}

/// Tests of kernels need varied rays: random fields give every outcome often.
TEST(Walk, RandomFieldsHaveEveryOutcome) {
  const auto walk = std::make_unique<kernels::Walk>();
  uint32_t visible = 0, occluded = 0, open = 0, proven = 0, by_wall = 0, runs_2 = 0, runs_4 = 0, parts = 0,
           empty_parts = 0, inside = 0, starts = 0, ends = 0;
  constexpr uint64_t kSeeds = 40;
  constexpr uint32_t kSegments = 1000;
  for (uint64_t seed = 0; seed < kSeeds; ++seed) {
    const std::vector<std::byte> file = format::encode(random_asset(seed, {.objects = 1, .max_voxels = 40}));
    const format::AssetView asset = format::read_asset(file, "test");
    const kernels::SegmentField& field = asset.objects[0].as<kernels::SegmentField>();
    Random random(seed);
    for (uint32_t i = 0; i < kSegments; ++i) {
      bool cells = false, sides = false;
      kernels::walk_segment(field, random_segment(random, field), *walk, [&](const kernels::Piece& piece) {
        if (kernels::word_kind(piece.word) != kernels::kEmptyVoxel) cells = true;
        if (kernels::word_kind(piece.word) == kernels::kEmptyVoxel && kernels::empty_side(piece.word) != 0)
          sides = true;
        if (piece.size < 1 << field.levels) ++(piece.word == kernels::kEmptyPart ? empty_parts : parts);
      });
      if (walk->verdict == Verdict::visible) ++(cells ? proven : visible);
      if (walk->verdict == Verdict::occluded) ++(sides ? occluded : by_wall);
      if (walk->verdict != Verdict::ambiguous) continue;
      ++open;
      if (walk->run_count >= 2) ++runs_2;
      if (walk->run_count >= 4) ++runs_4;
      if (walk->saw_inside) ++inside;
      if (walk->starts_open) ++starts;
      if (walk->ends_open) ++ends;
    }
  }
  const uint32_t often = kSeeds * kSegments / 100;
  EXPECT_GT(visible, often);
  EXPECT_GT(proven, often);
  EXPECT_GT(occluded, often);
  EXPECT_GT(by_wall, often);
  EXPECT_GT(open, 10 * often);
  EXPECT_GT(runs_2, 5 * often);
  EXPECT_GT(runs_4, often);
  EXPECT_GT(inside, often);
  EXPECT_GT(starts, often);
  EXPECT_GT(ends, often);
  EXPECT_GT(parts, 10 * often);
  EXPECT_GT(empty_parts, 10 * often);
}

}  // namespace
}  // namespace nif::test
