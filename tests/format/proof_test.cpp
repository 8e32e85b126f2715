// `proof` objects in a file: what is written is what is read, each wrong field is refused, and the part of a
// ray that is left open is where planes leave it open.
#include <gtest/gtest.h>

#include <functional>

#include "formats/nif/reader.hpp"
#include "formats/nif/writer.hpp"
#include "kernels/reference/scene_query.hpp"
#include "tests/format/damaged.hpp"
#include "tests/support/query_object.hpp"

namespace nif {
namespace {

using test::Bytes, test::outcome_of;

format::Asset asset_with_proofs(uint64_t seed, uint32_t coded = 0) {
  test::RandomAssetOptions options;
  options.objects = 1;
  options.proofs = 2;
  options.coded = coded;
  return test::random_asset(seed, options);
}

TEST(ProofFile, KeepsEveryFieldAndAnswer) {
  for (uint64_t seed = 0; seed < 20; ++seed) {
    const format::Asset asset = asset_with_proofs(seed, seed % 2 ? 0u : test::kCodedAll);
    const Bytes bytes = format::encode(asset);
    const format::AssetView view = format::read_asset(bytes, "file");
    EXPECT_EQ(bytes, format::encode(format::to_asset(view)));
    test::Random random(seed);
    uint64_t proven = 0, open = 0;
    for (size_t i = 1; i < 3; ++i) {
      EXPECT_EQ(format::encoding_of(view.objects[i]).number, 5u);
      const format::PlanesView& seen = *view.objects[i].planes;
      EXPECT_EQ(seen.occupancy.decoded > 0, (seen.coded & format::kCodedOccupancy) != 0);
      const kernels::PlanesField field = format::field_of(*asset.objects[i].planes);
      for (int ray = 0; ray < 500; ++ray) {
        const kernels::Segment segment = test::random_segment(random, field);
        const kernels::Answer ours = kernels::query(field, segment),
                              theirs = kernels::query(seen.field, segment);
        ASSERT_EQ(ours.logit, theirs.logit);
        ASSERT_EQ(ours.certain, theirs.certain);
        proven += ours.certain;
        open += ours.logit == kernels::kOpenLogit;
        if (ours.logit != kernels::kOpenLogit) continue;
        EXPECT_FALSE(ours.visible || ours.certain);
        EXPECT_EQ(kernels::visible_probability(ours.logit, kernels::calibration(field)), 0.5f);
      }
    }
    EXPECT_GT(proven, 50u);
    EXPECT_GT(open, 10u);
  }
}

/// Outside of the interval that is left open, the ray is proven visible.
TEST(ProofFile, LeavesOpenNoMoreThanItsPart) {
  uint64_t open = 0;
  for (uint64_t seed = 0; seed < 20; ++seed) {
    const format::Asset asset = asset_with_proofs(seed);
    const kernels::PlanesField field = format::field_of(*asset.objects[1].planes);
    test::Random random(seed);
    for (int ray = 0; ray < 500; ++ray) {
      const kernels::Segment segment = test::random_segment(random, field);
      kernels::OpenInterval part;
      if (kernels::prove(field, segment, part).logit != kernels::kOpenLogit) continue;
      ++open;
      ASSERT_LE(segment.tmin, part.begin);
      ASSERT_LE(part.begin, part.end);
      ASSERT_LE(part.end, segment.tmax);
      for (const bool before : {true, false}) {
        kernels::Segment rest = segment;
        (before ? rest.tmax : rest.tmin) = before ? part.begin : part.end;
        kernels::OpenInterval none;
        if (!(rest.tmin < rest.tmax)) continue;
        EXPECT_TRUE(kernels::prove(field, rest, none).certain);
      }
    }
  }
  EXPECT_GT(open, 500u);
}

TEST(ProofFile, RefusesWrongRecords) {
  for (const uint32_t coded : {0u, test::kCodedAll}) {
    const Bytes good = format::encode(asset_with_proofs(2, coded));
    const auto refused = [&](uint32_t index, const std::function<void(format::PlanesRecord&)>& change) {
      return outcome_of(test::with_record<format::PlanesRecord>(good, format::kPlanes, index, change))
                 .status == Status::damaged_nif;
    };
    const float nan = std::numeric_limits<float>::quiet_NaN(),
                infinity = std::numeric_limits<float>::infinity();
    EXPECT_FALSE(refused(0, [](auto&) {}));
    EXPECT_TRUE(refused(0, [&](auto& r) { r.origin[2] = nan; }));
    EXPECT_TRUE(refused(0, [&](auto& r) { r.voxels_per_unit = infinity; }));
    EXPECT_TRUE(refused(0, [](auto& r) { r.voxels_per_unit = 0; }));
    EXPECT_TRUE(refused(0, [](auto& r) { r.voxels[0] = 0; }));
    EXPECT_TRUE(refused(0, [](auto& r) { r.voxels[2] = 1000; }));
    EXPECT_TRUE(refused(0, [](auto& r) { r.levels = 5; }));
    EXPECT_TRUE(refused(1, [](auto& r) { r.mixed_bricks += 1; }));
    EXPECT_TRUE(refused(1, [](auto& r) { r.surface_voxels -= 1; }));
    EXPECT_TRUE(refused(1, [](auto& r) { r.child_count += 1; }));
    EXPECT_TRUE(refused(1, [](auto& r) { r.child_count = 0xffffffff; }));
    EXPECT_TRUE(refused(0, [](auto& r) { r.forms |= format::kPlanesForms + 1; }));
    EXPECT_TRUE(refused(0, [](auto& r) { r.forms ^= format::kStatedKinds; }));
    EXPECT_TRUE(refused(0, [](auto& r) { r.forms ^= format::kCodedOccupancy; }));
    EXPECT_TRUE(refused(1, [](auto& r) { r.occupancy.offset += 64; }));
    EXPECT_TRUE(refused(1, [](auto& r) { r.cells.bytes += 4; }));
  }
}

}  // namespace
}  // namespace nif
