// Instances at translations that floats cannot hold: a ray meets the object exactly where the file places it,
// and certain answers there are right.
#include <cmath>

#include "tests/runtime/runtime_fixture.hpp"
#include "tests/support/plain_scene.hpp"

namespace nif::test {
namespace {

class FarInstances : public RuntimeTest {
 public:
  /// One object, placed once, without rotation.
  const format::AssetView& place(format::Asset asset, const std::array<double, 3>& at) {
    format::Instance& instance = asset.instances.emplace_back();
    for (size_t a = 0; a < 3; ++a) {
      instance.transform[4 * a + 3] = static_cast<float>(at[a]);
      instance.remainder[a] = static_cast<float>(at[a] - double(instance.transform[4 * a + 3]));
    }
    file_ = format::encode(asset);
    view_ = std::make_unique<format::AssetView>(format::read_asset(file_, "file"));
    return *view_;
  }
  NifScene whole(NifAsset asset, const float* transform = nullptr) {
    const NifScene scene = new_scene();
    EXPECT_EQ(nifAddAsset(scene, asset, transform, nullptr, nullptr), NIF_OK) << nifGetErrorMessage();
    EXPECT_EQ(nifCommitScene(scene), NIF_OK);
    return scene;
  }
};

/// Far away, by multiples of 1/1024.
constexpr std::array<double, 3> kAt{5411987 + 493.0 / 1024, -2487002 - 901.0 / 1024, 447326 + 1.0 / 1024};

/// Moves rays whose numbers are floats there to the same rays near the object: exactly, if `beside` is exact.
std::vector<NifRay> far_rays(Random& random, const kernels::SegmentField& field,
                             std::vector<NifRay>& beside) {
  std::vector<NifRay> rays;
  while (rays.size() < 3000) {
    NifRay ray = to_ray(random_segment(random, field)), local = ray;
    for (size_t a = 0; a < 3; ++a) {
      ray.origin[a] = static_cast<float>(double(ray.origin[a]) + kAt[a]);
      local.origin[a] = static_cast<float>(double(ray.origin[a]) - kAt[a]);
      EXPECT_EQ(double(local.origin[a]), double(ray.origin[a]) - kAt[a]);
    }
    rays.push_back(ray);
    beside.push_back(local);
  }
  return rays;
}

TEST_F(FarInstances, AreQueriedAtTheirExactPosition) {
  uint64_t moved = 0, certain = 0;
  for (uint64_t seed = 0; seed < 6; ++seed) {
    const format::Asset asset = random_asset(seed, {.objects = 1, .instances = 0});
    const format::AssetView& view = place(asset, kAt);
    const NifAsset loaded = load();
    Random random(seed);
    std::vector<NifRay> beside;
    const std::vector<NifRay> rays = far_rays(random, view.objects[0].as<kernels::SegmentField>(), beside);
    const Answers far = query_all(whole(loaded), rays), near = query_all(scene_of(loaded, 0), beside);
    EXPECT_EQ(far.visible, near.visible);
    EXPECT_EQ(far.logit, near.logit);
    for (size_t i = 0; i < rays.size(); ++i) {
      EXPECT_LE(far.certain[i], near.certain[i]);
      certain += far.certain[i];
    }
    // With floats alone this would be another ray.
    Matrix rounded = kIdentity;
    for (size_t a = 0; a < 3; ++a) rounded[4 * a + 3] = view.instances[0].transform[4 * a + 3];
    const Answers by_floats = query_all(scene_of(loaded, 0, rounded.data()), rays);
    for (size_t i = 0; i < rays.size(); ++i) moved += by_floats.logit[i] != near.logit[i];
  }
  EXPECT_GT(certain, 1000u);
  EXPECT_GT(moved, 1000u);
}

/// The method that docs/meshes.md recommends.
TEST_F(FarInstances, AreExactNearTheOriginOnceTheOffsetIsTakenAway) {
  const format::AssetView& view = place(random_asset(7, {.objects = 1, .instances = 0}), kAt);
  const NifAsset loaded = load();
  Matrix away = kIdentity;
  for (size_t a = 0; a < 3; ++a) away[4 * a + 3] = -view.instances[0].transform[4 * a + 3];
  Matrix left = kIdentity;
  for (size_t a = 0; a < 3; ++a) left[4 * a + 3] = view.instances[0].remainder[a];
  Random random(7);
  const auto rays = random_rays(random, view.objects[0].as<kernels::SegmentField>(), 2000);
  EXPECT_EQ(query_all(whole(loaded, away.data()), rays), query_all(scene_of(loaded, 0, left.data()), rays));
  NifSceneInfo info{};
  info.struct_size = sizeof(info);
  ASSERT_EQ(nifGetSceneInfo(whole(loaded, away.data()), &info), NIF_OK);
  for (size_t a = 0; a < 3; ++a) EXPECT_LT(std::abs(info.bounds_min[a]), 1000.0f);
}

TEST_F(FarInstances, WorldBoxesAreThoseOfTheExactPlace) {
  const format::AssetView& view = place(random_asset(3, {.objects = 1, .instances = 0}), kAt);
  NifSceneInfo info{};
  info.struct_size = sizeof(info);
  ASSERT_EQ(nifGetSceneInfo(whole(load()), &info), NIF_OK);
  const kernels::ObjectBox box = kernels::object_box(view.objects[0].as<kernels::SegmentField>());
  for (size_t a = 0; a < 3; ++a) {
    EXPECT_LT(double(info.bounds_min[a]), kAt[a] + double(box.low[a]));
    EXPECT_GT(double(info.bounds_max[a]), kAt[a] + double(box.high[a]));
    EXPECT_LT(double(info.bounds_max[a]) - double(info.bounds_min[a]),
              double(box.high[a]) - double(box.low[a]) + 2.0);
  }
}

}  // namespace
}  // namespace nif::test
