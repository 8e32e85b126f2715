// `spherical` objects in the runtime give the reference's bits with every instruction set, in any batch,
// alone and among others.
#include <cmath>

#include "tests/runtime/runtime_fixture.hpp"
#include "tests/support/query_object.hpp"

namespace nif::test {
namespace {

class RuntimeSpherical : public RuntimeTest, public testing::WithParamInterface<const char*> {
 protected:
  void SetUp() override {
    const NifError error = nifNewDevice((std::string("isa=") + GetParam()).c_str(), nullptr, &device_);
    if (error == NIF_ERROR_NOT_AVAILABLE) GTEST_SKIP() << nifGetErrorMessage();
    ASSERT_EQ(error, NIF_OK);
  }
};

INSTANTIATE_TEST_SUITE_P(Each, RuntimeSpherical, testing::Values("scalar", "sse4", "avx2", "avx512", "neon"),
                         [](const auto& p) { return p.param; });

TEST_P(RuntimeSpherical, AnswersAsTheReference) {
  uint64_t asked = 0, occluded = 0;
  for (uint64_t seed = 0; seed < 40; ++seed) {
    const format::AssetView& view =
        make(seed, {.objects = 0, .instances = 0, .max_voxels = seed % 2 ? 14u : 60u, .sphericals = 3});
    const NifAsset asset = load();
    Random random(seed);
    for (uint32_t object = 0; object < 3; ++object) {
      const kernels::SphericalField& field = view.objects[object].as<kernels::SphericalField>();
      std::vector<NifRay> rays;
      while (rays.size() < 3000) rays.push_back(to_ray(random_segment(random, field)));
      const Answers answers = query_all(scene_of(asset, object), rays);
      for (size_t i = 0; i < rays.size(); ++i) {
        const kernels::Answer expected = kernels::query(field, to_segment(rays[i]));
        ASSERT_EQ(answers.logit[i], expected.logit) << "seed " << seed << " ray " << i;
        ASSERT_EQ(answers.certain[i], expected.certain) << "ray " << i;
        ASSERT_EQ(answers.visible[i], expected.visible) << "ray " << i;
        if (expected.logit == kernels::kCertainLogit) {
          ASSERT_EQ(answers.probability[i], 1);
        } else {
          ++asked;
          occluded += !expected.visible;
          ASSERT_NEAR(answers.probability[i], 1 / (1 + std::exp(-double(expected.logit) / 65536)), 1e-5);
        }
      }
    }
  }
  EXPECT_GT(asked, 100'000u);
  EXPECT_GT(occluded, 20'000u);
}

TEST_P(RuntimeSpherical, AnyBatch) {
  const format::AssetView& view = make(3, {.objects = 0, .instances = 0, .sphericals = 1});
  const NifScene scene = scene_of(load(), 0);
  Random random(3);
  std::vector<NifRay> rays;
  while (rays.size() < 2600)
    rays.push_back(to_ray(random_segment(random, view.objects[0].as<kernels::SphericalField>())));
  const Answers whole = query_all(scene, rays);
  for (const size_t count : {1, 2, 3, 5, 15, 16, 17, 31, 33, 63, 65, 1023, 1024, 1025, 2049}) {
    const std::vector<NifRay> last(rays.end() - ptrdiff_t(count), rays.end());
    const Answers answers = query_all(scene, last);
    for (size_t i = 0; i < count; ++i)
      ASSERT_EQ(answers.logit[i], whole.logit[rays.size() - count + i]) << count;
  }
}

TEST_P(RuntimeSpherical, SharesASceneWithOthers) {
  uint64_t blocked_by_spherical = 0;
  for (uint64_t seed = 0; seed < 30; ++seed) {
    const format::AssetView& view = make(seed, {.objects = 1, .instances = 0, .bvhs = 1, .sphericals = 2});
    const NifAsset asset = load();
    const NifScene scene = new_scene();
    for (uint32_t object = 0; object < 4; ++object)
      ASSERT_EQ(nifAddInstance(scene, asset, object, nullptr, nullptr), NIF_OK);
    ASSERT_EQ(nifCommitScene(scene), NIF_OK);
    Random random(seed);
    std::vector<NifRay> rays;
    while (rays.size() < 2000) rays.push_back(to_ray(random_segment(random, view.objects[random.below(4)])));
    const Answers answers = query_all(scene, rays);
    for (size_t i = 0; i < rays.size(); ++i) {
      bool visible = true, in_reach = true;
      for (const format::ObjectView& object : view.objects) {
        const kernels::Answer answer = query_object(object, to_segment(rays[i]));
        visible = visible && answer.visible;
        for (const float x : rays[i].origin)
          in_reach = in_reach &&
                     !(std::abs(x) * kernels::reach_scale(format::field_of(object)) > kernels::kCertainReach);
        blocked_by_spherical += object.is<kernels::SphericalField>() && !answer.visible;
      }
      // From farther away, a ray that passes close to the object's box may query the network if the object is
      // alone, because the box is enlarged for rounding; in a scene, the instance's box may exclude it.
      if (in_reach) {
        ASSERT_EQ(answers.visible[i] != 0, visible) << "seed " << seed << " ray " << i;
      }
    }
  }
  EXPECT_GT(blocked_by_spherical, 5'000u);
}

TEST_P(RuntimeSpherical, MissesAreCertainThroughATransformNearby) {
  make(5, {.objects = 0, .instances = 0, .sphericals = 1});
  const NifAsset asset = load();
  const float transform[12] = {0, -2, 0, 1, 2, 0, 0, -3, 0, 0, 2, 0.5f};
  const NifScene scene = scene_of(asset, 0, transform);
  NifSceneInfo info{};
  info.struct_size = sizeof(info);
  ASSERT_EQ(nifGetSceneInfo(scene, &info), NIF_OK);
  std::vector<NifRay> rays;
  for (const float distance : {1.0f, 1e6f}) {
    NifRay ray{{info.bounds_max[0] + distance, info.bounds_max[1], info.bounds_max[2]}, 0, {1, 0.1f, 0}, 100};
    rays.push_back(ray);
    ray.direction[0] = -1, ray.direction[1] = -0.3f;
    ray.origin[1] = 0.5f * (info.bounds_min[1] + info.bounds_max[1]) + 0.3f * distance;
    ray.origin[2] = 0.5f * (info.bounds_min[2] + info.bounds_max[2]);
    ray.tmax = INFINITY;
    rays.push_back(ray);
  }
  const Answers answers = query_all(scene, rays);
  EXPECT_EQ(answers.certain[0], 1);
  EXPECT_EQ(answers.certain[1], 0) << "the network was asked";
  EXPECT_EQ(answers.certain[2], 0) << "too far away";
  EXPECT_EQ(answers.visible[0] + answers.visible[2], 2);
}

TEST_P(RuntimeSpherical, SaysWhatItIs) {
  const format::AssetView& view = make(1, {.objects = 1, .instances = 0, .sphericals = 3});
  const NifAsset asset = load();
  NifAssetInfo asset_info{};
  asset_info.struct_size = sizeof(asset_info);
  ASSERT_EQ(nifGetAssetInfo(asset, &asset_info), NIF_OK);
  EXPECT_EQ(asset_info.network_count, 3u);
  for (uint32_t object = 1; object < 4; ++object) {
    NifObjectInfo info{};
    info.struct_size = sizeof(info);
    ASSERT_EQ(nifGetObjectInfo(asset, object, &info), NIF_OK);
    EXPECT_EQ(info.encoding, NIF_ENCODING_SPHERICAL);
    EXPECT_EQ(info.network, object < 3 ? 1u : 2u);
    EXPECT_GE(info.resident_bytes, format::bytes_of(view.objects[object]));
  }
}

}  // namespace
}  // namespace nif::test
