// The `spherical` kernels give the reference's answers, to the bit, in single precision.
#include "tests/gpu/loaded.hpp"

namespace nif::test {
namespace {

class GpuSphericalTest : public GpuWayTest {};
INSTANTIATE_TEST_SUITE_P(Each, GpuSphericalTest,
                         testing::Values(EmulatedWay{MatrixKind::dot32}, EmulatedWay{MatrixKind::dot64},
                                         EmulatedWay{MatrixKind::dot32, runtime::GpuWay::one_kernel},
                                         EmulatedWay{MatrixKind::dot64, runtime::GpuWay::one_kernel}),
                         name_of_way);

TEST_P(GpuSphericalTest, AnswersAsTheReference) {
  for (uint64_t seed = 0; seed < 12; ++seed) {
    machine().order = seed % 3;
    const Loaded asset(seed,
                       {.objects = 0, .instances = 0, .max_voxels = seed % 2 ? 14u : 40u, .sphericals = 3});
    for (const format::ObjectView& object : asset.view.objects)
      expect_reference(object, random_segments(object, seed, 1500 + uint32_t(seed)), GetParam());
  }
}

TEST_P(GpuSphericalTest, AnswersInvalidRays) {
  const Loaded asset(5, {.objects = 0, .instances = 0, .sphericals = 1});
  auto segments = random_segments(asset.view.objects[0], 5, 6000);
  spoil(segments, 6);
  expect_reference(asset.view.objects[0], segments, GetParam());
}

}  // namespace
}  // namespace nif::test
