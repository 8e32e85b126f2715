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
    const format::Asset asset = asset_with_exact(seed, seed % 2 ? 0u : test::kCodedAll);
    const Bytes bytes = format::encode(asset);
    const format::AssetView view = format::read_asset(bytes, "file");
    EXPECT_EQ(bytes, format::encode(format::to_asset(view)));
    test::Random random(seed);
    uint64_t proven = 0, blocked = 0;
    for (size_t i = 1; i < 3; ++i) {
      EXPECT_EQ(format::encoding_of(view.objects[i]).number, 4u);
      const format::ObjectView& object = view.objects[i];
      EXPECT_EQ(object.triangles->tree_bytes, asset.objects[i].triangles->bytes());
      const kernels::ExactField field =
                                    std::get<kernels::ExactField>(format::field_of(asset, asset.objects[i])),
                                seen = object.as<kernels::ExactField>();
      for (int ray = 0; ray < 500; ++ray) {
        const kernels::Segment segment = test::random_segment(random, field);
        const kernels::Answer ours = kernels::query(field, segment), theirs = kernels::query(seen, segment),
                              its_bvh = kernels::query(field.triangles, segment);
        ASSERT_EQ(ours.logit, theirs.logit);
        ASSERT_EQ(ours.certain, theirs.certain);
        ASSERT_EQ(ours.logit, its_bvh.logit);
        ASSERT_EQ(ours.certain, its_bvh.certain);
        kernels::TraversalResult traversal;
        kernels::follow_segment(
            field.planes, segment, traversal, [](uint32_t, const kernels::Interval&) {}, kernels::NoVisit());
        proven += traversal.certain;
        blocked += !ours.visible;
      }
    }
    EXPECT_GT(proven, 50u);
    EXPECT_LT(proven, 1000u);
    EXPECT_GT(blocked, 0u);
  }
}

/// Planes that are valid by themselves but do not enclose the triangles.
TEST(ExactFile, RefusesPlanesFarFromTheTriangles) {
  for (const uint32_t coded : {0u, test::kCodedAll}) {
    const Bytes good = format::encode(asset_with_exact(2, coded));
    const auto sentence = [&](const std::function<void(format::PlanesRecord&)>& change) {
      return outcome_of(test::with_record<format::PlanesRecord>(good, format::kPlanes, 1, change)).sentence;
    };
    EXPECT_EQ(sentence([](auto&) {}), "");
    const std::string place = "x.nif: section TRIS, record 0: ";
    EXPECT_EQ(sentence([](auto& r) { r.origin[1] += 1e3f; }), place + "the bvh is not where the grid is");
    EXPECT_EQ(sentence([](auto& r) { r.voxels_per_unit *= 100; }),
              place + "the bvh is not where the grid is");
    EXPECT_EQ(sentence([](auto& r) { r.origin[1] = 0x1p50f; }), place + "the grid reaches too far");
    EXPECT_EQ(sentence([](auto& r) { r.voxels_per_unit = 1e-30f; }), place + "the grid reaches too far");
  }
}

/// Kinds of cells that the planes and the voxels around them do not prove.
TEST(ExactFile, RefusesSidesThatAreNotProven) {
  format::Asset asset = asset_with_exact(2);
  format::PlanesData& grid = *asset.objects[1].planes;
  uint32_t& word = *std::find_if(grid.voxel_records.begin(), grid.voxel_records.end(),
                                 [](uint32_t planes) { return planes != kernels::kBareCell; });
  word = (word & ~15u) | kernels::kind_of({kernels::kSeenInside, 0, false});
  EXPECT_THROW(format::encode(asset), Error);
}

}  // namespace
}  // namespace nif
