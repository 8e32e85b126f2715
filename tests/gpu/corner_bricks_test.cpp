// Kernels find a point's corners by bricks, and get the same sums as the reference, which finds them one by
// one: in surface voxels, and next to them, where rounding may move a point.
#include "kernels/gpu/network/network_device_field.hpp"
#include "kernels/packed/feature_grid.hpp"
#include "tests/gpu/loaded.hpp"

namespace nif::test {
namespace {

TEST(CornerBricks, SumAsTheReference) {
  uint64_t beside = 0, partly = 0, asked = 0;
  for (uint64_t seed = 0; seed < 20; ++seed) {
    const Loaded asset(seed,
                       {.objects = 2, .instances = 0, .max_voxels = seed % 2 ? 14u : 40u, .features = 2});
    for (const format::ObjectView& object : asset.view.objects) {
      const kernels::SegmentField& field = object.as<kernels::SegmentField>();
      const kernels::cpu::FeatureGrid grid(field, std::pmr::new_delete_resource());
      ASSERT_TRUE(grid.complete);
      const std::vector<uint32_t> next_pairs = grid.next_pairs();
      const kernels::gpu::DeviceSegmentField on_gpu{field, {}, grid.view(), next_pairs.data()};
      Random random(seed);
      for (uint32_t i = 0; i < 20'000; ++i) {
        kernels::SamplePoint point;
        for (size_t a = 0; a < 3; ++a) {
          point.voxel[a] = uint16_t(random.below(field.voxels[a]));
          point.fraction[a] = uint8_t(random.below(kernels::kFractionOne + 1));
        }
        int32_t expected[2] = {}, got[2];
        uint32_t corners = 0;
        kernels::for_each_corner(field, point, [&](uint32_t corner, int32_t weight) {
          ++corners;
          for (uint32_t f = 0; f < 2; ++f) expected[f] += weight * field.features[2 * corner + f];
        });
        kernels::gpu::sum_pairs(on_gpu, point, got[0], got[1]);
        ASSERT_EQ(got[0], expected[0]) << "seed " << seed << ", point " << i;
        ASSERT_EQ(got[1], expected[1]) << "seed " << seed << ", point " << i;
        const int32_t voxel[3] = {point.voxel[0], point.voxel[1], point.voxel[2]};
        beside += kernels::voxel_state(field, voxel) != kernels::VoxelState::surface;
        partly += corners > 0 && corners < 8;
        ++asked;
      }
    }
  }
  EXPECT_GT(beside, asked / 10);
  EXPECT_GT(partly, asked / 100);
}

}  // namespace
}  // namespace nif::test
