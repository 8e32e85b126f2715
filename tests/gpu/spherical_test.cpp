// The `spherical` kernel answers as the reference does, to the bit.
#include "tests/gpu/loaded.hpp"

namespace nif::test {
namespace {

/// By size of wave and order.
class GpuSphericalTest : public testing::TestWithParam<std::tuple<uint32_t, uint64_t>> {
 protected:
  void expect_answers(const format::ObjectView& object, const std::vector<kernels::Segment>& segments) {
    EmulatedBatch batch(segments);
    ASSERT_TRUE(kernels::hip::make_layout(*object.spherical).fits);
    answer_spherical(*object.spherical, batch, std::get<0>(GetParam()), {.order = std::get<1>(GetParam())});
    expect_reference(object, batch);
  }
};
INSTANTIATE_TEST_SUITE_P(Each, GpuSphericalTest,
                         testing::Combine(testing::Values(32u, 64u), testing::Values(0u, 5u)));

TEST_P(GpuSphericalTest, AnswersAsTheReference) {
  for (uint64_t seed = 0; seed < 12; ++seed) {
    const Loaded asset(seed,
                       {.objects = 0, .instances = 0, .max_voxels = seed % 2 ? 14u : 40u, .sphericals = 3});
    for (const format::ObjectView& object : asset.view.objects)
      expect_answers(object, random_segments(object, seed, 1500 + uint32_t(seed)));
  }
}

TEST_P(GpuSphericalTest, AnswersRaysThatAreNone) {
  const Loaded asset(5, {.objects = 0, .instances = 0, .sphericals = 1});
  auto segments = random_segments(asset.view.objects[0], 5, 6000);
  spoil(segments, 6);
  expect_answers(asset.view.objects[0], segments);
}

/// The paper's networks fit; wider ones say that they do not.
TEST(GpuSpherical, LayoutsFit) {
  kernels::SphericalField field;
  field.outer = {{}, 6, 64, 2, 1};
  field.inner = {{}, 13, 48, 3, 1};
  EXPECT_TRUE(kernels::hip::make_layout(field).fits);
  EXPECT_EQ(kernels::hip::make_layout(field).bytes, 2u * 64 * 64 * 4);
  field.inner.width = kernels::kMaxSphericalWidth;
  EXPECT_FALSE(kernels::hip::make_layout(field).fits);
}

}  // namespace
}  // namespace nif::test
