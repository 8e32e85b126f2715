// The accuracy of first hits is measured correctly, and reported by a bake.
#include "bake/ground_truth/evaluate_hits.hpp"

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <nlohmann/json.hpp>

#include "bake/bake.hpp"
#include "bake/ground_truth/prepare.hpp"
#include "tests/bake/quiet_bake.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::bake {
namespace {

class Hits : public testing::Test {
 protected:
  const mesh::Scene scene_ = test::scene_of({test::torus(64, 32)});
  const PreparedScene prepared_ = prepare(scene_, false);
  const GroundTruth truth_{prepared_.objects[0]};
  const RaysWithTruth rays_ = make_ray_set(truth_.source(), RaySet::outer_lines, 8000, 1);
  const double diagonal_ = prepared_.objects[0].box.diagonal();

  /// Embree's own hits.
  FirstHits right(std::span<const Segment> segments) const {
    FirstHits found(segments.size());
    for (size_t i = 0; i < segments.size(); ++i) {
      const auto hit = truth_.source().embree.first_hit(segments[i]);
      found.hit[i] = hit.has_value();
      found.certain[i] = 1;
      found.low[i] = found.high[i] = found.t[i] = hit ? hit->t : kInfinity;
      found.triangle[i] = hit ? hit->triangle : FirstHits::kNoTriangle;
      if (!hit) continue;
      const Double3 direction = to_double(std::to_array(segments[i].direction));
      const double size = (dot(hit->normal, direction) > 0 ? -1 : 1) / length(hit->normal);
      for (size_t a = 0; a < 3; ++a) found.normal[i][a] = float(hit->normal[a] * size);
    }
    return found;
  }
  HitFigures figures(const HitFinder& find, double voxels_per_unit = 0) const {
    return evaluate_hits(rays_.segments, find, truth_.source().embree, {diagonal_, voxels_per_unit})
        .figures();
  }
};

TEST_F(Hits, NothingIsWrongWithTheTruth) {
  const HitFigures all = figures([&](auto segments) { return right(segments); });
  EXPECT_EQ(all.rays, 8000u);
  EXPECT_EQ(all.missed, 0u);
  EXPECT_EQ(all.false_hits, 0u);
  EXPECT_EQ(all.bounds_wrong, 0u);
  EXPECT_EQ(all.certain, all.rays);
  EXPECT_GT(all.compared, all.rays / 4);
  EXPECT_EQ(all.triangles, all.compared);
  EXPECT_EQ(all.displaced, 0u);
  EXPECT_EQ(all.place->back(), 0);
  EXPECT_LT(all.angle->back(), 0.01);
  EXPECT_FALSE(all.voxels);
}

/// Each injected error is counted with its size.
TEST_F(Hits, ErrorsAreMeasured) {
  constexpr double kOff = 0.02;
  const auto wrong = [&](std::span<const Segment> segments) {
    FirstHits found = right(segments);
    uint32_t number = 0;
    for (size_t i = 0; i < segments.size(); ++i) {
      if (!found.hit[i]) {
        if (number++ % 4 == 0) found.hit[i] = 1, found.t[i] = 1;
        continue;
      }
      if (number++ % 8 == 0) {
        found.hit[i] = 0;
        continue;
      }
      // A fifth of the hits are wrong, so the 90th percentile shows it and the median does not.
      if (number % 5 != 0) continue;
      found.t[i] += float(kOff);
      found.low[i] = found.high[i] = found.t[i];
      for (float& value : found.normal[i]) value = -value;
    }
    return found;
  };
  const HitFigures all = figures(wrong, 50);
  const HitFigures exact = figures([&](auto segments) { return right(segments); });
  EXPECT_NEAR(double(all.missed), double(exact.compared) / 8, 0.05 * double(exact.compared));
  EXPECT_NEAR(double(all.false_hits), double(all.rays - exact.compared) / 4, 0.1 * double(all.rays));
  EXPECT_GT(all.bounds_wrong, all.compared / 10);
  EXPECT_EQ(all.compared + all.missed, exact.compared);
  EXPECT_NEAR((*all.place)[0], 0, 1e-9);
  EXPECT_NEAR((*all.place)[1], kOff / diagonal_, 1e-5);
  EXPECT_NEAR((*all.voxels)[3], kOff * 50, 1e-3);
  EXPECT_LT((*all.angle)[0], 0.01);
  EXPECT_NEAR((*all.angle)[1], 180, 0.01);
}

TEST_F(Hits, PercentilesAreValuesThatOccur) {
  std::vector<float> values;
  for (int i = 100; i > 0; --i) values.push_back(float(i));
  EXPECT_EQ(percentiles_of(values), (Percentiles{50, 90, 95, 99}));
  EXPECT_EQ(percentiles_of({7}), (Percentiles{7, 7, 7, 7}));
}

TEST_F(Hits, ABakeTellsThem) {
  const BakeResult result = test::bake_quietly(scene_, test::small_field(0.2));
  const auto metadata = nlohmann::json::parse(result.asset.metadata);
  for (const RaySet set : kRaySets) {
    SCOPED_TRACE(name_of(set));
    const HitFigures& hits = result.hits[size_t(set)];
    const bool asked = std::find(kHitSets.begin(), kHitSets.end(), set) != kHitSets.end();
    EXPECT_EQ(hits.rays, asked ? 2000u : 0u);
    const auto& accuracy = metadata["objects"][0]["accuracy"][name_of(set)];
    EXPECT_EQ(accuracy.contains("hits"), asked);
    EXPECT_FALSE(metadata["accuracy"][name_of(set)].contains("hits"));
    if (!asked) continue;
    EXPECT_EQ(hits.bounds_wrong, 0u);
    EXPECT_LT(hits.rate(hits.missed + hits.false_hits), 0.02);
    ASSERT_TRUE(hits.voxels && hits.angle);
    EXPECT_LT((*hits.voxels)[0], 0.1);
    EXPECT_GT((*hits.angle)[0], 0.1);
    EXPECT_LT((*hits.angle)[0], 10);
    const auto& told = accuracy["hits"];
    EXPECT_EQ(told["rays"], 2000);
    EXPECT_NEAR(told["voxels"]["p99"].get<double>(), (*hits.voxels)[3], 1e-3 * (*hits.voxels)[3]);
    EXPECT_LT(told.dump().size(), 300u);  // metadata must stay small
  }

  BakeResult alone;
  tbb::task_arena(1).execute([&] { alone = test::bake_quietly(scene_, test::small_field(0.2)); });
  EXPECT_EQ(alone.asset.metadata, result.asset.metadata);
}

TEST_F(Hits, ExactObjectsAreRight) {
  for (const std::string encoding : {"bvh", "exact"}) {
    BakeOptions options = test::small_field(1);
    options.encoding = encoding;
    if (encoding == "bvh") options.resolution.reset();
    const BakeResult result = test::bake_quietly(scene_, options);
    for (const RaySet set : kHitSets) {
      const HitFigures& hits = result.hits[size_t(set)];
      EXPECT_LE(hits.missed + hits.false_hits, 1u) << encoding;
      EXPECT_EQ(hits.triangles, hits.compared) << encoding;
      EXPECT_LE(hits.displaced, hits.compared / 100) << encoding;
      EXPECT_EQ(hits.voxels.has_value(), encoding == "exact") << encoding;
    }
  }
}

}  // namespace
}  // namespace nif::bake
