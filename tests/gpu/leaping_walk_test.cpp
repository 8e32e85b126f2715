// The traversal with empty-space skipping gives the same bits as the traversal plane by plane.
#include <gtest/gtest.h>

#include <cstring>
#include <memory_resource>

#include "kernels/gpu/network/device_field.hpp"
#include "kernels/gpu/planes/leaping_walk.hpp"
#include "kernels/packed/walk_grid.hpp"
#include "tests/gpu/loaded.hpp"

namespace nif::test {
namespace {

using kernels::OpenCell;
using kernels::Segment;
using kernels::WalkResult;

/// A traversal's result with its open cells, in bits.
struct Found {
  static constexpr size_t kWords = 6;
  WalkResult walk;
  std::vector<uint32_t> runs;

  auto collect() {
    return [this](uint32_t i, const OpenCell& cell) {
      ASSERT_EQ(kWords * i, runs.size());
      for (const float t : {cell.begin, cell.end, cell.enter, cell.leave})
        runs.push_back(kernels::bits_as<uint32_t>(t));
      runs.push_back(cell.heights);
      runs.push_back(cell.word);
    };
  }
  std::vector<uint32_t> bits(bool in_order) const {
    std::vector<uint32_t> all = runs;
    all.insert(all.end(),
               {uint32_t(walk.verdict), walk.certain, walk.saw_outside, walk.saw_inside, walk.starts_open,
                walk.ends_open, walk.run_count, kernels::bits_as<uint32_t>(walk.open_t)});
    for (int a = 0; a < 3; ++a) {
      all.push_back(kernels::bits_as<uint32_t>(walk.origin[a]));
      all.push_back(kernels::bits_as<uint32_t>(walk.direction[a]));
    }
    if (in_order && walk.verdict == kernels::Verdict::occluded)
      for (const float t : {walk.last_enter, walk.last_leave}) all.push_back(kernels::bits_as<uint32_t>(t));
    return all;
  }
};

/// The field of any object, with its words.
struct Leaping {
  kernels::cpu::WalkGrid grid;
  kernels::gpu::DeviceSegmentField field;

  explicit Leaping(const kernels::SegmentField& of)
      : grid(of, std::pmr::new_delete_resource()), field{of, grid.view(), {}, nullptr} {}
};

/// Distance of a segment's origin from the grid's, in finest cells.
float far_reach(const kernels::SegmentField& field, const Segment& segment) {
  WalkResult walk;
  float reach;
  kernels::to_grid_space(field, segment, walk, reach);
  return reach;
}

struct Counts {
  uint64_t rays = 0, visible = 0, occluded = 0, ambiguous = 0, runs = 0, far = 0;
  uint64_t pieces = 0, cells = 0, steps = 0, loads = 0;
  uint64_t later = 0, between = 0;  ///< blocked in order: later than else known; where no cell is open
};

/// The same in order, as for first hits, for every fourth segment.
void compare_in_order(const Leaping& leaping, const Segment& s, const WalkResult& any_order, Counts& counts) {
  Found expected, found;
  kernels::follow_segment<true>(leaping.field, s, expected.walk, expected.collect(), kernels::NoVisit());
  kernels::gpu::walk_object<true>(leaping.field, leaping.field.walk, s, found.walk, found.collect());
  ASSERT_EQ(found.bits(true), expected.bits(true));
  if (expected.walk.verdict != kernels::Verdict::occluded) return;
  counts.later += expected.walk.run_count > any_order.run_count;
  counts.between += expected.walk.run_count == 0;
}

void compare(const Leaping& leaping, const std::vector<Segment>& segments, Counts& counts) {
  const kernels::SegmentField& field = leaping.field;
  for (const Segment& s : segments) {
    Found expected, found;
    kernels::follow_segment(field, s, expected.walk, expected.collect(), [&](const kernels::Piece& piece) {
      ++counts.pieces;
      counts.cells += kernels::word_kind(piece.word) != kernels::kEmptyVoxel;
    });
    kernels::gpu::leap_segment(leaping.field, leaping.field.walk, s, found.walk, found.collect(),
                               [&](uint32_t loads) {
                                 ++counts.steps;
                                 counts.loads += loads;
                               });
    ASSERT_EQ(found.bits(false), expected.bits(false))
        << s.origin[0] << ' ' << s.origin[1] << ' ' << s.origin[2] << " + t " << s.direction[0] << ' '
        << s.direction[1] << ' ' << s.direction[2] << ", " << s.tmin << " to " << s.tmax;
    if (counts.rays % 4 == 0) compare_in_order(leaping, s, expected.walk, counts);
    if (testing::Test::HasFatalFailure()) return;
    ++counts.rays;
    counts.runs += expected.walk.run_count;
    counts.far += expected.walk.run_count > 0 && !(far_reach(field, s) <= kernels::kCertainReach);
    (expected.walk.verdict == kernels::Verdict::visible    ? counts.visible
     : expected.walk.verdict == kernels::Verdict::occluded ? counts.occluded
                                                           : counts.ambiguous)++;
  }
}

/// Along axes, in planes between cells and through their edges and corners, in both directions, with a zero
/// of t on such a plane.
Segment lattice_segment(Random& random, const kernels::SegmentField& field) {
  const uint32_t cells = 1u << random.below(field.levels + 1);  // of a voxel
  Segment segment;
  for (int a = 0; a < 3; ++a) {
    const float at = float(random.below(2 * cells * field.voxels[a] + 3)) / 2 - 0.5f;
    segment.origin[a] = field.origin[a] + at / float(cells) / field.voxels_per_unit;
    segment.direction[a] = float(int32_t(random.below(5)) - 2);
  }
  segment.tmin = random.below(3) == 0 ? 0 : random.between(-40.0f, 0.0f);
  segment.tmax = random.below(3) == 0 ? 0 : random.between(0.0f, 40.0f);
  return segment;
}

/// From far away, with directions of any length.
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

/// Turns unknown voxels into outside ones, so that there is more empty space to skip. Not in objects whose
/// planes connect them to the inside.
void replace_unknown(format::Asset& asset) {
  for (format::Object& object : asset.objects) {
    format::PlanesData& data = *object.planes;
    const auto before = data.brick_states;
    for (kernels::BrickStates& states : data.brick_states) {
      const uint64_t unknown = states.surface & states.aux;
      states.surface &= ~unknown;
      states.aux &= ~unknown;
    }
    const format::SideRegions regions(format::field_of(data));
    if (regions.contradictory()) data.brick_states = before;
  }
}

/// Of `seeds` random assets, the first of which is number `first`.
void compare_random_assets(uint64_t first, uint64_t seeds) {
  Counts counts;
  for (uint64_t seed = first; seed < first + seeds; ++seed) {
    constexpr uint32_t kMostVoxels[] = {14, 20, 60, 14, 20, 30, 14, 20, 40, 150};
    format::Asset random = random_asset(
        seed, {.objects = 2, .instances = 0, .max_voxels = kMostVoxels[seed % std::size(kMostVoxels)]});
    if (seed % 2 == 0) replace_unknown(random);
    const Loaded asset(random);
    for (const format::ObjectView& object : asset.view.objects) {
      const Leaping leaping(object.as<kernels::SegmentField>());
      Random numbers(seed);
      std::vector<Segment> segments = random_segments(object, seed, 4000);
      for (uint32_t i = 0; i < 2000; ++i)
        segments.push_back(lattice_segment(numbers, object.as<kernels::SegmentField>()));
      for (uint32_t i = 0; i < 1000; ++i)
        segments.push_back(far_segment(numbers, object.as<kernels::SegmentField>()));
      std::vector<Segment> spoiled(segments.begin(), segments.begin() + 2500);
      spoil(spoiled, seed);
      segments.insert(segments.end(), spoiled.begin(), spoiled.end());
      compare(leaping, segments, counts);
      if (testing::Test::HasFatalFailure()) return;
    }
  }
  EXPECT_GE(counts.rays, seeds * 17'000);
  for (const uint64_t some : {counts.visible, counts.occluded, counts.ambiguous})
    EXPECT_GT(some, seeds * 340);
  EXPECT_GT(counts.far, seeds * 17);
  EXPECT_GT(counts.runs, 2 * counts.ambiguous);
  EXPECT_GT(counts.later, seeds * 17);
  EXPECT_GT(counts.between, seeds * 17);
  // Skips cross many voxels; cells are visited one by one.
  EXPECT_GT(counts.cells, counts.rays);
  EXPECT_LT(2 * (counts.steps - counts.cells), counts.pieces - counts.cells);
}

TEST(LeapingWalk, FindsWhatTheReferenceFinds) { compare_random_assets(0, 6); }
TEST(LeapingWalk, FindsWhatTheReferenceFindsInMany) { compare_random_assets(6, 54); }

}  // namespace
}  // namespace nif::test
