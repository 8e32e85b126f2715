// The traversal with empty-space skipping gives the same bits as the traversal plane by plane.
#include <gtest/gtest.h>

#include <cstring>
#include <memory_resource>

#include "kernels/gpu/network/network_device_field.hpp"
#include "kernels/gpu/planes/skipping_traversal.hpp"
#include "kernels/packed/traversal_grid.hpp"
#include "tests/gpu/loaded.hpp"

namespace nif::test {
namespace {

using kernels::OpenCell;
using kernels::Segment;
using kernels::TraversalResult;

/// A traversal's result with its open cells, in bits.
struct Found {
  static constexpr size_t kWords = 6;
  TraversalResult traversal;
  std::vector<uint32_t> intervals;

  auto collect() {
    return [this](uint32_t i, const OpenCell& cell) {
      ASSERT_EQ(kWords * i, intervals.size());
      for (const float t : {cell.begin, cell.end, cell.enter, cell.leave})
        intervals.push_back(kernels::bits_as<uint32_t>(t));
      intervals.push_back(cell.heights);
      intervals.push_back(cell.word);
    };
  }
  std::vector<uint32_t> bits(bool in_order) const {
    std::vector<uint32_t> all = intervals;
    all.insert(all.end(), {uint32_t(traversal.verdict), traversal.certain, traversal.saw_outside,
                           traversal.saw_inside, traversal.starts_open, traversal.ends_open,
                           traversal.interval_count, kernels::bits_as<uint32_t>(traversal.open_t)});
    for (int a = 0; a < 3; ++a) {
      all.push_back(kernels::bits_as<uint32_t>(traversal.origin[a]));
      all.push_back(kernels::bits_as<uint32_t>(traversal.direction[a]));
    }
    if (in_order && traversal.verdict == kernels::Verdict::occluded)
      for (const float t : {traversal.last_enter, traversal.last_leave})
        all.push_back(kernels::bits_as<uint32_t>(t));
    return all;
  }
};

/// The field of any object, with its words.
struct Skipping {
  kernels::cpu::TraversalGrid grid;
  kernels::gpu::DeviceSegmentField field;

  explicit Skipping(const kernels::SegmentField& of)
      : grid(of, std::pmr::new_delete_resource()), field{of, grid.view(), {}, nullptr} {}
};

/// Distance of a segment's origin from the grid's, in finest cells.
float far_reach(const kernels::SegmentField& field, const Segment& segment) {
  TraversalResult traversal;
  float reach;
  kernels::to_grid_space(field, segment, traversal, reach);
  return reach;
}

struct Counts {
  uint64_t rays = 0, visible = 0, occluded = 0, open = 0, intervals = 0, far = 0;
  uint64_t cubes = 0, cells = 0, steps = 0, loads = 0;
  uint64_t later = 0, between = 0;  ///< blocked in order: later than else known; where no cell is open
};

/// The same in order, as for first hits, for every fourth segment.
void compare_in_order(const Skipping& skipping, const Segment& s, const TraversalResult& any_order,
                      Counts& counts) {
  Found expected, found;
  kernels::follow_segment<true>(skipping.field, s, expected.traversal, expected.collect(),
                                kernels::NoVisit());
  kernels::gpu::traverse_object<true>(skipping.field, skipping.field.words, s, found.traversal,
                                      found.collect());
  ASSERT_EQ(found.bits(true), expected.bits(true));
  if (expected.traversal.verdict != kernels::Verdict::occluded) return;
  counts.later += expected.traversal.interval_count > any_order.interval_count;
  counts.between += expected.traversal.interval_count == 0;
}

void compare(const Skipping& skipping, const std::vector<Segment>& segments, Counts& counts) {
  const kernels::SegmentField& field = skipping.field;
  for (const Segment& s : segments) {
    Found expected, found;
    kernels::follow_segment(field, s, expected.traversal, expected.collect(), [&](const kernels::Cube& cube) {
      ++counts.cubes;
      counts.cells += kernels::word_kind(cube.word) != kernels::kEmptyVoxel;
    });
    kernels::gpu::traverse_skipping(skipping.field, skipping.field.words, s, found.traversal, found.collect(),
                                    [&](uint32_t loads) {
                                      ++counts.steps;
                                      counts.loads += loads;
                                    });
    ASSERT_EQ(found.bits(false), expected.bits(false))
        << s.origin[0] << ' ' << s.origin[1] << ' ' << s.origin[2] << " + t " << s.direction[0] << ' '
        << s.direction[1] << ' ' << s.direction[2] << ", " << s.tmin << " to " << s.tmax;
    if (counts.rays % 4 == 0) compare_in_order(skipping, s, expected.traversal, counts);
    if (testing::Test::HasFatalFailure()) return;
    ++counts.rays;
    counts.intervals += expected.traversal.interval_count;
    counts.far += expected.traversal.interval_count > 0 && !(far_reach(field, s) <= kernels::kCertainReach);
    (expected.traversal.verdict == kernels::Verdict::visible    ? counts.visible
     : expected.traversal.verdict == kernels::Verdict::occluded ? counts.occluded
                                                                : counts.open)++;
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
      const Skipping skipping(object.as<kernels::SegmentField>());
      Random numbers(seed);
      std::vector<Segment> segments = random_segments(object, seed, 4000);
      for (uint32_t i = 0; i < 2000; ++i)
        segments.push_back(lattice_segment(numbers, object.as<kernels::SegmentField>()));
      for (uint32_t i = 0; i < 1000; ++i)
        segments.push_back(far_segment(numbers, object.as<kernels::SegmentField>()));
      std::vector<Segment> spoiled(segments.begin(), segments.begin() + 2500);
      spoil(spoiled, seed);
      segments.insert(segments.end(), spoiled.begin(), spoiled.end());
      compare(skipping, segments, counts);
      if (testing::Test::HasFatalFailure()) return;
    }
  }
  EXPECT_GE(counts.rays, seeds * 17'000);
  for (const uint64_t some : {counts.visible, counts.occluded, counts.open}) EXPECT_GT(some, seeds * 340);
  EXPECT_GT(counts.far, seeds * 17);
  EXPECT_GT(counts.intervals, 2 * counts.open);
  EXPECT_GT(counts.later, seeds * 17);
  EXPECT_GT(counts.between, seeds * 17);
  // Skips cross many voxels; cells are visited one by one.
  EXPECT_GT(counts.cells, counts.rays);
  EXPECT_LT(2 * (counts.steps - counts.cells), counts.cubes - counts.cells);
}

TEST(SkippingTraversal, FindsWhatTheReferenceFinds) { compare_random_assets(0, 6); }
TEST(SkippingTraversal, FindsWhatTheReferenceFindsInMany) { compare_random_assets(6, 54); }

}  // namespace
}  // namespace nif::test
