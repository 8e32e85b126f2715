// Files that prove nothing, and objects that this build cannot answer: what the runtime says of them, and what
// nifAddAsset takes from a file's instances.
#include <cmath>
#include <limits>

#include "tests/format/damaged.hpp"
#include "tests/runtime/open_answers.hpp"
#include "tests/runtime/runtime_first_hits.hpp"

namespace nif::test {
namespace {

constexpr RandomAssetOptions kEveryEncoding{.objects = 2,
                                            .instances = 0,
                                            .max_voxels = 10,
                                            .bvhs = 2,
                                            .sphericals = 1,
                                            .exacts = 2,
                                            .proofs = 1,
                                            .cutouts = 1};
constexpr std::array<float, 12> kMoved{0.9f, 0.1f, 0, 0.1f, 0, -1.1f, 0.2f, 0, 0.1f, 0, 1, -0.1f};
constexpr float kNowhere = std::numeric_limits<float>::infinity();

class Provers : public RuntimeTest {
 protected:
  /// The asset of make(), and the same as of a file that proves nothing.
  std::array<NifAsset, 2> load_both() {
    const NifAsset proven = load();
    auto header = test::load<format::Header>(file_, 0);
    header.prover = 0;
    store(file_, 0, header);
    fix_checksums(file_);
    return {proven, load()};
  }
};

/// Nothing is certain then, and all else stays.
void expect_without_proofs(NifScene proven, NifScene unproven, const std::vector<NifRay>& rays) {
  const Answers with = query_all(proven, rays);
  Answers without = query_all(unproven, rays);
  EXPECT_EQ(std::ranges::count(without.certain, 0), int64_t(rays.size()));
  without.certain = with.certain;
  EXPECT_EQ(without, with);

  const FirstHits hits = intersect_all(proven, rays), doubted = intersect_all(unproven, rays);
  EXPECT_EQ(doubted.t, hits.t);
  EXPECT_EQ(doubted.normal, hits.normal);
  EXPECT_EQ(doubted.triangle, hits.triangle);
  EXPECT_EQ(std::ranges::count(doubted.certain, 0), int64_t(rays.size()));
  EXPECT_EQ(std::ranges::count(doubted.low, -kNowhere), int64_t(rays.size()));
  EXPECT_EQ(std::ranges::count(doubted.high, kNowhere), int64_t(rays.size()));

  const OpenAnswers open = query_open(unproven, rays, rays.size());
  EXPECT_EQ(std::ranges::count(open.certain, 0), int64_t(rays.size()));
  size_t asked = 0;
  for (const NifRay& ray : rays) {
    kernels::BoxRay prepared;
    asked += kernels::prepare_box_ray(to_segment(ray), prepared);
  }
  EXPECT_GE(open.count, asked);
  EXPECT_EQ(open.open.size(), open.count);
  for (const OpenRay& one : open.open) {
    EXPECT_EQ(one.tmin, rays[one.ray].tmin);
    EXPECT_EQ(one.tmax, rays[one.ray].tmax);
  }
}

TEST_F(Provers, OfRevisionZeroProveNothing) {
  for (uint64_t seed = 0; seed < 2; ++seed) {
    const format::AssetView& view = make(seed, kEveryEncoding);
    const std::vector<NifRay> rays = rays_near(view, seed, 800);
    const auto [proven, unproven] = load_both();
    NifAssetInfo info = nifkit::sized<NifAssetInfo>();
    ASSERT_EQ(nifGetAssetInfo(unproven, &info), NIF_OK);
    EXPECT_EQ(info.prover, 0u);
    EXPECT_EQ(info.proves, 0u);
    EXPECT_EQ(info.arithmetic, 1u);
    ASSERT_EQ(nifGetAssetInfo(proven, &info), NIF_OK);
    EXPECT_EQ(info.prover, 1u);
    EXPECT_EQ(info.proves, 1u);
    for (uint32_t object = 0; object < view.objects.size(); ++object)
      for (const float* transform : {kIdentity.data(), kMoved.data()})
        expect_without_proofs(scene_of(proven, object, transform), scene_of(unproven, object, transform),
                              rays);
    NifScene all[2] = {new_scene(), new_scene()};
    for (size_t i = 0; i < 2; ++i) {
      ASSERT_EQ(nifAddAsset(all[i], i ? unproven : proven, nullptr, nullptr, nullptr), NIF_OK);
      ASSERT_EQ(nifAddAsset(all[i], i ? unproven : proven, kMoved.data(), nullptr, nullptr), NIF_OK);
      ASSERT_EQ(nifCommitScene(all[i]), NIF_OK);
    }
    expect_without_proofs(all[0], all[1], rays);
  }
}

/// What others prove about what they block stays, but no ray certainly misses what nothing proves.
TEST_F(Provers, LeaveProofsOfOtherFiles) {
  const format::AssetView& view = make(3, kEveryEncoding);
  const std::vector<NifRay> rays = rays_near(view, 3, 3000);
  const auto [proven, unproven] = load_both();
  const NifScene alone = new_scene(), mixed = new_scene();
  for (const NifScene scene : {alone, mixed}) {
    ASSERT_EQ(nifAddAsset(scene, proven, nullptr, nullptr, nullptr), NIF_OK);
    ASSERT_EQ(nifCommitScene(scene), NIF_OK);
  }
  uint32_t far = 0;
  std::array<float, 12> away = kIdentity;
  away[3] = 1000;
  ASSERT_EQ(nifAddInstance(mixed, unproven, 2, away.data(), &far), NIF_OK);
  ASSERT_EQ(nifCommitScene(mixed), NIF_OK);
  const Answers with = query_all(alone, rays), without = query_all(mixed, rays);
  const FirstHits hits = intersect_all(alone, rays), doubted = intersect_all(mixed, rays);
  size_t blocked = 0, missed = 0;
  for (size_t i = 0; i < rays.size(); ++i) {
    if (without.visible[i] != with.visible[i]) continue;  // it met the one far away
    EXPECT_EQ(without.certain[i], with.certain[i] && !with.visible[i]);
    blocked += without.certain[i];
    missed += with.certain[i] && with.visible[i];
    EXPECT_EQ(doubted.low[i], -kNowhere);
    EXPECT_LE(doubted.high[i], hits.high[i]);
  }
  EXPECT_GT(blocked, 300u);
  EXPECT_GT(missed, 300u);
  // A disabled one does not count.
  ASSERT_EQ(nifSetInstanceFlags(mixed, far, NIF_INSTANCE_DISABLED), NIF_OK);
  ASSERT_EQ(nifCommitScene(mixed), NIF_OK);
  EXPECT_EQ(query_all(mixed, rays), with);
  EXPECT_EQ(intersect_all(mixed, rays), hits);
}

TEST_F(Provers, OfObjectsThatCannotBeAnswered) {
  make(5, {.objects = 1, .instances = 3, .max_voxels = 6, .bvhs = 2});
  const std::vector<std::byte> good = file_;
  const NifAsset whole = load();
  const std::vector<NifRay> rays = rays_near(*view_, 5, 500);
  for (uint32_t broken = 0; broken < 3; ++broken) {
    file_ = with_record<format::ObjectRecord>(good, format::kObjects, broken,
                                              [](auto& r) { r.flags = format::kDeforms; });
    const NifAsset asset = load();
    for (uint32_t object = 0; object < 3; ++object) {
      NifObjectInfo info = nifkit::sized<NifObjectInfo>(), same = info;
      ASSERT_EQ(nifGetObjectInfo(asset, object, &info), NIF_OK);
      ASSERT_EQ(nifGetObjectInfo(whole, object, &same), NIF_OK);
      EXPECT_STREQ(info.name, same.name);
      EXPECT_EQ(info.bounds_max[1], same.bounds_max[1]);
      if (object != broken) {
        EXPECT_STREQ(info.unsupported, "");
        EXPECT_EQ(info.encoding, same.encoding);
        EXPECT_EQ(query_all(scene_of(asset, object), rays), query_all(scene_of(whole, object), rays));
        continue;
      }
      EXPECT_STREQ(info.unsupported, "deforms, which this build does not know");
      EXPECT_EQ(info.encoding, 0u);
      const NifScene scene = new_scene();
      EXPECT_EQ(nifAddInstance(scene, asset, object, nullptr, nullptr), NIF_ERROR_UNSUPPORTED_NIF);
      EXPECT_EQ(std::string(nifGetErrorMessage()), "memory: object " + std::to_string(object) + " ('" +
                                                       info.name +
                                                       "') deforms, which this build does not know");
      NifSceneInfo about = nifkit::sized<NifSceneInfo>();
      const bool placed = std::ranges::any_of(
          view_->instances, [&](const format::InstanceView& instance) { return instance.object == broken; });
      EXPECT_EQ(nifAddAsset(scene, asset, nullptr, nullptr, nullptr),
                placed ? NIF_ERROR_UNSUPPORTED_NIF : NIF_OK);
      ASSERT_EQ(nifGetSceneInfo(scene, &about), NIF_OK);
      EXPECT_EQ(about.instance_count, placed ? 0u : 3u);
    }
    // Their parts' bytes still add up.
    NifAssetInfo about = nifkit::sized<NifAssetInfo>();
    ASSERT_EQ(nifGetAssetInfo(asset, &about), NIF_OK);
    NifPartInfo part = nifkit::sized<NifPartInfo>();
    uint64_t bytes = 0;
    for (uint32_t i = 0; nifGetPartInfo(asset, i, &part) == NIF_OK; ++i) bytes += part.file_bytes;
    EXPECT_EQ(bytes, about.file_bytes);
  }
}

TEST_F(Provers, OfCoarserLevelsAreNotPlaced) {
  const RandomAssetOptions plain{.objects = 0, .instances = 0, .bvhs = 3};
  format::Asset asset = random_asset(7, plain);
  asset.objects[0].level = 1;
  asset.objects[0].error = 0.25f;
  file_ = format::encode(asset);
  const NifAsset loaded = load();
  NifObjectInfo info = nifkit::sized<NifObjectInfo>();
  ASSERT_EQ(nifGetObjectInfo(loaded, 0, &info), NIF_OK);
  EXPECT_EQ(info.level, 1u);
  EXPECT_EQ(info.error, 0.25f);
  const NifScene scene = new_scene();
  uint32_t count = 0;
  ASSERT_EQ(nifAddAsset(scene, loaded, nullptr, nullptr, &count), NIF_OK);
  EXPECT_EQ(count, 2u);
  for (uint32_t i = 0; i < 2; ++i) {
    NifInstanceInfo placed = nifkit::sized<NifInstanceInfo>();
    ASSERT_EQ(nifGetInstanceInfo(scene, i, &placed), NIF_OK);
    EXPECT_EQ(placed.object, i + 1);
    EXPECT_EQ(placed.mask, 0xffffffffu);
  }
  EXPECT_EQ(nifAddInstance(scene, loaded, 0, nullptr, nullptr), NIF_OK) << "but the caller may";
}

TEST_F(Provers, GiveInstancesTheSettingsOfTheFile) {
  make(11, {.objects = 1, .instances = 20, .max_voxels = 6, .bvhs = 2, .settings = true});
  const NifAsset asset = load();
  const NifScene scene = new_scene(), by_hand = new_scene();
  ASSERT_EQ(nifAddAsset(scene, asset, nullptr, nullptr, nullptr), NIF_OK);
  for (uint32_t i = 0; i < 20; ++i) {
    const format::InstanceView& wanted = view_->instances[i];
    NifInstanceInfo seen = nifkit::sized<NifInstanceInfo>();
    ASSERT_EQ(nifGetInstanceInfo(scene, i, &seen), NIF_OK);
    EXPECT_EQ(seen.mask, wanted.mask);
    EXPECT_EQ(seen.flags, wanted.flags);
    EXPECT_EQ(seen.user, wanted.user);
    NifAssetInstanceInfo said = nifkit::sized<NifAssetInstanceInfo>();
    ASSERT_EQ(nifGetAssetInstanceInfo(asset, i, &said), NIF_OK);
    EXPECT_EQ(said.mask, wanted.mask);
    EXPECT_EQ(said.flags, wanted.flags);
    EXPECT_EQ(said.user, wanted.user);
    EXPECT_EQ(said.parent, wanted.parent);
    EXPECT_EQ(wanted.parent == format::kNoParent, said.parent == NIF_NONE);

    ASSERT_EQ(nifAddInstance(by_hand, asset, wanted.object, wanted.transform.data(), nullptr), NIF_OK);
    ASSERT_EQ(nifSetInstanceMask(by_hand, i, wanted.mask), NIF_OK);
    ASSERT_EQ(nifSetInstanceFlags(by_hand, i, wanted.flags), NIF_OK);
    ASSERT_EQ(nifSetInstanceUser(by_hand, i, wanted.user), NIF_OK);
  }
  ASSERT_EQ(nifCommitScene(scene), NIF_OK);
  ASSERT_EQ(nifCommitScene(by_hand), NIF_OK);
  std::vector<NifRay> rays = rays_near(*view_, 11, 2000);
  std::vector<uint32_t> masks(rays.size());
  Random random(11);
  for (uint32_t& mask : masks) mask = random.below(16);
  const auto hits_of = [&](NifScene from) {
    FirstHits hits(rays.size());
    NifRays query = nifMakeRays(rays.data(), rays.size());
    query.mask = masks.data();
    query.mask_stride = sizeof(uint32_t);
    const NifHits outputs = hits.outputs();
    EXPECT_EQ(nifIntersect(from, &query, &outputs), NIF_OK);
    return hits;
  };
  EXPECT_EQ(hits_of(scene), hits_of(by_hand));
  EXPECT_EQ(intersect_all(scene, rays), intersect_all(by_hand, rays));
}

}  // namespace
}  // namespace nif::test
