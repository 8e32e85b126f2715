// The walk by leaps finds what the walk voxel by voxel finds, in every bit.
#include <gtest/gtest.h>

#include <cstring>
#include <memory_resource>

#include "kernels/gpu/segment/leaping_walk.hpp"
#include "kernels/packed/walk_grid.hpp"
#include "tests/gpu/loaded.hpp"

namespace nif::test {
namespace {

using kernels::Run;
using kernels::Segment;
using kernels::WalkResult;

/// A walk with what its runs are, in bits.
struct Found {
  WalkResult walk;
  std::vector<uint32_t> runs;

  auto collect() {
    return [this](uint32_t i, const Run& run) {
      ASSERT_EQ(2 * i, runs.size());
      runs.push_back(kernels::bits_as<uint32_t>(run.begin));
      runs.push_back(kernels::bits_as<uint32_t>(run.end));
    };
  }
  std::vector<uint32_t> bits() const {
    std::vector<uint32_t> all = runs;
    all.insert(all.end(), {uint32_t(walk.verdict), walk.certain, walk.saw_outside, walk.saw_inside,
                           walk.starts_in_surface, walk.ends_in_surface, walk.run_count,
                           kernels::bits_as<uint32_t>(walk.surface_t)});
    for (int a = 0; a < 3; ++a) {
      all.push_back(kernels::bits_as<uint32_t>(walk.origin[a]));
      all.push_back(kernels::bits_as<uint32_t>(walk.direction[a]));
    }
    return all;
  }
};

/// A field of any object with its codes in so many tables.
struct Leaping {
  kernels::cpu::WalkGrid grid;
  kernels::gpu::DeviceSegmentField field;

  Leaping(const kernels::SegmentField& of, uint32_t tables)
      : grid(of, tables, std::pmr::new_delete_resource()), field{of, grid.view(), {}, nullptr} {}
};

struct Counts {
  uint64_t rays = 0, visible = 0, occluded = 0, ambiguous = 0, voxels = 0, leaps = 0;
};

void compare(const Leaping& leaping, const std::vector<Segment>& segments, Counts& counts) {
  const kernels::SegmentField& field = leaping.field;
  for (const Segment& s : segments) {
    Found expected, found;
    kernels::follow_segment(field, s, expected.walk, expected.collect(),
                            [&](const int32_t(&)[3]) { ++counts.voxels; });
    kernels::gpu::leap_segment(leaping.field, s, found.walk, found.collect(),
                               [&](uint32_t) { ++counts.leaps; });
    ASSERT_EQ(found.bits(), expected.bits())
        << s.origin[0] << ' ' << s.origin[1] << ' ' << s.origin[2] << " + t " << s.direction[0] << ' '
        << s.direction[1] << ' ' << s.direction[2] << ", " << s.tmin << " to " << s.tmax;
    ++counts.rays;
    (expected.walk.verdict == kernels::Verdict::visible    ? counts.visible
     : expected.walk.verdict == kernels::Verdict::occluded ? counts.occluded
                                                           : counts.ambiguous)++;
  }
}

/// Along axes, in planes between voxels and through their edges and corners, in both directions, with a zero
/// of t on such a plane.
Segment lattice_segment(Random& random, const kernels::SegmentField& field) {
  Segment segment;
  for (int a = 0; a < 3; ++a) {
    const float at = float(random.below(2 * field.voxels[a] + 3)) / 2 - 0.5f;
    segment.origin[a] = field.origin[a] + at / field.voxels_per_unit;
    segment.direction[a] = float(int32_t(random.below(5)) - 2);
  }
  segment.tmin = random.below(3) == 0 ? 0 : random.between(-40.0f, 0.0f);
  segment.tmax = random.below(3) == 0 ? 0 : random.between(0.0f, 40.0f);
  return segment;
}

/// From far away, at any pace.
Segment far_segment(Random& random, const kernels::SegmentField& field) {
  Segment segment = random_segment(random, field);
  const float away = std::exp2(random.between(0.0f, 40.0f)), pace = std::exp2(random.between(-60.0f, 60.0f));
  for (int a = 0; a < 3; ++a) {
    segment.origin[a] -= away * segment.direction[a];
    segment.direction[a] *= pace;
  }
  segment.tmin = -std::numeric_limits<float>::infinity();
  segment.tmax = std::numeric_limits<float>::infinity();
  return segment;
}

/// Makes unknown voxels those of the outside, so that there is room for long leaps.
void replace_unknown(format::Asset& asset) {
  for (format::Object& object : asset.objects)
    for (kernels::BrickStates& states : object.as<format::SegmentData>().brick_states) {
      const uint64_t unknown = states.surface & states.aux;
      states.surface &= ~unknown;
      states.aux &= ~unknown;
    }
}

class LeapingWalkTest : public testing::TestWithParam<uint32_t> {};
INSTANTIATE_TEST_SUITE_P(Tables, LeapingWalkTest, testing::Values(0u, 1u, 2u));

TEST_P(LeapingWalkTest, FindsWhatTheReferenceFinds) {
  Counts counts;
  for (uint64_t seed = 0; seed < 60; ++seed) {
    constexpr uint32_t kMostVoxels[] = {14, 60, 150};
    format::Asset random = random_asset(
        seed, {.objects = 2, .instances = 0, .max_voxels = kMostVoxels[seed % std::size(kMostVoxels)]});
    if (seed % 2 == 0) replace_unknown(random);
    const Loaded asset(random);
    for (const format::ObjectView& object : asset.view.objects) {
      const Leaping leaping(object.as<format::SegmentView>().field, GetParam());
      Random numbers(seed);
      std::vector<Segment> segments = random_segments(object, seed, 4000);
      for (uint32_t i = 0; i < 2000; ++i)
        segments.push_back(lattice_segment(numbers, object.as<format::SegmentView>().field));
      for (uint32_t i = 0; i < 1000; ++i)
        segments.push_back(far_segment(numbers, object.as<format::SegmentView>().field));
      std::vector<Segment> spoiled(segments.begin(), segments.begin() + 2500);
      spoil(spoiled, seed);
      segments.insert(segments.end(), spoiled.begin(), spoiled.end());
      compare(leaping, segments, counts);
      if (HasFatalFailure()) return;
    }
  }
  EXPECT_GE(counts.rays, 1'000'000u);
  for (const uint64_t some : {counts.visible, counts.occluded, counts.ambiguous}) EXPECT_GT(some, 20'000u);
  if (GetParam() == 0)
    EXPECT_EQ(counts.leaps, counts.voxels);
  else
    EXPECT_LT(3 * counts.leaps, 2 * counts.voxels);
}

/// Unknown voxels among those of the surface: rays pass through many runs.
TEST_P(LeapingWalkTest, FindsTheSameRuns) {
  Counts counts;
  for (uint64_t seed = 0; seed < 4; ++seed) {
    format::Asset asset = random_asset(seed, {.objects = 1, .instances = 0, .max_voxels = 60});
    for (kernels::BrickStates& states : asset.objects[0].as<format::SegmentData>().brick_states)
      states.aux |= states.surface & 0x5a5aa5a55a5aa5a5u;
    const Loaded loaded(asset);
    const Leaping leaping(loaded.view.objects[0].as<format::SegmentView>().field, GetParam());
    compare(leaping, random_segments(loaded.view.objects[0], seed, 20'000), counts);
  }
  EXPECT_GT(counts.ambiguous, 5'000u);
}

}  // namespace
}  // namespace nif::test
