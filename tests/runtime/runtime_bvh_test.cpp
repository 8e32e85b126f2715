// `bvh` objects in the runtime give the reference's bits with every instruction set, alone and among others.
#include "tests/runtime/runtime_fixture.hpp"
#include "tests/support/query_object.hpp"

namespace nif::test {
namespace {

class RuntimeBvh : public RuntimeTest, public testing::WithParamInterface<const char*> {
 protected:
  void SetUp() override {
    const NifError error = nifNewDevice((std::string("isa=") + GetParam()).c_str(), nullptr, &device_);
    if (error == NIF_ERROR_NOT_AVAILABLE) GTEST_SKIP() << nifGetErrorMessage();
    ASSERT_EQ(error, NIF_OK);
  }
};

INSTANTIATE_TEST_SUITE_P(Each, RuntimeBvh, testing::Values("scalar", "sse4", "avx2", "avx512"),
                         [](const auto& p) { return p.param; });

TEST_P(RuntimeBvh, AnswersAsTheReference) {
  for (uint64_t seed = 0; seed < 40; ++seed) {
    const format::AssetView& view = make(seed, {.objects = 1, .instances = 0, .bvhs = 3});
    const NifAsset asset = load();
    Random random(seed);
    for (uint32_t object = 1; object < 4; ++object) {
      const kernels::TrianglesField& field = view.objects[object].as<kernels::TrianglesField>();
      std::vector<NifRay> rays;
      while (rays.size() < 3000) rays.push_back(to_ray(random_segment(random, field)));
      const Answers answers = query_all(scene_of(asset, object), rays);
      for (size_t i = 0; i < rays.size(); ++i) {
        const kernels::Answer expected = kernels::query(field, to_segment(rays[i]));
        ASSERT_EQ(answers.logit[i], expected.logit) << "ray " << i;
        ASSERT_EQ(answers.certain[i], expected.certain) << "ray " << i;
        ASSERT_EQ(answers.visible[i], expected.visible) << "ray " << i;
        ASSERT_EQ(answers.probability[i], expected.visible ? 1.0f : 0.0f) << "ray " << i;
      }
    }
  }
}

TEST_P(RuntimeBvh, SharesASceneWithSegmentObjects) {
  uint64_t blocked_by_bvh = 0;
  for (uint64_t seed = 0; seed < 30; ++seed) {
    const format::AssetView& view = make(seed, {.objects = 2, .instances = 0, .bvhs = 2});
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
      bool visible = true, blocked_for_certain = false;
      for (const format::ObjectView& object : view.objects) {
        const kernels::Answer answer = query_object(object, to_segment(rays[i]));
        visible = visible && answer.visible;
        blocked_for_certain = blocked_for_certain || (answer.certain && !answer.visible);
        blocked_by_bvh += object.is<kernels::TrianglesField>() && !answer.visible;
      }
      // The box alone may exclude rays from far away, with another result; none of these starts that far
      // away.
      ASSERT_EQ(answers.visible[i] != 0, visible) << "ray " << i;
      if (!visible) {
        ASSERT_EQ(answers.certain[i] != 0, blocked_for_certain) << "ray " << i;
      }
    }
  }
  EXPECT_GT(blocked_by_bvh, 10'000u);
}

TEST_P(RuntimeBvh, IsCertainThroughATransformNearby) {
  const format::AssetView& view = make(3, {.objects = 0, .instances = 0, .bvhs = 1});
  const float turned[12] = {0, -2, 0, 5, 2, 0, 0, 6, 0, 0, 2, 7};
  const NifScene scene = scene_of(load(), 0, turned);
  const kernels::TrianglesField& field = view.objects[0].as<kernels::TrianglesField>();
  const auto certain = [&](float away) {
    NifRay ray{{5 + away, 6, 7}, 0, {-1, 0.25f, 0.125f}, std::numeric_limits<float>::infinity()};
    return query_all(scene, {ray}).certain[0] != 0;
  };
  EXPECT_TRUE(certain(10 * field.extent));
  EXPECT_FALSE(certain(1000 * field.extent));
}

TEST_P(RuntimeBvh, SaysWhatItIs) {
  const format::AssetView& view = make(4, {.objects = 1, .instances = 0, .bvhs = 1});
  const NifAsset asset = load();
  NifObjectInfo info{};
  info.struct_size = sizeof(info);
  ASSERT_EQ(nifGetObjectInfo(asset, 1, &info), NIF_OK);
  EXPECT_EQ(info.encoding, NIF_ENCODING_BVH);
  EXPECT_STREQ(info.name, "bvh 0");
  EXPECT_EQ(info.triangles, view.objects[1].as<kernels::TrianglesField>().triangle_count);
  EXPECT_GE(info.resident_bytes, view.objects[1].triangles->tree_bytes);
  ASSERT_EQ(nifGetObjectInfo(asset, 0, &info), NIF_OK);
  EXPECT_EQ(info.encoding, NIF_ENCODING_SEGMENT);
}

}  // namespace
}  // namespace nif::test
