// Changes to instances after they were added: removal, flags, masks, origins in double precision, and user
// values. The answers must be those of a new scene that is built in the changed state.
#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/runtime/open_answers.hpp"
#include "tests/runtime/runtime_first_hits.hpp"
#include "tests/runtime/runtime_fixture.hpp"
#include "tests/support/aligned.hpp"
#include "tests/support/plain_scene.hpp"

namespace nif::test {
namespace {

constexpr RandomAssetOptions kMixed{
    .objects = 2, .instances = 0, .bvhs = 1, .sphericals = 1, .exacts = 1, .proofs = 1};

class Instances : public RuntimeTest {
 protected:
  void SetUp() override {
    RuntimeTest::SetUp();
    make(90, kMixed);
    asset_ = load();
    Random random(90);
    for (size_t i = 0; i < 12; ++i) {
      transforms_.push_back(random_transform(random, 3));
      objects_.push_back(random.below(uint32_t(view_->objects.size())));
    }
    rays_ = rays_in_cube(random, 5, 3000);
    for (const NifRay& ray : rays_near(*view_, 90, 500)) rays_.push_back(ray);
  }

  NifScene scene_of_all() {
    const NifScene scene = new_scene();
    for (size_t i = 0; i < transforms_.size(); ++i) add(scene, i);
    EXPECT_EQ(nifCommitScene(scene), NIF_OK);
    return scene;
  }
  uint32_t add(NifScene scene, size_t i) {
    uint32_t number = 0;
    EXPECT_EQ(nifAddInstance(scene, asset_, objects_[i], transforms_[i].data(), &number), NIF_OK)
        << nifGetErrorMessage();
    return number;
  }
  /// A scene of only these, in their order.
  NifScene scene_with(const std::vector<size_t>& which) {
    const NifScene scene = new_scene();
    for (const size_t i : which) add(scene, i);
    EXPECT_EQ(nifCommitScene(scene), NIF_OK);
    return scene;
  }

  /// Does the scene answer like one of the given instances, whose numbers here are `numbers`?
  void expect_like(NifScene scene, const std::vector<size_t>& which, const std::vector<uint32_t>& numbers) {
    const NifScene plain = scene_with(which);
    EXPECT_EQ(query_all(scene, rays_), query_all(plain, rays_));
    const OpenAnswers open = query_open(scene, rays_, rays_.size()),
                      expected_open = query_open(plain, rays_, rays_.size());
    EXPECT_EQ(open.open, expected_open.open);
    EXPECT_EQ(open.certain, expected_open.certain);
    FirstHits expected = intersect_all(plain, rays_);
    for (uint32_t& instance : expected.instance)
      if (instance != NIF_NONE) instance = numbers[instance];
    EXPECT_TRUE(intersect_all(scene, rays_) == expected);
  }

  NifAsset asset_ = nullptr;
  std::vector<Matrix> transforms_;
  std::vector<uint32_t> objects_;
  std::vector<NifRay> rays_;
};

TEST_F(Instances, AreRemovedAndTheirNumbersUsedAgain) {
  const NifScene scene = scene_of_all();
  for (const uint32_t gone : {3u, 7u, 0u}) ASSERT_EQ(nifRemoveInstance(scene, gone), NIF_OK);
  uint8_t visible = 0;
  const NifAnswers one = only_visible(&visible);
  EXPECT_EQ(nifQueryRay(scene, rays_.data(), &one), NIF_ERROR_INVALID_OPERATION) << "not committed";
  ASSERT_EQ(nifCommitScene(scene), NIF_OK);
  expect_like(scene, {1, 2, 4, 5, 6, 8, 9, 10, 11}, {1, 2, 4, 5, 6, 8, 9, 10, 11});
  auto info = nifkit::sized<NifSceneInfo>();
  ASSERT_EQ(nifGetSceneInfo(scene, &info), NIF_OK);
  EXPECT_EQ(info.instance_count, 9u);
  EXPECT_EQ(info.instance_end, 12u);
  for (const uint32_t gone : {0u, 3u, 12u, ~0u}) {
    EXPECT_EQ(nifRemoveInstance(scene, gone), NIF_ERROR_INVALID_ARGUMENT);
    EXPECT_EQ(nifSetInstanceTransform(scene, gone, kIdentity.data()), NIF_ERROR_INVALID_ARGUMENT);
    EXPECT_EQ(nifSetInstanceMask(scene, gone, 1), NIF_ERROR_INVALID_ARGUMENT);
  }
  EXPECT_EQ(add(scene, 0), 0u);
  EXPECT_EQ(add(scene, 7), 3u);
  EXPECT_EQ(add(scene, 3), 7u);
  EXPECT_EQ(add(scene, 1), 12u);
  ASSERT_EQ(nifCommitScene(scene), NIF_OK);
  expect_like(scene, {0, 1, 2, 7, 4, 5, 6, 3, 8, 9, 10, 11, 1}, {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12});
}

TEST_F(Instances, NumbersInARowFillGapsThatAreLongEnough) {
  const NifScene scene = scene_of_all();
  const auto count = uint32_t(view_->objects.size());
  ASSERT_EQ(count, 6u);
  uint32_t first = 0, added = 0;
  for (const uint32_t gone : {1u, 3u, 4u, 5u, 6u, 7u}) ASSERT_EQ(nifRemoveInstance(scene, gone), NIF_OK);
  ASSERT_EQ(nifAddAsset(scene, asset_, nullptr, &first, &added), NIF_OK);
  EXPECT_EQ(first, 12u) << "a gap of five is too short";
  ASSERT_EQ(nifRemoveInstance(scene, 8), NIF_OK);
  ASSERT_EQ(nifAddAsset(scene, asset_, nullptr, &first, &added), NIF_OK);
  EXPECT_EQ(first, 3u);
  EXPECT_EQ(added, count);
  EXPECT_EQ(add(scene, 0), 1u);
  // Instances removed at the end are gone: numbers do not grow without bound.
  for (int round = 0; round < 20; ++round) {
    ASSERT_EQ(nifAddAsset(scene, asset_, nullptr, &first, &added), NIF_OK);
    EXPECT_EQ(first, 18u);
    ASSERT_EQ(nifCommitScene(scene), NIF_OK);
    for (uint32_t i = 0; i < added; ++i) ASSERT_EQ(nifRemoveInstance(scene, first + i), NIF_OK);
  }
  ASSERT_EQ(nifCommitScene(scene), NIF_OK);
  auto info = nifkit::sized<NifSceneInfo>();
  ASSERT_EQ(nifGetSceneInfo(scene, &info), NIF_OK);
  EXPECT_EQ(info.instance_end, 18u);
}

TEST_F(Instances, TheLastOneIsQueriedAsASoleInstance) {
  const NifScene scene = scene_of_all();
  for (uint32_t i = 0; i < 12; ++i)
    if (i != 5) {
      ASSERT_EQ(nifRemoveInstance(scene, i), NIF_OK);
    }
  ASSERT_EQ(nifCommitScene(scene), NIF_OK);
  expect_like(scene, {5}, {5});
  ASSERT_EQ(nifRemoveInstance(scene, 5), NIF_OK);
  ASSERT_EQ(nifCommitScene(scene), NIF_OK);
  expect_like(scene, {}, {});
  EXPECT_EQ(add(scene, 2), 0u);
  ASSERT_EQ(nifCommitScene(scene), NIF_OK);
  expect_like(scene, {2}, {0});
}

/// The boxes that were set aside for the new instance go with the last one, and the hierarchy still has the old.
TEST_F(Instances, AllAreRemovedBeforeNewOnesAreCommitted) {
  const NifScene scene = scene_with({0, 1});
  EXPECT_EQ(add(scene, 2), 2u);
  for (const uint32_t gone : {2u, 1u, 0u}) ASSERT_EQ(nifRemoveInstance(scene, gone), NIF_OK);
  ASSERT_EQ(nifCommitScene(scene), NIF_OK);
  expect_like(scene, {}, {});
  auto info = nifkit::sized<NifSceneInfo>();
  ASSERT_EQ(nifGetSceneInfo(scene, &info), NIF_OK);
  EXPECT_GT(info.bounds_min[0], info.bounds_max[0]) << "nothing can block";
}

TEST_F(Instances, AssetsGoWithTheirLastInstance) {
  uint64_t live = 0;
  auto callbacks = nifkit::sized<NifDeviceCallbacks>();
  callbacks.user = &live;
  callbacks.allocate = [](void* user, uint64_t bytes, uint64_t alignment) -> void* {
    *static_cast<uint64_t*>(user) += bytes;
    return allocate_aligned(alignment, bytes);
  };
  callbacks.deallocate = [](void* user, void* memory, uint64_t bytes, uint64_t alignment) {
    *static_cast<uint64_t*>(user) -= bytes;
    free_aligned(alignment, memory);
  };
  NifDevice device = nullptr;
  NifAsset first = nullptr, second = nullptr;
  NifScene scene = nullptr;
  ASSERT_EQ(nifNewDevice(nullptr, &callbacks, &device), NIF_OK);
  ASSERT_EQ(nifLoadAssetMemory(device, file_.data(), file_.size(), NIF_LOAD_COPY, &first), NIF_OK);
  ASSERT_EQ(nifLoadAssetMemory(device, file_.data(), file_.size(), NIF_LOAD_COPY, &second), NIF_OK);
  ASSERT_EQ(nifNewScene(device, &scene), NIF_OK);
  ASSERT_EQ(nifAddAsset(scene, first, nullptr, nullptr, nullptr), NIF_OK);
  ASSERT_EQ(nifAddInstance(scene, second, 3, transforms_[0].data(), nullptr), NIF_OK);
  ASSERT_EQ(nifCommitScene(scene), NIF_OK);
  for (uint32_t i = 0; i < 6; ++i) ASSERT_EQ(nifRemoveInstance(scene, i), NIF_OK);
  nifReleaseAsset(first);
  nifReleaseAsset(second);
  const uint64_t before = live;
  ASSERT_EQ(nifCommitScene(scene), NIF_OK);
  EXPECT_LT(live + file_.size(), before) << "the first asset is gone";
  auto info = nifkit::sized<NifInstanceInfo>();
  ASSERT_EQ(nifGetInstanceInfo(scene, 6, &info), NIF_OK);
  EXPECT_EQ(info.asset, nullptr) << "its last handle was released";
  EXPECT_EQ(info.object, 3u);
  const NifScene plain = scene_of(asset_, 3, transforms_[0].data());
  EXPECT_EQ(query_all(scene, rays_), query_all(plain, rays_));
  nifReleaseScene(scene);
  nifReleaseDevice(device);
  EXPECT_EQ(live, 0u);
}

TEST_F(Instances, DoNotBlockWhileDisabled) {
  const NifScene scene = scene_of_all();
  for (int round = 0; round < 2; ++round) {  // the second time, the hierarchy was refitted
    for (const uint32_t i : {1u, 4u, 11u})
      ASSERT_EQ(nifSetInstanceFlags(scene, i, NIF_INSTANCE_DISABLED), NIF_OK);
    ASSERT_EQ(nifSetInstanceMask(scene, 6, 0), NIF_OK);
    ASSERT_EQ(nifSetInstanceTransform(scene, 4, kIdentity.data()), NIF_OK) << "it may move meanwhile";
    ASSERT_EQ(nifCommitScene(scene), NIF_OK);
    expect_like(scene, {0, 2, 3, 5, 7, 8, 9, 10}, {0, 2, 3, 5, 7, 8, 9, 10});
    ASSERT_EQ(nifSetInstanceTransform(scene, 4, transforms_[4].data()), NIF_OK);
    for (const uint32_t i : {1u, 4u, 11u}) ASSERT_EQ(nifSetInstanceFlags(scene, i, 0), NIF_OK);
    ASSERT_EQ(nifSetInstanceMask(scene, 6, 1), NIF_OK);
    ASSERT_EQ(nifCommitScene(scene), NIF_OK);
    expect_like(scene, {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11}, {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11});
  }
  EXPECT_EQ(nifSetInstanceFlags(scene, 0, 2), NIF_ERROR_NOT_AVAILABLE);
  for (uint32_t i = 0; i < 12; ++i)
    ASSERT_EQ(nifSetInstanceFlags(scene, i, i == 9 ? 0 : NIF_INSTANCE_DISABLED), NIF_OK);
  ASSERT_EQ(nifCommitScene(scene), NIF_OK);
  expect_like(scene, {9}, {9});
  ASSERT_EQ(nifSetInstanceFlags(scene, 9, NIF_INSTANCE_DISABLED), NIF_OK);
  ASSERT_EQ(nifCommitScene(scene), NIF_OK);
  expect_like(scene, {}, {});
}

TEST_F(Instances, MeetOnlyRaysOfACommonMask) {
  constexpr uint32_t kMasks[] = {1, 2, 4, 0xffffffffu, 0x80000000u};
  const auto mask_of = [&](size_t i) { return kMasks[i % 5]; };
  for (const size_t count : {size_t{12}, size_t{1}}) {
    const NifScene scene = new_scene();
    for (size_t i = 0; i < count; ++i) {
      add(scene, i);
      ASSERT_EQ(nifSetInstanceMask(scene, uint32_t(i), mask_of(i)), NIF_OK);
    }
    ASSERT_EQ(nifCommitScene(scene), NIF_OK);
    for (const uint32_t mask : {1u, 2u, 6u, 0u, 0x80000000u, 8u, ~0u}) {
      SCOPED_TRACE(mask);
      std::vector<size_t> which;
      for (size_t i = 0; i < count; ++i)
        if (mask_of(i) & mask) which.push_back(i);
      // A scene of several instances skips rays that a sole instance would be queried with. So the scene to
      // compare with has several, too, and the last one is never met.
      const NifScene plain = new_scene();
      for (const size_t i : which) add(plain, i);
      const Matrix away{1, 0, 0, 1e30f, 0, 1, 0, 0, 0, 0, 1, 0};
      for (int k = 0; k < 2 && count > 1; ++k) {
        ASSERT_EQ(nifAddInstance(plain, asset_, 0, away.data(), nullptr), NIF_OK);
      }
      ASSERT_EQ(nifCommitScene(plain), NIF_OK);
      std::vector<uint32_t> each(rays_.size(), mask);
      for (const bool one_for_all : {false, true}) {
        NifRays rays = nifMakeRays(rays_.data(), rays_.size());
        rays.mask = one_for_all ? &mask : each.data();
        rays.mask_stride = one_for_all ? 0 : sizeof(uint32_t);
        Answers answers(rays_.size());
        const NifAnswers outputs = answers.outputs();
        ASSERT_EQ(nifQuery(scene, &rays, &outputs), NIF_OK) << nifGetErrorMessage();
        EXPECT_EQ(answers, query_all(plain, rays_));
        FirstHits hits(rays_.size());
        const NifHits to = hits.outputs();
        ASSERT_EQ(nifIntersect(scene, &rays, &to), NIF_OK);
        FirstHits expected = intersect_all(plain, rays_);
        for (uint32_t& instance : expected.instance)
          if (instance != NIF_NONE) instance = uint32_t(which[instance]);
        EXPECT_TRUE(hits == expected);
      }
    }
    // A different mask for each ray gives the same as each ray alone.
    Random random(91);
    std::vector<uint32_t> masks;
    for (size_t i = 0; i < rays_.size(); ++i) masks.push_back(kMasks[random.below(5)]);
    NifRays rays = nifMakeRays(rays_.data(), rays_.size());
    rays.mask = masks.data();
    rays.mask_stride = sizeof(uint32_t);
    Answers all(rays_.size());
    const NifAnswers outputs = all.outputs();
    ASSERT_EQ(nifQuery(scene, &rays, &outputs), NIF_OK);
    for (size_t i = 0; i < rays_.size(); i += 7) {
      NifRays alone = nifMakeRays(&rays_[i], 1);
      alone.mask = &masks[i];
      Answers one(1);
      const NifAnswers to = one.outputs();
      ASSERT_EQ(nifQuery(scene, &alone, &to), NIF_OK);
      ASSERT_EQ(one.logit[0], all.logit[i]);
      ASSERT_EQ(one.certain[0], all.certain[i]);
    }
  }
}

TEST_F(Instances, HitsReturnTheirUserValues) {
  const NifScene scene = scene_of_all();
  const auto value = [](uint32_t i) { return 0x123456789abcdef0u + (uint64_t(i) << 40); };
  for (uint32_t i = 1; i < 12; ++i) ASSERT_EQ(nifSetInstanceUser(scene, i, value(i)), NIF_OK);
  ASSERT_EQ(nifCommitScene(scene), NIF_OK);
  const FirstHits hits = intersect_all(scene, rays_);
  size_t met = 0;
  for (size_t i = 0; i < rays_.size(); ++i) {
    const uint32_t instance = hits.instance[i];
    met += instance != NIF_NONE && instance != 0;
    ASSERT_EQ(hits.user[i], instance == NIF_NONE || instance == 0 ? 0 : value(instance));
  }
  EXPECT_GT(met, 300u);
}

TEST_F(Instances, OpenRaysNameAnInstanceThatAloneLeavesThemOpen) {
  for (const size_t count : {size_t{12}, size_t{1}}) {
    const NifScene scene = new_scene();
    for (size_t i = 0; i < count; ++i) add(scene, i);
    ASSERT_EQ(nifCommitScene(scene), NIF_OK);
    const NifRays rays = nifMakeRays(rays_.data(), rays_.size());
    std::vector<uint32_t> numbers(rays_.size()), instance(rays_.size());
    std::vector<float> tmin(rays_.size()), tmax(rays_.size());
    uint32_t open_count = 0;
    auto open = nifkit::sized<NifOpenRays>();
    open.capacity = rays_.size();
    open.rays = numbers.data();
    open.tmin = tmin.data();
    open.tmax = tmax.data();
    open.instance = instance.data();
    open.count = &open_count;
    ASSERT_EQ(nifQueryOpen(scene, &rays, nullptr, &open), NIF_OK);
    size_t named = 0, unnamed = 0;
    std::vector<NifScene> alone;
    for (size_t i = 0; i < count; ++i) alone.push_back(scene_with({i}));
    for (uint32_t k = 0; k < open_count; ++k) {
      (instance[k] == NIF_NONE ? unnamed : named) += 1;
      // In a scene of only that instance the ray is open, with the same interval.
      if (instance[k] == NIF_NONE || k % 5 != 0) continue;
      ASSERT_LT(instance[k], count);
      const OpenAnswers one = query_open(alone[instance[k]], {rays_[numbers[k]]}, 1);
      ASSERT_EQ(one.open.size(), 1u);
      EXPECT_EQ(one.open[0].tmin, tmin[k]);
      EXPECT_EQ(one.open[0].tmax, tmax[k]);
    }
    EXPECT_GT(named, 100u);
    EXPECT_EQ(unnamed > 0, count > 1);
  }
}

TEST_F(Instances, ManyTransformsAtOnceAreAllOrNothing) {
  const NifScene scene = scene_of_all();
  std::vector<Matrix> turned(transforms_.rbegin(), transforms_.rend());
  ASSERT_EQ(nifSetInstanceTransforms(scene, 12, nullptr, turned[0].data(), sizeof(Matrix)), NIF_OK);
  ASSERT_EQ(nifCommitScene(scene), NIF_OK);
  std::swap(transforms_, turned);
  expect_like(scene, {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11}, {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11});
  const uint32_t some[] = {3, 8};
  struct {
    float before, transform[12];
  } mine[2] = {{0, {}}, {0, {}}};
  for (size_t k = 0; k < 2; ++k) std::copy_n(turned[some[k]].begin(), 12, mine[k].transform);
  ASSERT_EQ(nifSetInstanceTransforms(scene, 2, some, mine[0].transform, sizeof(mine[0])), NIF_OK);
  ASSERT_EQ(nifCommitScene(scene), NIF_OK);
  for (const uint32_t i : some) transforms_[i] = turned[i];
  expect_like(scene, {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11}, {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11});
  // The second has no inverse, so the first does not change either.
  mine[0].transform[3] += 1;
  std::fill_n(mine[1].transform, 12, 0.0f);
  EXPECT_EQ(nifSetInstanceTransforms(scene, 2, some, mine[0].transform, sizeof(mine[0])),
            NIF_ERROR_SINGULAR_TRANSFORM);
  EXPECT_EQ(nifSetInstanceTransforms(scene, 13, nullptr, turned[0].data(), sizeof(Matrix)),
            NIF_ERROR_INVALID_ARGUMENT);
  auto info = nifkit::sized<NifSceneInfo>();
  ASSERT_EQ(nifGetSceneInfo(scene, &info), NIF_OK);
  EXPECT_EQ(info.committed, 1u) << "nothing has changed";
}

TEST_F(Instances, AreReturnedAsSet) {
  const NifScene scene = scene_of_all();
  const double origin[3] = {1e9, -2e-9, 3};
  ASSERT_EQ(nifSetInstanceOrigin(scene, 2, origin), NIF_OK);
  ASSERT_EQ(nifSetInstanceMask(scene, 2, 6), NIF_OK);
  ASSERT_EQ(nifSetInstanceFlags(scene, 2, NIF_INSTANCE_DISABLED), NIF_OK);
  ASSERT_EQ(nifSetInstanceUser(scene, 2, ~uint64_t{0}), NIF_OK);
  auto info = nifkit::sized<NifInstanceInfo>();
  ASSERT_EQ(nifGetInstanceInfo(scene, 2, &info), NIF_OK);
  EXPECT_EQ(info.asset, asset_);
  EXPECT_EQ(info.object, objects_[2]);
  EXPECT_EQ(info.mask, 6u);
  EXPECT_EQ(info.flags, uint32_t(NIF_INSTANCE_DISABLED));
  EXPECT_EQ(info.user, ~uint64_t{0});
  EXPECT_TRUE(std::equal(origin, origin + 3, info.origin));
  EXPECT_TRUE(std::equal(transforms_[2].begin(), transforms_[2].end(), info.transform));
  ASSERT_EQ(nifGetInstanceInfo(scene, 3, &info), NIF_OK);
  EXPECT_EQ(info.mask, 0xffffffffu);
  EXPECT_EQ(info.flags, 0u);
}

TEST_F(Instances, OriginsAddUpInDoublePrecision) {
  // In a world of 10,000 km the camera sees near itself what it would see near 0, to the bit if the
  // differences are exact.
  const NifScene scene = scene_of_all(), near = scene_of_all();
  const double far_away[3] = {6'400'000.5, -9'999'999.25, 1e7};
  for (uint32_t i = 0; i < 12; ++i) ASSERT_EQ(nifSetInstanceOrigin(scene, i, far_away), NIF_OK);
  ASSERT_EQ(nifSetSceneOrigin(scene, far_away), NIF_OK);
  ASSERT_EQ(nifCommitScene(scene), NIF_OK);
  EXPECT_EQ(query_all(scene, rays_), query_all(near, rays_));
  EXPECT_TRUE(intersect_all(scene, rays_) == intersect_all(near, rays_));
  // Moving the camera by a millimetre is the same as moving all instances back by one.
  const double moved[3] = {far_away[0] + 0x1p-10, far_away[1], far_away[2]};
  ASSERT_EQ(nifSetSceneOrigin(scene, moved), NIF_OK);
  ASSERT_EQ(nifCommitScene(scene), NIF_OK);
  const double back[3] = {-0x1p-10, 0, 0};
  for (uint32_t i = 0; i < 12; ++i) ASSERT_EQ(nifSetInstanceOrigin(near, i, back), NIF_OK);
  ASSERT_EQ(nifCommitScene(near), NIF_OK);
  EXPECT_EQ(query_all(scene, rays_), query_all(near, rays_));
  // Where floats are fine enough, transforms moved by as much give the same.
  const Matrix exact{1, 0, 0, 0.25f, 0, 1, 0, -0.5f, 0, 0, 1, 1},
      shifted{1, 0, 0, 1.25f, 0, 1, 0, -0.5f, 0, 0, 1, 1};
  const double one[3] = {1, 0, 0};
  for (const Matrix* matrix : {&exact, &shifted}) {
    const NifScene single = new_scene();
    for (uint32_t i = 0; i < 3; ++i) {
      ASSERT_EQ(nifAddInstance(single, asset_, i, matrix->data(), nullptr), NIF_OK);
      ASSERT_EQ(nifSetInstanceOrigin(single, i, matrix == &exact ? one : nullptr), NIF_OK);
    }
    ASSERT_EQ(nifCommitScene(single), NIF_OK);
  }
  EXPECT_EQ(query_all(scenes_.end()[-2], rays_), query_all(scenes_.back(), rays_));
}

TEST_F(Instances, OriginsThatMakeNoSenseAreRefused) {
  const NifScene scene = scene_of_all();
  const double inf = std::numeric_limits<double>::infinity();
  for (const double bad : {inf, -inf, std::nan("")}) {
    const double origin[3] = {0, bad, 0};
    EXPECT_EQ(nifSetInstanceOrigin(scene, 0, origin), NIF_ERROR_INVALID_ARGUMENT);
    EXPECT_EQ(nifSetSceneOrigin(scene, origin), NIF_ERROR_INVALID_ARGUMENT);
  }
  const double huge[3] = {1e300, 0, 0};
  EXPECT_EQ(nifSetInstanceOrigin(scene, 0, huge), NIF_ERROR_INVALID_ARGUMENT);
  EXPECT_NE(std::string(nifGetErrorMessage()).find("too far"), std::string::npos) << nifGetErrorMessage();
  const Answers before = query_all(scene, rays_);
  // Only when all instances are moved does it turn out that a scene's origin is too far away.
  ASSERT_EQ(nifSetSceneOrigin(scene, huge), NIF_OK);
  EXPECT_EQ(nifCommitScene(scene), NIF_ERROR_INVALID_ARGUMENT);
  EXPECT_NE(std::string(nifGetErrorMessage()).find("instance 0"), std::string::npos) << nifGetErrorMessage();
  ASSERT_EQ(nifSetSceneOrigin(scene, nullptr), NIF_OK);
  ASSERT_EQ(nifCommitScene(scene), NIF_OK);
  EXPECT_EQ(query_all(scene, rays_), before);
}

/// Compares changes of every kind, in any order, with a scene that is built from nothing.
TEST_F(Instances, AnyChangesComeToTheSameAsANewScene) {
  for (uint64_t seed = 0; seed < 6; ++seed) {
    Random random(seed);
    const NifScene scene = new_scene();
    struct Known {
      bool exists = false, disabled = false;
      uint32_t object = 0, mask = ~0u;
      Matrix transform = kIdentity;
    };
    std::vector<Known> known;
    for (int step = 0; step < 60; ++step) {
      const uint32_t kind = random.below(8);
      uint32_t i = known.empty() ? 0 : random.below(uint32_t(known.size()));
      if (kind <= 2 || known.empty() || !known[i].exists) {
        const Matrix transform = random_transform(random, 3);
        const uint32_t object = random.below(6);
        ASSERT_EQ(nifAddInstance(scene, asset_, object, transform.data(), &i), NIF_OK);
        if (i == known.size()) known.emplace_back();
        ASSERT_LT(i, known.size());
        ASSERT_FALSE(known[i].exists);
        known[i] = {true, false, object, ~0u, transform};
      } else if (kind == 3) {
        ASSERT_EQ(nifRemoveInstance(scene, i), NIF_OK);
        known[i].exists = false;
        while (!known.empty() && !known.back().exists) known.pop_back();
      } else if (kind == 4) {
        known[i].disabled = !known[i].disabled;
        ASSERT_EQ(nifSetInstanceFlags(scene, i, known[i].disabled), NIF_OK);
      } else if (kind == 5) {
        known[i].mask = random.below(3);
        ASSERT_EQ(nifSetInstanceMask(scene, i, known[i].mask), NIF_OK);
      } else {
        known[i].transform = random_transform(random, 3);
        ASSERT_EQ(nifSetInstanceTransform(scene, i, known[i].transform.data()), NIF_OK);
      }
      if (random.below(3) != 0) continue;
      ASSERT_EQ(nifCommitScene(scene), NIF_OK);
      const NifScene plain = new_scene();
      std::vector<uint32_t> numbers;
      for (uint32_t k = 0; k < known.size(); ++k)
        if (known[k].exists && !known[k].disabled && known[k].mask != 0) {
          ASSERT_EQ(nifAddInstance(plain, asset_, known[k].object, known[k].transform.data(), nullptr),
                    NIF_OK);
          numbers.push_back(k);
        }
      ASSERT_EQ(nifCommitScene(plain), NIF_OK);
      ASSERT_EQ(query_all(scene, rays_), query_all(plain, rays_)) << seed << ' ' << step;
      FirstHits expected = intersect_all(plain, rays_);
      for (uint32_t& instance : expected.instance)
        if (instance != NIF_NONE) instance = numbers[instance];
      ASSERT_TRUE(intersect_all(scene, rays_) == expected) << seed << ' ' << step;
    }
  }
}

}  // namespace
}  // namespace nif::test
