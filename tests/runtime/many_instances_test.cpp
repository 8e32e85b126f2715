// Scenes of many instances: the hierarchy and its rounds give the answers of a plain loop over all instances,
// after any changes, and take no more memory than they may.
#include <cstring>

#include "tests/runtime/runtime_fixture.hpp"
#include "tests/support/plain_scene.hpp"

namespace nif::test {
namespace {

class ManyInstances : public RuntimeTest {
 protected:
  /// `count` instances of the objects of some assets.
  void fill(uint64_t seed, size_t assets, size_t count, float spread) {
    Random random(seed);
    scene_ = new_scene();
    plain_ = {};
    std::vector<NifAsset> loaded;
    for (size_t k = 0; k < assets; ++k) {
      make(seed * 100 + k);
      loaded.push_back(load());
      files_.push_back(std::move(file_));
      views_.push_back(std::make_unique<format::AssetView>(format::read_asset(files_.back(), "file")));
    }
    for (size_t i = 0; i < count; ++i) {
      const size_t k = views_.size() - assets + random.below(uint32_t(assets));
      const uint32_t object = random.below(uint32_t(views_[k]->objects.size()));
      const Matrix transform = random_transform(random, spread);
      plain_.add(views_[k]->objects[object].as<kernels::SegmentField>(), transform);
      ASSERT_EQ(
          nifAddInstance(scene_, loaded[k - (views_.size() - assets)], object, transform.data(), nullptr),
          NIF_OK);
    }
    ASSERT_EQ(nifCommitScene(scene_), NIF_OK) << nifGetErrorMessage();
  }

  NifScene scene_ = nullptr;
  PlainScene plain_;
  std::vector<std::vector<std::byte>> files_;
  std::vector<std::unique_ptr<format::AssetView>> views_;
};

TEST_F(ManyInstances, EqualAPlainLoop) {
  uint64_t occluded = 0, certainly = 0, asked = 0;
  for (const auto& [assets, count, spread] : {std::tuple{1, 1, 3.0f},
                                              {1, 2, 3.0f},
                                              {2, 3, 3.0f},
                                              {1, 4, 5.0f},
                                              {2, 5, 5.0f},
                                              {3, 17, 10.0f},
                                              {2, 64, 8.0f},
                                              {100, 300, 15.0f},
                                              {3, 1000, 30.0f}}) {
    SCOPED_TRACE(count);
    fill(uint64_t(count), size_t(assets), size_t(count), spread);
    Random random(uint64_t(count) + 7);
    const auto rays = rays_in_cube(random, spread + 5, count < 500 ? 3000 : 1100);
    const Answers expected = plain_.ask(rays), answers = query_all(scene_, rays);
    EXPECT_EQ(answers.visible, expected.visible);
    EXPECT_EQ(answers.bits, expected.bits);
    EXPECT_EQ(answers.certain, expected.certain);
    EXPECT_EQ(answers.logit, expected.logit);
    EXPECT_EQ(answers.probability, expected.probability);
    for (size_t i = 0; i < rays.size(); ++i) {
      occluded += !answers.visible[i];
      certainly += !answers.visible[i] && answers.certain[i];
      asked += std::abs(answers.logit[i]) != NIF_LOGIT_CERTAIN;
    }
    // With only the visible bit rays stop early; single rays use another block size.
    Answers only(rays.size());
    NifRays query = nifMakeRays(rays.data(), rays.size());
    auto outputs = nifkit::sized<NifAnswers>();
    outputs.visible = only.visible.data();
    ASSERT_EQ(nifQuery(scene_, &query, &outputs), NIF_OK);
    EXPECT_EQ(only.visible, expected.visible);
    for (size_t i = 0; i < rays.size(); i += 17) {
      uint8_t visible = 9;
      const NifAnswers one = only_visible(&visible);
      ASSERT_EQ(nifQueryRay(scene_, &rays[i], &one), NIF_OK);
      ASSERT_EQ(visible, expected.visible[i]);
    }
  }
  EXPECT_GT(occluded, 500u);
  EXPECT_GT(certainly, 100u);
  EXPECT_GT(asked, 100u);
}

TEST_F(ManyInstances, BoundsHoldEveryBox) {
  fill(40, 2, 300, 20);
  auto info = nifkit::sized<NifSceneInfo>();
  ASSERT_EQ(nifGetSceneInfo(scene_, &info), NIF_OK);
  // Rays that start outside the bounds and do not enter them certainly meet nothing.
  Random random(40);
  std::vector<NifRay> rays(500);
  for (NifRay& ray : rays) {
    const size_t axis = random.below(3);
    for (size_t a = 0; a < 3; ++a) {
      ray.origin[a] = random.between(-30.0f, 30.0f);
      ray.direction[a] = random.between(-1.0f, 1.0f);
    }
    ray.origin[axis] = info.bounds_max[axis] + random.between(0.1f, 50.0f);
    ray.direction[axis] = std::abs(ray.direction[axis]);
    ray.tmin = 0;
    ray.tmax = std::numeric_limits<float>::infinity();
  }
  const Answers answers = query_all(scene_, rays);
  for (size_t i = 0; i < rays.size(); ++i) EXPECT_TRUE(answers.visible[i] && answers.certain[i]);
}

TEST_F(ManyInstances, RefitEqualsAFreshBuild) {
  for (const float step : {0.5f, 200.0f}) {  // the boxes' order survives the first but not the second
    fill(uint64_t(step) + 50, 3, 400, 30);
    Random random(51);
    for (int frame = 0; frame < 4; ++frame) {
      for (uint32_t i = 0; i < 400; i += 1 + random.below(3)) {
        Matrix transform = random_transform(random, 30);
        for (size_t k = 3; k < 12; k += 4) transform[k] += random.between(-step, step);
        ASSERT_EQ(nifSetInstanceTransform(scene_, i, transform.data()), NIF_OK);
        plain_.set_transform(i, transform);
      }
      ASSERT_EQ(nifCommitScene(scene_), NIF_OK);
      const auto rays = rays_in_cube(random, 35 + step, 700);
      EXPECT_EQ(query_all(scene_, rays), plain_.ask(rays)) << frame;
    }
  }
}

TEST_F(ManyInstances, AddedAndMovedBetweenCommits) {
  fill(60, 1, 50, 10);
  Random random(60);
  for (int round = 0; round < 6; ++round) {
    const NifAsset asset = assets_.back();
    const Matrix there = random_transform(random, 10), elsewhere = random_transform(random, 10);
    for (uint32_t i = 0; i < 3; ++i) {
      const uint32_t moved = random.below(50);
      ASSERT_EQ(nifSetInstanceTransform(scene_, moved, there.data()), NIF_OK);
      plain_.set_transform(moved, there);
      ASSERT_EQ(nifAddInstance(scene_, asset, 1, there.data(), nullptr), NIF_OK);
      plain_.add(views_.back()->objects[1].as<kernels::SegmentField>(), there);
      ASSERT_EQ(nifSetInstanceTransform(scene_, 49, elsewhere.data()), NIF_OK);
      plain_.set_transform(49, elsewhere);
    }
    ASSERT_EQ(nifCommitScene(scene_), NIF_OK);
    ASSERT_EQ(nifCommitScene(scene_), NIF_OK);
    const auto rays = rays_in_cube(random, 15, 500);
    EXPECT_EQ(query_all(scene_, rays), plain_.ask(rays)) << round;
  }
}

TEST_F(ManyInstances, OddArrangements) {
  // All in one position, in a line, far apart, extremely large: it builds, and answers like the plain loop.
  for (int arrangement = 0; arrangement < 5; ++arrangement) {
    SCOPED_TRACE(arrangement);
    const format::AssetView& view = make(uint64_t(70 + arrangement));
    const NifAsset asset = load();
    const NifScene scene = new_scene();
    PlainScene plain;
    for (int i = 0; i < 333; ++i) {
      Matrix transform = kIdentity;
      if (arrangement == 1) transform[3] = static_cast<float>(i) * 3;
      if (arrangement == 2) transform[7] = std::ldexp(1.0f, i % 120);  // one inside the other in the tree
      if (arrangement == 3) transform[0] = transform[5] = std::ldexp(1.0f, i % 126);
      if (arrangement == 4) transform[11] = (i % 2 ? 3e38f : -3e38f), transform[10] = 1e38f;
      plain.add(view.objects[0].as<kernels::SegmentField>(), transform);
      ASSERT_EQ(nifAddInstance(scene, asset, 0, transform.data(), nullptr), NIF_OK);
    }
    ASSERT_EQ(nifCommitScene(scene), NIF_OK);
    Random random(71);
    auto rays = rays_in_cube(random, 10, 300);
    for (const NifRay& ray : random_rays(random, view.objects[0].as<kernels::SegmentField>(), 300))
      rays.push_back(ray);
    EXPECT_EQ(query_all(scene, rays), plain.ask(rays));
    for (uint32_t i = 0; i < 333; ++i)
      ASSERT_EQ(nifSetInstanceTransform(scene, i, i % 2 ? nullptr : kIdentity.data()), NIF_OK);
    ASSERT_EQ(nifCommitScene(scene), NIF_OK);
    query_all(scene, rays);
  }
}

TEST_F(ManyInstances, TenThousand) {
  // Rotated instances: in a grid, like an army, and anywhere, like a forest.
  RandomAssetOptions options;
  options.objects = 1;
  options.instances = 0;
  make(80, options);
  const NifAsset asset = load();
  constexpr uint32_t kCount = 10000;
  Random random(80);
  std::vector<Matrix> grid, forest;
  for (uint32_t i = 0; i < kCount; ++i) {
    const float angle = random.between(0.0f, 6.28f), c = std::cos(angle), s = std::sin(angle);
    grid.push_back({c, -s, 0, static_cast<float>(i % 100) * 8, s, c, 0, static_cast<float>(i / 100) * 8, 0, 0,
                    1, random.between(0.0f, 3.0f)});
    forest.push_back(grid.back());
    for (const size_t k : {3, 7}) forest.back()[k] = random.between(0.0f, 800.0f);
  }
  for (const std::vector<Matrix>& transforms : {grid, forest}) {
    const NifScene scene = new_scene();
    for (const Matrix& transform : transforms)
      ASSERT_EQ(nifAddInstance(scene, asset, 0, transform.data(), nullptr), NIF_OK);
    ASSERT_EQ(nifCommitScene(scene), NIF_OK);
    auto info = nifkit::sized<NifSceneInfo>();
    ASSERT_EQ(nifGetSceneInfo(scene, &info), NIF_OK);
    EXPECT_LE(info.resident_bytes, kCount * 256u);
    RecordProperty("bytes_an_instance", std::to_string(double(info.resident_bytes) / kCount));
    for (uint32_t i = 0; i < kCount; i += 2)
      ASSERT_EQ(nifSetInstanceTransform(scene, i, transforms[i].data()), NIF_OK);
    ASSERT_EQ(nifCommitScene(scene), NIF_OK);
    ASSERT_EQ(nifGetSceneInfo(scene, &info), NIF_OK);
    EXPECT_LE(info.resident_bytes, kCount * 256u);
  }
}

TEST_F(ManyInstances, MemoryBoundHoldsForEveryCount) {
  make(81);
  const NifAsset asset = load();
  const NifScene empty = new_scene();
  ASSERT_EQ(nifAddInstance(empty, asset, 0, nullptr, nullptr), NIF_OK);
  Random random(81);
  for (uint32_t count = 2; count <= 2000; count = count < 70 ? count + 1 : count * 3 / 2) {
    const NifScene scene = new_scene();
    for (uint32_t i = 0; i < count; ++i)
      ASSERT_EQ(nifAddInstance(scene, asset, 0, random_transform(random, 50).data(), nullptr), NIF_OK);
    ASSERT_EQ(nifCommitScene(scene), NIF_OK);
    auto info = nifkit::sized<NifSceneInfo>();
    ASSERT_EQ(nifGetSceneInfo(scene, &info), NIF_OK);
    EXPECT_LE(info.resident_bytes, 1024 + count * 256u) << count;
    nifReleaseScene(scene);
    scenes_.pop_back();
  }
}

}  // namespace
}  // namespace nif::test
