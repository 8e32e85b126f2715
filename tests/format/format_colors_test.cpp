// Colours of surface voxels, in files: everything is kept, readers may do without them, and what is wrong is
// refused.
#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "formats/nif/writer.hpp"
#include "kernels/reference/planes/voxel_colors.hpp"
#include "tests/format/damaged.hpp"
#include "tests/format/optional.hpp"
#include "tests/support/random_asset.hpp"

namespace nif {
namespace {

using test::Bytes;
using test::status_of;

/// Two `segment` objects, a `bvh`, an `exact` and a `proof` object; three have colours.
format::Asset asset_with_colors(uint64_t seed, uint32_t colors = 3) {
  return test::random_asset(
      seed,
      {.objects = 2, .instances = 1, .max_voxels = 7, .bvhs = 1, .exacts = 1, .proofs = 1, .colors = colors});
}

TEST(ColorsFile, KeepsEveryColor) {
  for (uint64_t seed = 0; seed < 20; ++seed) {
    const format::Asset asset = asset_with_colors(seed);
    const Bytes bytes = format::encode(asset);
    EXPECT_EQ(format::encoded_bytes(asset), bytes.size());
    const format::AssetView view = format::read_asset(bytes, "file");
    EXPECT_EQ(bytes, format::encode(format::to_asset(view)));
    ASSERT_EQ(view.colors.size(), 3u);
    EXPECT_EQ(view.colors_of(2), nullptr) << "a BVH";
    EXPECT_EQ(view.colors_of(4), nullptr);
    uint64_t all = 0;
    for (const uint32_t object : {0u, 1u, 3u}) {
      const format::ColorsView* seen = view.colors_of(object);
      ASSERT_NE(seen, nullptr);
      EXPECT_EQ(format::to_colors(*seen), *asset.objects[object].colors);
      const kernels::PlanesField* grid = format::grid_of(view.objects[object]);
      ASSERT_NE(grid, nullptr);
      EXPECT_EQ(seen->count, grid->surface_voxels);
      all += seen->bytes();
    }
    for (const format::PartBytes& part : format::bytes_by_part(view))
      if (std::string_view(part.name) == "colors") {
        EXPECT_EQ(part.bytes, all);
      }
  }
}

/// Every surface voxel has a unique number, and other voxels have none.
TEST(ColorsFile, NumbersSurfaceVoxels) {
  const Bytes bytes = format::encode(asset_with_colors(3));
  const format::AssetView view = format::read_asset(bytes, "file");
  for (const format::ObjectView& object : view.objects) {
    const kernels::PlanesField* grid = format::grid_of(object);
    if (!grid) continue;
    std::vector<int> named(grid->surface_voxels);
    for (int32_t z = 0; z < int32_t(grid->voxels[2]); ++z)
      for (int32_t y = 0; y < int32_t(grid->voxels[1]); ++y)
        for (int32_t x = 0; x < int32_t(grid->voxels[0]); ++x) {
          const int32_t voxel[3] = {x, y, z};
          uint32_t index = 0;
          const bool surface = kernels::surface_voxel(*grid, voxel, index);
          ASSERT_EQ(surface, kernels::voxel_state(*grid, voxel) == kernels::VoxelState::surface);
          if (!surface) continue;
          ASSERT_LT(index, named.size());
          ++named[index];
          ASSERT_EQ(kernels::voxel_word(*grid, voxel), grid->voxel_records[index]);
          kernels::Segment segment{{}, {}, 0, 1};
          for (int a = 0; a < 3; ++a)
            segment.origin[a] =
                grid->origin[a] + (static_cast<float>(voxel[a]) + 0.5f) / grid->voxels_per_unit;
          uint32_t at = ~0u;
          ASSERT_TRUE(kernels::nearest_surface_voxel(*grid, segment, 0, at));
          ASSERT_EQ(at, index);
        }
    for (const int times : named) EXPECT_EQ(times, 1);
  }
}

TEST(ColorsFile, UnpacksWithinARange) {
  for (uint32_t packed = 0; packed < 0x10000; ++packed) {
    float color[3];
    kernels::unpack_color(uint16_t(packed), color);
    for (const float c : color) ASSERT_TRUE(c >= 0 && c <= 1);
  }
  float color[3];
  kernels::unpack_color(0xffff, color);
  for (const float c : color) EXPECT_EQ(c, 1);
  kernels::unpack_color(16 << 5, color);
  EXPECT_EQ(color[0], 0);
  EXPECT_EQ(color[1], (16.0f / 63) * (16.0f / 63));
}

/// Points that are not finite, or far away, give a voxel of the grid or none.
TEST(ColorsFile, FindsVoxelsOfAnyPoint) {
  const Bytes bytes = format::encode(asset_with_colors(5));
  const format::AssetView view = format::read_asset(bytes, "file");
  const kernels::PlanesField& grid = *format::grid_of(view.objects[0]);
  constexpr float kOdd[] = {0,
                            1,
                            -1,
                            1e30f,
                            -1e30f,
                            3e38f,
                            std::numeric_limits<float>::infinity(),
                            std::numeric_limits<float>::quiet_NaN()};
  for (const float x : kOdd)
    for (const float y : kOdd)
      for (const float t : kOdd) {
        uint32_t index = 0;
        if (kernels::nearest_surface_voxel(grid, {{x, y, x}, {y, x, 1}, 0, 1}, t, index)) {
          ASSERT_LT(index, grid.surface_voxels);
        }
      }
}

TEST(ColorsFile, IsOptional) {
  test::expect_optional(format::encode(asset_with_colors(1)), format::encode(asset_with_colors(1, 0)),
                        {format::kColorRecords, format::kColorValues});
}

TEST(ColorsFile, RefusesWrongRecords) {
  const Bytes file = format::encode(asset_with_colors(2));
  const auto refused = [&](uint32_t index, const std::function<void(format::ColorsRecord&)>& change) {
    return status_of(test::with_record<format::ColorsRecord>(file, format::kColorRecords, index, change)) ==
           Status::damaged_nif;
  };
  EXPECT_FALSE(refused(0, [](auto&) {}));
  EXPECT_TRUE(refused(2, [](auto& r) { r.object = 2; })) << "has no voxels";
  EXPECT_TRUE(refused(2, [](auto& r) { r.object = 5; }));
  EXPECT_TRUE(refused(1, [](auto& r) { r.object = 0; }));
  EXPECT_TRUE(refused(0, [](auto& r) { r.surface_voxels += 1; }));
  EXPECT_TRUE(refused(0, [](auto& r) { r.surface_voxels = 0xffffffff; }));
  for (size_t i = 0; i < std::size(format::ColorsRecord{}.reserved); ++i)
    EXPECT_TRUE(refused(0, [&](auto& r) { r.reserved[i] = 1; })) << i;
  EXPECT_TRUE(refused(1, [](auto& r) { r.values.offset += 64; }));
  EXPECT_TRUE(refused(1, [](auto& r) { r.values.bytes = ~uint64_t{0}; }));
  format::Asset asset = asset_with_colors(2);
  asset.objects[0].colors->push_back(0);
  EXPECT_THROW(format::encode(asset), Error);
}

}  // namespace
}  // namespace nif
