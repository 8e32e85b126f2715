// Fields for primary rays in files: everything is kept, readers may do without them, and what is wrong is
// refused.
#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "formats/nif/writer.hpp"
#include "tests/format/damaged.hpp"
#include "tests/format/optional.hpp"
#include "tests/support/query_object.hpp"

namespace nif {
namespace {

using test::Bytes;
using test::status_of;

/// A `segment`, a `bvh` and two `spherical` objects, the first three of them with fields for primary rays.
format::Asset asset_with_primaries(uint64_t seed, uint32_t primaries = 3) {
  return test::random_asset(
      seed,
      {.objects = 1, .instances = 1, .max_voxels = 9, .bvhs = 1, .sphericals = 2, .primaries = primaries});
}

TEST(PrimaryFile, KeepsEveryFieldAndAnswer) {
  uint64_t hits = 0;
  for (uint64_t seed = 0; seed < 20; ++seed) {
    const format::Asset asset = asset_with_primaries(seed);
    const Bytes bytes = format::encode(asset);
    const format::AssetView view = format::read_asset(bytes, "file");
    EXPECT_EQ(bytes, format::encode(format::to_asset(view)));
    ASSERT_EQ(view.primaries.size(), 3u);
    EXPECT_EQ(view.primary_of(3), nullptr);
    test::Random random(seed);
    for (uint32_t i = 0; i < 3; ++i) {
      const format::Primary& primary = *asset.objects[i].primary;
      const format::PrimaryView* seen = view.primary_of(i);
      ASSERT_NE(seen, nullptr);
      EXPECT_EQ(seen->object, i);
      EXPECT_EQ(seen->grid_bytes + seen->network_bytes, primary.bytes());
      EXPECT_EQ(seen->field.position.values.half, primary.half_grids);
      EXPECT_EQ(seen->field.network.weights.half, primary.half_network);
      EXPECT_EQ(seen->field.slope, primary.slope);
      EXPECT_EQ(seen->field.margin, primary.margin);
      const auto at = static_cast<const std::byte*>(seen->field.position.values.data) - bytes.data();
      EXPECT_EQ(uint64_t(at) % format::kAlignment, 0u);
      const kernels::PrimaryField field = format::field_of(primary, asset.objects[i].bounds());
      for (int ray = 0; ray < 500; ++ray) {
        const kernels::Segment segment = test::random_segment(random, field);
        const kernels::PrimaryAnswer ours = kernels::query_primary(field, segment),
                                     theirs = kernels::query_primary(seen->field, segment);
        ASSERT_EQ(ours.hit, theirs.hit);
        ASSERT_EQ(ours.t, theirs.t);
        ASSERT_EQ(ours.start, theirs.start);
        for (int a = 0; a < 3; ++a) ASSERT_EQ(ours.normal[a], theirs.normal[a]);
        if (!ours.hit) continue;
        ++hits;
        ASSERT_TRUE(std::isfinite(ours.t) && ours.t <= segment.tmax && ours.start <= ours.t);
        ASSERT_NEAR(std::hypot(ours.normal[0], ours.normal[1], ours.normal[2]), 1, 1e-4);
      }
    }
  }
  EXPECT_GT(hits, 3'000u);
}

TEST(PrimaryFile, IsOptional) {
  test::expect_optional(format::encode(asset_with_primaries(1)), format::encode(asset_with_primaries(1, 0)),
                        {format::kPrimaries, format::kPrimaryValues});
}

TEST(PrimaryFile, RefusesWrongRecords) {
  const auto refused = [](uint32_t index, const std::function<void(format::PrimaryRecord&)>& change) {
    return status_of(test::with_record<format::PrimaryRecord>(format::encode(asset_with_primaries(2)),
                                                              format::kPrimaries, index, change)) ==
           Status::damaged_nif;
  };
  EXPECT_FALSE(refused(0, [](auto&) {}));
  EXPECT_FALSE(refused(2, [](auto& r) { r.object = 3; })) << "any object may have one";
  EXPECT_TRUE(refused(2, [](auto& r) { r.object = 4; }));
  EXPECT_TRUE(refused(1, [](auto& r) { r.object = 0; }));
  EXPECT_TRUE(refused(1, [](auto& r) { r.object = 2; }));
  EXPECT_TRUE(refused(0, [](auto& r) { r.resolution = 1; }));
  EXPECT_TRUE(refused(0, [](auto& r) { r.resolution = 0xffff; }));
  EXPECT_TRUE(refused(0, [](auto& r) { r.resolution += 1; }));
  EXPECT_TRUE(refused(0, [](auto& r) { r.features = 0; }));
  EXPECT_TRUE(refused(0, [](auto& r) { r.features = 9; }));
  EXPECT_TRUE(refused(0, [](auto& r) { r.half_grids = 2; }));
  EXPECT_TRUE(refused(0, [](auto& r) { r.half_grids ^= 1; }));
  EXPECT_TRUE(refused(0, [](auto& r) { r.half_network = 2; }));
  EXPECT_TRUE(refused(0, [](auto& r) { r.half_network ^= 1; }));
  EXPECT_TRUE(refused(0, [](auto& r) { r.slope = -0.1f; }));
  EXPECT_TRUE(refused(0, [](auto& r) { r.slope = std::numeric_limits<float>::quiet_NaN(); }));
  EXPECT_TRUE(refused(0, [](auto& r) { r.margin = 1.5f; }));
  EXPECT_TRUE(refused(0, [](auto& r) { r.margin = std::numeric_limits<float>::quiet_NaN(); }));
  EXPECT_TRUE(refused(0, [](auto& r) { r.network.inputs += 2; }));
  EXPECT_TRUE(refused(0, [](auto& r) { r.network.width = 6; }));
  EXPECT_TRUE(refused(0, [](auto& r) { r.network.width = 260; }));
  EXPECT_TRUE(refused(0, [](auto& r) { r.network.hidden_layers = 0; }));
  EXPECT_TRUE(refused(0, [](auto& r) { r.network.hidden_layers = 4; }));
  for (size_t i = 0; i < std::size(format::PrimaryRecord{}.reserved); ++i)
    EXPECT_TRUE(refused(0, [&](auto& r) { r.reserved[i] = 1; })) << i;
  EXPECT_TRUE(refused(1, [](auto& r) { r.values.offset += 64; }));
  EXPECT_TRUE(refused(1, [](auto& r) { r.values.bytes = ~uint64_t{0}; }));
}

TEST(PrimaryFile, RefusesWhatCannotBeComputedWith) {
  const auto status_after = [](const std::function<void(format::Asset&)>& change) {
    format::Asset asset = asset_with_primaries(3);
    change(asset);
    try {
      format::encode(asset);
      return Status::ok;
    } catch (const Error& error) {
      return error.status();
    }
  };
  EXPECT_EQ(status_after([](auto& a) { a.objects[0].primary->position[0] = 4096; }), Status::ok);
  EXPECT_EQ(status_after([](auto& a) { a.objects[0].primary->direction[0] = -4200; }), Status::internal);
  EXPECT_EQ(status_after([](auto& a) { a.objects[0].primary->network.weights.back() = 1e9f; }),
            Status::internal);
  EXPECT_EQ(status_after([](auto& a) { a.objects[0].primary->network.weights.pop_back(); }),
            Status::internal);
  EXPECT_EQ(status_after([](auto& a) { a.objects[0].aabb_max = a.objects[0].aabb_min; }), Status::internal)
      << "a point";
}

}  // namespace
}  // namespace nif
