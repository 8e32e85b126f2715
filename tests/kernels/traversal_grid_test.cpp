// Packed words agree with the field, and the boxes that kernels skip are uniform.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory_resource>

#include "formats/nif/reader.hpp"
#include "formats/nif/writer.hpp"
#include "kernels/packed/traversal_grid.hpp"
#include "kernels/reference/planes/grid_traversal.hpp"
#include "tests/support/random_asset.hpp"

namespace nif::test {
namespace {

using kernels::PlanesField;
using kernels::cpu::TraversalGrid;

struct Found {
  uint64_t with_levels[3] = {}, bricks = 0, boxes = 0, surface = 0;
};

/// Whether all voxels of the box in the word of a voxel or brick are as the word says. It starts at `low` and
/// has `side` voxels along each axis.
testing::AssertionResult box_is_alike(const PlanesField& field, uint32_t word, const int32_t (&low)[3],
                                      int32_t side) {
  int32_t first[3], last[3], voxel[3];
  for (uint32_t a = 0; a < 3; ++a) {
    first[a] = low[a] - int32_t(kernels::extent_of(word, a, 0));
    last[a] = std::min(low[a] + side, int32_t(field.voxels[a])) - 1 + int32_t(kernels::extent_of(word, a, 1));
    if (first[a] < 0 || last[a] >= int32_t(field.voxels[a]))
      return testing::AssertionFailure() << "a box leaves the grid";
  }
  const uint32_t plain = kernels::make_empty(kernels::empty_side(word));
  for (voxel[2] = first[2]; voxel[2] <= last[2]; ++voxel[2])
    for (voxel[1] = first[1]; voxel[1] <= last[1]; ++voxel[1])
      for (voxel[0] = first[0]; voxel[0] <= last[0]; ++voxel[0])
        if (kernels::voxel_word(field, voxel) != plain)
          return testing::AssertionFailure()
                 << "a box of " << low[0] << ' ' << low[1] << ' ' << low[2] << " holds another voxel";
  return testing::AssertionSuccess();
}

void check(const PlanesField& field, size_t most_without_bricks, Found& found) {
  const TraversalGrid grid(field, std::pmr::new_delete_resource(), most_without_bricks);
  ++found.with_levels[grid.brick_levels];
  if (most_without_bricks == kernels::cpu::kMostWithoutBricks) {
    EXPECT_EQ(kernels::cpu::traversal_bytes(field), grid.resident_bytes());
  }
  int32_t voxel[3];
  for (voxel[2] = 0; voxel[2] < int32_t(field.voxels[2]); ++voxel[2])
    for (voxel[1] = 0; voxel[1] < int32_t(field.voxels[1]); ++voxel[1])
      for (voxel[0] = 0; voxel[0] < int32_t(field.voxels[0]); ++voxel[0]) {
        const uint32_t word = grid.word_at(voxel), expected = kernels::voxel_word(field, voxel);
        if (kernels::word_kind(expected) != kernels::kEmptyVoxel) {
          ASSERT_EQ(word, expected);
          ++found.surface;
          continue;
        }
        ASSERT_EQ(kernels::word_kind(word), kernels::kEmptyVoxel);
        ASSERT_EQ(kernels::empty_side(word), kernels::empty_side(expected));
        const int32_t side = kernels::is_brick(word) ? 1 << grid.brick_levels : 1;
        const int32_t low[3] = {voxel[0] & -side, voxel[1] & -side, voxel[2] & -side};
        if ((voxel[0] + 2 * voxel[1] + 3 * voxel[2]) % 13 == 0) {
          ASSERT_TRUE(box_is_alike(field, word, low, side));
        }
        found.bricks += side > 1;
        found.boxes += word >> 8 != 0;
      }
}

/// For `seeds` random assets from number `first` on.
void check_random_assets(uint64_t first, uint64_t seeds) {
  Found found;
  for (uint64_t seed = first; seed < first + seeds; ++seed) {
    const std::vector<std::byte> file =
        format::encode(random_asset(seed, {.objects = 1, .max_voxels = seed % 4 == 0 ? 90u : 30u}));
    const format::AssetView asset = format::read_asset(file, "test");
    const PlanesField& field = asset.objects[0].as<kernels::SegmentField>();
    check(field, 0, found);
    check(field, kernels::cpu::kMostWithoutBricks, found);
    if (testing::Test::HasFatalFailure()) return;
  }
  for (const uint64_t grids : found.with_levels) EXPECT_GT(grids, seeds / 12);
  EXPECT_GT(found.surface, seeds * 2'500);
  EXPECT_GT(found.boxes, seeds * 2'500);
  EXPECT_GT(found.bricks, seeds * 250);
}

TEST(TraversalGrid, SaysWhatTheFieldSays) { check_random_assets(0, 8); }
TEST(TraversalGrid, SaysWhatManyFieldsSay) { check_random_assets(8, 32); }

}  // namespace
}  // namespace nif::test
