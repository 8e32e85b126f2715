// `exact` objects in a file: what is written is what is read, and each wrong field is refused.
#include <gtest/gtest.h>

#include <functional>

#include "formats/nif/reader.hpp"
#include "formats/nif/writer.hpp"
#include "tests/format/damaged.hpp"
#include "tests/support/query_object.hpp"

namespace nif {
namespace {

using test::Bytes, test::outcome_of;

format::Asset asset_with_exact(uint64_t seed, uint32_t coded = 0) {
  test::RandomAssetOptions options;
  options.objects = 1;
  options.exacts = 2;
  options.coded = coded;
  return test::random_asset(seed, options);
}

TEST(ExactFile, KeepsEveryFieldAndAnswer) {
  for (uint64_t seed = 0; seed < 20; ++seed) {
    const format::Asset asset = asset_with_exact(seed, seed % 2 ? 0u : uint32_t{format::kCodedPayloads});
    const Bytes bytes = format::encode(asset);
    const format::AssetView view = format::read_asset(bytes, "file");
    EXPECT_EQ(bytes, format::encode(format::to_asset(view)));
    test::Random random(seed);
    uint64_t proven = 0, blocked = 0;
    for (size_t i = 1; i < 3; ++i) {
      EXPECT_EQ(format::encoding_of(view.objects[i]).number, 4u);
      const auto& seen = view.objects[i].as<format::ExactView>();
      const auto& data = asset.objects[i].as<format::ExactData>();
      EXPECT_EQ(seen.tree_bytes, data.triangles.bytes());
      EXPECT_EQ(seen.occupancy.decoded > 0, (seen.coded & format::kCodedOccupancy) != 0);
      const kernels::ExactField field = format::field_of(data);
      for (int ray = 0; ray < 500; ++ray) {
        const kernels::Segment segment = test::random_segment(random, field);
        const kernels::Answer ours = kernels::query(field, segment),
                              theirs = kernels::query(seen.field, segment),
                              its_bvh = kernels::query(field.triangles, segment);
        ASSERT_EQ(ours.logit, theirs.logit);
        ASSERT_EQ(ours.certain, theirs.certain);
        ASSERT_EQ(ours.logit, its_bvh.logit);
        ASSERT_EQ(ours.certain, its_bvh.certain);
        kernels::WalkResult walk;
        kernels::follow_segment(
            field.planes, segment, walk, [](uint32_t, const kernels::Run&) {}, kernels::NoVisit());
        proven += walk.certain;
        blocked += !ours.visible;
      }
    }
    EXPECT_GT(proven, 50u);
    EXPECT_LT(proven, 1000u);
    EXPECT_GT(blocked, 0u);
  }
}

TEST(ExactFile, RefusesWrongRecords) {
  for (const uint32_t coded : {0u, uint32_t{format::kCodedPayloads}}) {
    const Bytes good = format::encode(asset_with_exact(2, coded));
    const auto refused = [&](uint32_t index, const std::function<void(format::ExactRecord&)>& change) {
      return outcome_of(test::with_record<format::ExactRecord>(good, format::kExactRecords, index, change))
                 .status == Status::damaged_nif;
    };
    const float nan = std::numeric_limits<float>::quiet_NaN(),
                infinity = std::numeric_limits<float>::infinity();
    EXPECT_FALSE(refused(0, [](auto&) {}));
    EXPECT_TRUE(refused(0, [](auto& r) { r.origin[1] += 1e3f; }));
    EXPECT_TRUE(refused(0, [](auto& r) { r.origin[1] = 0x1p50f; }));
    EXPECT_TRUE(refused(0, [&](auto& r) { r.origin[2] = nan; }));
    EXPECT_TRUE(refused(0, [&](auto& r) { r.voxels_per_unit = infinity; }));
    EXPECT_TRUE(refused(0, [](auto& r) { r.voxels_per_unit = 0; }));
    EXPECT_TRUE(refused(0, [](auto& r) { r.voxels_per_unit = 1e-30f; }));
    EXPECT_TRUE(refused(0, [](auto& r) { r.voxels_per_unit *= 100; }));
    EXPECT_TRUE(refused(0, [](auto& r) { r.voxels[0] = 0; }));
    EXPECT_TRUE(refused(0, [](auto& r) { r.voxels[2] = 1000; }));
    EXPECT_TRUE(refused(0, [](auto& r) { r.levels = 5; }));
    EXPECT_TRUE(refused(1, [](auto& r) { r.mixed_bricks += 1; }));
    EXPECT_TRUE(refused(1, [](auto& r) { r.surface_voxels -= 1; }));
    EXPECT_TRUE(refused(1, [](auto& r) { r.part_count += 1; }));
    EXPECT_TRUE(refused(1, [](auto& r) { r.part_count = 0xffffffff; }));
    EXPECT_TRUE(refused(0, [](auto& r) { r.forms |= format::kCodedFeatures; }));
    EXPECT_TRUE(refused(0, [](auto& r) { r.forms |= format::kStatedCorners; }));
    EXPECT_TRUE(refused(0, [](auto& r) { r.forms ^= format::kStatedKinds; }));
    EXPECT_TRUE(refused(0, [](auto& r) { r.forms ^= format::kCodedOccupancy; }));
    EXPECT_TRUE(refused(0, [](auto& r) { r.nodes += 1; }));
    EXPECT_TRUE(refused(0, [](auto& r) { r.vertices = 0xffffffff; }));
    EXPECT_TRUE(refused(0, [](auto& r) { r.triangles -= 1; }));
    EXPECT_TRUE(refused(0, [](auto& r) { r.reserved = 1; }));
    EXPECT_TRUE(refused(1, [](auto& r) { r.occupancy.offset += 64; }));
    EXPECT_TRUE(refused(1, [](auto& r) { r.cells.bytes += 4; }));
    EXPECT_TRUE(refused(1, [](auto& r) { r.tree.offset = ~uint64_t{0} - 63; }));
  }
}

/// Cells that the planes and the voxels around them do not prove.
TEST(ExactFile, RefusesSidesThatAreNotProven) {
  format::Asset asset = asset_with_exact(2);
  auto& grid = asset.objects[1].as<format::ExactData>().proof;
  uint32_t& word = *std::find_if(grid.voxel_records.begin(), grid.voxel_records.end(),
                                 [](uint32_t planes) { return planes != kernels::kBareCell; });
  word = (word & ~15u) | kernels::kind_of({kernels::kSeenInside, 0, false});
  EXPECT_THROW(format::encode(asset), Error);
}

}  // namespace
}  // namespace nif
