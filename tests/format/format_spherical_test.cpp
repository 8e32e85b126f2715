// `spherical` objects in files: everything is kept, in either precision, and what is wrong is refused.
#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "formats/nif/writer.hpp"
#include "tests/format/damaged.hpp"
#include "tests/support/query_object.hpp"

namespace nif {
namespace {

using test::Bytes;
using test::status_of;

/// One `segment` object, then three `spherical` ones of which the first two share networks.
format::Asset asset_with_sphericals(uint64_t seed) {
  return test::random_asset(seed, {.objects = 1, .instances = 1, .max_voxels = 6, .sphericals = 3});
}

TEST(SphericalFile, KeepsEveryFieldAndAnswer) {
  uint64_t asked = 0;
  for (uint64_t seed = 0; seed < 20; ++seed) {
    const format::Asset asset = asset_with_sphericals(seed);
    const Bytes bytes = format::encode(asset);
    const format::AssetView view = format::read_asset(bytes, "file");
    EXPECT_EQ(bytes, format::encode(format::to_asset(view)));
    ASSERT_EQ(view.spherical_networks.size(), 2u);
    for (size_t n = 0; n < 2; ++n) {
      EXPECT_EQ(view.spherical_networks[n].bytes, asset.spherical_networks[n].bytes());
      EXPECT_EQ(view.spherical_networks[n].slope, asset.spherical_networks[n].slope);
    }
    test::Random random(seed);
    for (size_t i = 1; i < 4; ++i) {
      const format::Object& object = asset.objects[i];
      const format::ObjectView& seen = view.objects[i];
      const auto& [number, grids] = *object.spherical;
      const auto& [network, spherical, grid_bytes] = *seen.spherical;
      EXPECT_EQ(format::encoding_of(seen).number, 2u);
      EXPECT_EQ(network, i < 3 ? 0u : 1u);
      EXPECT_EQ(network, number);
      EXPECT_EQ(grid_bytes, grids.bytes());
      EXPECT_EQ(kernels::calibration(format::field_of(seen)).scale, kernels::kSphericalLogitScale);
      EXPECT_EQ(kernels::calibration(format::field_of(seen)).threshold, 0);
      EXPECT_EQ(spherical.distance.values.half, grids.half);
      const auto at = static_cast<const std::byte*>(spherical.outer_position.values.data) - bytes.data();
      EXPECT_EQ(uint64_t(at) % format::kAlignment, 0u);
      const kernels::SphericalField field =
          format::field_of(grids, asset.spherical_networks[number], object.bounds());
      for (int ray = 0; ray < 500; ++ray) {
        const kernels::Segment segment = test::random_segment(random, field);
        const kernels::Answer ours = kernels::query(field, segment),
                              theirs = kernels::query(spherical, segment);
        ASSERT_EQ(ours.logit, theirs.logit);
        ASSERT_EQ(ours.certain, theirs.certain);
        asked += !ours.certain;
      }
    }
  }
  EXPECT_GT(asked, 10'000u);
}

TEST(SphericalFile, HasItsSectionsOnlyWhereTheyAreNeeded) {
  const Bytes with = format::encode(asset_with_sphericals(1)),
              without = format::encode(test::random_asset(1));
  for (const uint32_t type : test::sections_of(format::SphericalPart())) {
    const uint32_t index = test::find_section(with, type);
    EXPECT_EQ(test::section_entry(with, index).flags, format::kRequired);
    for (uint32_t i = 0; i < test::load<format::Header>(without, 0).section_count; ++i)
      EXPECT_NE(test::section_entry(without, i).type, type);
    Bytes gone = with;
    auto entry = test::section_entry(gone, index);
    entry.type = format::fourcc("GONE");
    entry.flags = 0;
    test::store_entry(gone, index, entry);
    test::fix_checksums(gone);
    EXPECT_EQ(status_of(gone), Status::damaged_nif);
  }
  format::Asset idle = test::random_asset(1);
  idle.spherical_networks = asset_with_sphericals(1).spherical_networks;
  EXPECT_EQ(format::encode(idle), without) << "networks of no object are left out";
}

template <class Record>
bool refuses(uint32_t section, uint32_t index, const std::function<void(Record&)>& change) {
  return status_of(test::with_record<Record>(format::encode(asset_with_sphericals(2)), section, index,
                                             change)) == Status::damaged_nif;
}

TEST(SphericalFile, RefusesWrongObjects) {
  const auto object = [](uint32_t index, const std::function<void(format::ObjectRecord&)>& change) {
    return refuses<format::ObjectRecord>(format::kObjects, index, change);
  };
  EXPECT_FALSE(object(1, [](auto&) {}));
  EXPECT_TRUE(object(1, [](auto& r) { std::swap(r.spherical, r.planes); }));
  EXPECT_TRUE(object(1, [](auto& r) { std::swap(r.spherical, r.triangles); }));
  EXPECT_TRUE(object(2, [](auto& r) { r.spherical = 0; }));
  EXPECT_TRUE(object(3, [](auto& r) { r.spherical = 3; }));
  EXPECT_TRUE(object(1, [](auto& r) { r.aabb_max[0] = 3e38f; }));
  EXPECT_TRUE(object(1, [](auto& r) { std::copy_n(r.aabb_min, 3, r.aabb_max); })) << "a point";

  const auto spherical = [](uint32_t index, const std::function<void(format::SphericalRecord&)>& change) {
    return refuses<format::SphericalRecord>(format::kSphericalRecords, index, change);
  };
  EXPECT_FALSE(spherical(0, [](auto&) {}));
  EXPECT_TRUE(spherical(0, [](auto& r) { r.network = 2; }));
  EXPECT_TRUE(spherical(0, [](auto& r) { r.outer_resolution = 1; }));
  EXPECT_TRUE(spherical(0, [](auto& r) { r.outer_resolution = 0xffff; }));
  EXPECT_TRUE(spherical(0, [](auto& r) { r.inner_resolution += 1; }));
  EXPECT_TRUE(spherical(0, [](auto& r) { r.distance_resolution = 0; }));
  EXPECT_TRUE(spherical(0, [](auto& r) { r.outer_features += 1; }));
  EXPECT_TRUE(spherical(0, [](auto& r) { r.inner_features = 0; }));
  EXPECT_TRUE(spherical(0, [](auto& r) { r.distance_features = 9; }));
  EXPECT_TRUE(spherical(0, [](auto& r) { r.half_grids ^= 1; }));
  EXPECT_TRUE(spherical(0, [](auto& r) { r.half_grids = 2; }));
  EXPECT_TRUE(spherical(1, [](auto& r) { r.grids.offset += 64; }));
  EXPECT_TRUE(spherical(1, [](auto& r) { r.grids.bytes = ~uint64_t{0}; }));
  EXPECT_TRUE(spherical(0, [](auto& r) { r.reserved = 1; }));
}

TEST(SphericalFile, RefusesWrongNetworks) {
  const auto network = [](const std::function<void(format::SphericalNetworksRecord&)>& change) {
    return refuses<format::SphericalNetworksRecord>(format::kSphericalNetworks, 1, change);
  };
  EXPECT_FALSE(network([](auto&) {}));
  EXPECT_TRUE(network([](auto& r) { r.half = 2; }));
  EXPECT_TRUE(network([](auto& r) { r.half ^= 1; }));
  EXPECT_TRUE(network([](auto& r) { r.slope = -0.1f; }));
  EXPECT_TRUE(network([](auto& r) { r.slope = std::numeric_limits<float>::quiet_NaN(); }));
  EXPECT_TRUE(network([](auto& r) { r.outer.inputs += 1; }));
  EXPECT_TRUE(network([](auto& r) { r.outer.inputs = 0; }));
  EXPECT_TRUE(network([](auto& r) { r.inner.width = 6; }));
  EXPECT_TRUE(network([](auto& r) { r.inner.width = 132; }));
  EXPECT_TRUE(network([](auto& r) { r.inner.hidden_layers = 0; }));
  EXPECT_TRUE(network([](auto& r) { r.outer.hidden_layers = 4; }));
  EXPECT_TRUE(network([](auto& r) { r.weights.offset = 0; }));
  for (size_t i = 0; i < std::size(format::SphericalNetworksRecord{}.reserved); ++i)
    EXPECT_TRUE(network([&](auto& r) { r.reserved[i] = 1; })) << i;
}

TEST(SphericalFile, RefusesValuesThatCannotBeComputedWith) {
  for (const bool half : {false, true}) {
    const auto status_after = [&](float value, bool weight) {
      format::Asset asset = asset_with_sphericals(3);
      format::SphericalGrids& grids = asset.objects[1].spherical->grids;
      grids.half = asset.spherical_networks[0].half = half;
      (weight ? asset.spherical_networks[0].inner.weights : grids.distance).back() = value;
      try {
        format::encode(asset);
        return Status::ok;
      } catch (const Error& error) {
        return error.status();
      }
    };
    for (const bool weight : {false, true}) {
      EXPECT_EQ(status_after(4096, weight), Status::ok);
      EXPECT_EQ(status_after(-4096, weight), Status::ok);
      for (const float value : {4100.0f, -1e9f, std::numeric_limits<float>::infinity()})
        EXPECT_EQ(status_after(value, weight), Status::internal) << value;
      if (!half) {
        EXPECT_EQ(status_after(std::numeric_limits<float>::quiet_NaN(), weight), Status::internal);
      }
    }
  }
}

}  // namespace
}  // namespace nif
