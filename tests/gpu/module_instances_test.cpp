// Instances of scenes on a GPU: masks, removed and disabled ones, user values, origins. All calls in GPU
// memory must give the CPU's answers.
#include "formats/nif/reader.hpp"
#include "tests/gpu/gpu_hit_query.hpp"
#include "tests/gpu/gpu_open_query.hpp"

namespace nif::test {
namespace {

constexpr RandomAssetOptions kObjectsOfAllKinds{
    .objects = 2, .instances = 0, .bvhs = 1, .sphericals = 1, .exacts = 1, .proofs = 1, .features = 2};
constexpr uint32_t kAllBits = 0xffffffffu;

/// The masks of a query's rays.
struct Masks {
  std::vector<uint32_t> values{};  ///< none: null
  uint64_t stride = 4;             ///< 0: one for all rays

  /// As `rays` has them, if their first one lies there.
  void put(NifRays& rays, const void* first) const {
    if (values.empty()) return;
    rays.mask = static_cast<const uint32_t*>(first);
    rays.mask_stride = stride;
  }
};

/// The answers of all calls for some rays.
struct Everything {
  explicit Everything(size_t count)
      : answers(count), visible(count, 0xcc), open(count), open_instance(count, 0xcccccccc), hits(count) {}
  Answers answers;
  std::vector<uint8_t> visible;  ///< where nothing else is asked for
  OpenAnswers open;
  std::vector<uint32_t> open_instance;  ///< of each ray that is listed
  FirstHits hits;
};

Everything ask_cpu(NifScene scene, const std::vector<NifRay>& rays, const Masks& masks) {
  const size_t count = rays.size();
  Everything said(count);
  NifRays asked = nifMakeRays(rays.data(), count);
  masks.put(asked, masks.values.data());
  NifAnswers outputs = said.answers.outputs();
  EXPECT_EQ(nifQuery(scene, &asked, &outputs), NIF_OK) << nifGetErrorMessage();
  outputs = nifkit::sized<NifAnswers>();
  outputs.visible = said.visible.data();
  EXPECT_EQ(nifQuery(scene, &asked, &outputs), NIF_OK) << nifGetErrorMessage();

  std::vector<uint32_t> numbers(count), instances(count);
  std::vector<float> tmin(count), tmax(count);
  auto open = nifkit::sized<NifOpenRays>();
  open.capacity = count;
  open.rays = numbers.data();
  open.tmin = tmin.data();
  open.tmax = tmax.data();
  open.count = &said.open.count;
  open.instance = instances.data();
  outputs = said.open.outputs();
  EXPECT_EQ(nifQueryOpen(scene, &asked, &outputs, &open), NIF_OK) << nifGetErrorMessage();
  for (uint32_t k = 0; k < said.open.count; ++k) {
    OpenRay ray;
    ray.ray = numbers[k], ray.tmin = tmin[k], ray.tmax = tmax[k];
    said.open.open.push_back(ray);
    said.open_instance[numbers[k]] = instances[k];
  }
  std::sort(said.open.open.begin(), said.open.open.end());

  const NifHits hits = said.hits.outputs();
  EXPECT_EQ(nifIntersect(scene, &asked, &hits), NIF_OK) << nifGetErrorMessage();
  return said;
}

void expect_equal(const Everything& got, const Everything& expected) {
  expect_same(got.answers, expected.answers);
  EXPECT_EQ(got.visible, expected.visible);
  expect_same(got.open, expected.open);
  EXPECT_EQ(got.open.count, expected.open.count);
  EXPECT_TRUE(got.open.open == expected.open.open);
  EXPECT_EQ(got.open_instance, expected.open_instance);
  EXPECT_EQ(count_different_hits(got.hits, expected.hits), 0u);
}

struct InstanceWay {
  uint32_t gpu;
  const char* pipeline;
};
/// Waves of 32 lanes and of 64; queries with masks always use the one kernel.
constexpr InstanceWay kInstanceWays[] = {{0, "on"}, {2, "on"}, {0, "off"}, {2, "off"}};

class GpuInstances : public GpuModuleTest, public testing::WithParamInterface<InstanceWay> {
 protected:
  uint32_t gpu() const { return GetParam().gpu; }
  std::string config() const { return GpuModuleTest::config(gpu()) + ",pipeline=" + GetParam().pipeline; }

  Everything ask_gpu(NifScene scene, const std::vector<NifRay>& rays, const Masks& masks) {
    Everything said(rays.size());
    // At an odd address.
    const GpuArray on_gpu(machine(), gpu(), nullptr, 4 * masks.values.size());
    std::memcpy(on_gpu.as<char>() + 1, masks.values.data(), 4 * masks.values.size());
    void* stream = machine().make_stream(gpu());
    const auto prepare = [&](NifRays& query) {
      masks.put(query, on_gpu.as<char>() + 1);
      query.stream = stream;
    };
    GpuQuery all(machine(), gpu(), rays), plain(machine(), gpu(), rays);
    GpuOpenQuery open(machine(), gpu(), rays, rays.size());
    GpuHitQuery hits(machine(), gpu(), rays);
    prepare(all.query), prepare(plain.query), prepare(open.query), prepare(hits.query);
    plain.outputs = nifkit::sized<NifAnswers>();
    plain.outputs.visible = plain.answers.outputs().visible;
    EXPECT_EQ(nifQuery(scene, &all.query, &all.outputs), NIF_OK) << nifGetErrorMessage();
    EXPECT_EQ(nifQuery(scene, &plain.query, &plain.outputs), NIF_OK) << nifGetErrorMessage();
    EXPECT_EQ(nifQueryOpen(scene, &open.query, &open.outputs, &open.open), NIF_OK) << nifGetErrorMessage();
    EXPECT_EQ(nifIntersect(scene, &hits.query, &hits.hits), NIF_OK) << nifGetErrorMessage();
    machine().wait_stream(stream);
    machine().free_stream(stream);
    said.answers = all.answers.get();
    said.visible = plain.answers.get().visible;
    said.open = open.get();
    said.open_instance = open.instances();
    said.hits = hits.get();
    return said;
  }
  /// Returns the CPU's answers, after checking that the GPU gives the same.
  Everything expect_twins(const TwinScenes& twins, const std::vector<NifRay>& rays, const Masks& masks = {}) {
    const Everything expected = ask_cpu(twins.cpu(), rays, masks);
    expect_equal(ask_gpu(twins.gpu(), rays, masks), expected);
    return expected;
  }

  /// A crowd of all objects of an asset, several of each.
  uint32_t fill(TwinScenes& twins, uint64_t seed, uint32_t count) {
    Random random(seed);
    const uint32_t asset = twins.load(random_asset(seed, kObjectsOfAllKinds));
    for (uint32_t i = 0; i < count; ++i)
      twins.add(asset, i % twins.objects(asset), random_transform(random, 3));
    return asset;
  }
  static std::vector<NifRay> some_rays(uint64_t seed, size_t count = 1500) {
    Random random(seed);
    return rays_in_cube(random, 5, count);
  }
};
INSTANTIATE_TEST_SUITE_P(EachWay, GpuInstances, testing::ValuesIn(kInstanceWays), [](const auto& p) {
  return std::string(name_of(kMatrixKinds[p.param.gpu])) + "_" + p.param.pipeline;
});

size_t hits_of(const Everything& said) {
  return size_t(std::count(said.hits.hit.begin(), said.hits.hit.end(), 1));
}

/// A mask for each ray, one for all, and none; of instances that have some, all, and no bit in common.
TEST_P(GpuInstances, OfManyMasks) {
  constexpr uint32_t kBits[] = {0, 1, 2, 3, 0x80000000u, kAllBits};
  TwinScenes twins(config());
  fill(twins, 1, 23);
  Random random(2);
  for (uint32_t i = 0; i < 23; ++i) {
    const uint32_t mask = kBits[random.below(std::size(kBits))];
    twins.both([&](nifkit::Scene& scene) { scene.set_instance_mask(i, mask); });
  }
  twins.commit();
  const std::vector<NifRay> rays = some_rays(3);
  const size_t all = hits_of(expect_twins(twins, rays));
  EXPECT_EQ(hits_of(expect_twins(twins, rays, {{kAllBits}, 0})), all) << "as without masks";
  EXPECT_EQ(hits_of(expect_twins(twins, rays, {{0}, 0})), 0u);
  EXPECT_EQ(hits_of(expect_twins(twins, rays, {{4}, 0})), hits_of(expect_twins(twins, rays, {{8}, 0})));

  Masks each;
  for (size_t i = 0; i < rays.size(); ++i) each.values.push_back(kBits[random.below(std::size(kBits))]);
  const size_t some = hits_of(expect_twins(twins, rays, each));
  EXPECT_GT(some, 50u);
  EXPECT_LT(some, all);
  Masks apart{{}, 12};
  for (const uint32_t mask : each.values) apart.values.insert(apart.values.end(), {mask, 0, kAllBits});
  EXPECT_EQ(hits_of(expect_twins(twins, rays, apart)), some);
  // Splitting into launches does not change answers.
  machine().most_rays = 504;
  EXPECT_EQ(hits_of(expect_twins(twins, rays, each)), some);
}

/// For rays with one mask the scene is as if the non-matching instances were disabled. (If disabling leaves a
/// sole instance, it is queried even for rays that are invalid in world space; with masks it is not.)
TEST_P(GpuInstances, BehindMasksAreAsIfDisabled) {
  TwinScenes masked(config()), disabled(config());
  fill(masked, 4, 12);
  fill(disabled, 4, 12);
  masked.both([](nifkit::Scene& scene) {
    for (uint32_t i = 0; i < 12; ++i) scene.set_instance_mask(i, 1u << i % 3);
  });
  masked.commit();
  const std::vector<NifRay> rays = some_rays(5);
  for (uint32_t bit = 0; bit < 4; ++bit) {
    disabled.both([&](nifkit::Scene& scene) {
      for (uint32_t i = 0; i < 12; ++i)
        scene.set_instance_flags(i, i % 3 == bit ? 0u : uint32_t(NIF_INSTANCE_DISABLED));
    });
    disabled.commit();
    expect_equal(expect_twins(masked, rays, {{1u << bit}, 0}), expect_twins(disabled, rays));
  }
}

/// Each kind of object as the only instance, with and without a transform: the mask matches, or not.
TEST_P(GpuInstances, OneInstanceWithAMask) {
  TwinScenes empty(config());
  empty.commit();
  Random random(6);
  const format::Asset asset = random_asset(6, kObjectsOfAllKinds);
  const std::vector<NifRay> rays = some_rays(7, 600);
  const Everything nothing = ask_cpu(empty.cpu(), rays, {});
  Masks each;
  for (size_t i = 0; i < rays.size(); ++i) each.values.push_back(random.below(4));
  for (uint32_t object = 0; object < asset.objects.size(); ++object)
    for (const bool identity : {true, false}) {
      TwinScenes twins(config());
      twins.add(twins.load(asset), object, identity ? kIdentity : random_transform(random, 2));
      twins.both([](nifkit::Scene& scene) { scene.set_instance_mask(0, 2); });
      twins.commit();
      expect_twins(twins, rays, each);
      expect_equal(expect_twins(twins, rays, {{6}, 0}), expect_twins(twins, rays));
      expect_equal(expect_twins(twins, rays, {{5}, 0}), nothing);
    }
}

/// One instance takes the lowest free number; those of an asset are consecutive, after all others, unless a gap
/// has room for them.
TEST_P(GpuInstances, NumbersOfNewOnes) {
  TwinScenes twins(config());
  const uint32_t asset = fill(twins, 34, 5);
  twins.both([](nifkit::Scene& scene) {
    for (const uint32_t i : {0u, 2u, 3u}) scene.remove_instance(i);
  });
  const uint32_t count = twins.objects(asset);
  EXPECT_EQ(twins.gpu_scene().add_asset(twins.gpu_asset(asset)).first, 5u);
  EXPECT_EQ(twins.gpu_scene().add_instance(twins.gpu_asset(asset), 0), 0u);
  EXPECT_EQ(twins.gpu_scene().add_instance(twins.gpu_asset(asset), 1), 2u);
  EXPECT_EQ(twins.gpu_scene().info().instance_end, 5 + count);
}

TEST_P(GpuInstances, NoneWithMasks) {
  TwinScenes twins(config());
  twins.commit();
  EXPECT_EQ(hits_of(expect_twins(twins, some_rays(8, 300), {{1}, 0})), 0u);
}

/// Step by step, until nothing is left, and back.
TEST_P(GpuInstances, RemovedOnes) {
  TwinScenes twins(config());
  const uint32_t asset = fill(twins, 9, 12);
  twins.commit();
  const std::vector<NifRay> rays = some_rays(10);
  const size_t all = hits_of(expect_twins(twins, rays));
  for (const uint32_t number : {11u, 0u, 5u, 1u, 2u, 9u}) {
    twins.both([&](nifkit::Scene& scene) { scene.remove_instance(number); });
    twins.commit();
    const Everything said = expect_twins(twins, rays);
    EXPECT_EQ(std::count(said.hits.instance.begin(), said.hits.instance.end(), number), 0);
  }
  // A free number is reused.
  EXPECT_EQ(twins.cpu_scene().info().instance_count, 6u);
  twins.add(asset, 2, kIdentity);
  twins.commit();
  const Everything said = expect_twins(twins, rays);
  EXPECT_GT(std::count(said.hits.instance.begin(), said.hits.instance.end(), 0), 0);
  EXPECT_EQ(twins.cpu_scene().info().instance_end, 11u);
  for (const uint32_t number : {0u, 3u, 4u, 6u, 7u, 8u}) {
    twins.both([&](nifkit::Scene& scene) { scene.remove_instance(number); });
    twins.commit();
    expect_twins(twins, rays);
  }
  // Only number 10 is left; then none.
  EXPECT_EQ(twins.cpu_scene().info().instance_count, 1u);
  expect_twins(twins, rays, {{1}, 0});
  twins.both([&](nifkit::Scene& scene) { scene.remove_instance(10); });
  twins.commit();
  EXPECT_EQ(hits_of(expect_twins(twins, rays)), 0u);
  EXPECT_EQ(hits_of(expect_twins(twins, rays, {{1}, 0})), 0u);
  fill(twins, 9, 12);
  twins.commit();
  EXPECT_EQ(hits_of(expect_twins(twins, rays)), all);
}

/// Each commit copies what has bent; what removed instances had goes.
TEST_P(GpuInstances, ThatBend) {
  TwinScenes twins(config());
  Random random(21);
  const format::Asset bending =
      random_asset(21, {.objects = 1, .instances = 0, .bvhs = 2, .skins = 2, .sources = 2});
  const uint32_t asset = twins.load(bending);
  for (uint32_t i = 0; i < 8; ++i) twins.add(asset, 1 + i % 2, random_transform(random, 4));
  twins.add(asset, 0, kIdentity);
  twins.commit();
  const std::vector<NifRay> rays = some_rays(22);
  expect_twins(twins, rays);
  size_t hits = 0;
  for (int round = 0; round < 4; ++round) {
    for (uint32_t i = 0; i < 8; ++i) {
      if ((round == 3 && i == 2) || random.below(3) == 0) continue;
      const format::Object& object = bending.objects[1 + i % 2];
      std::vector<std::array<float, 3>> positions(object.skin->vertex_count);
      for (size_t v = 0; v < object.triangles->vertices.size(); ++v)  // each vertex is one of the source
        for (size_t a = 0; a < 3; ++a)
          positions[v][a] = object.triangles->vertices[v][a] + random.between(-0.2f, 0.2f);
      const bool rests = random.below(4) == 0;
      twins.both([&](nifkit::Scene& scene) {
        if (rests)
          scene.set_instance_vertices(i, {});
        else
          scene.set_instance_vertices(i, positions);
      });
    }
    if (round == 2) twins.both([&](nifkit::Scene& scene) { scene.remove_instance(2); });
    twins.commit();
    hits += hits_of(expect_twins(twins, rays));
  }
  EXPECT_GT(hits, 100u);
  // Without any instance, and with one that bends again.
  for (uint32_t i = 9; i-- > 0;)
    if (i != 2) twins.both([&](nifkit::Scene& scene) { scene.remove_instance(i); });
  twins.commit();
  EXPECT_EQ(hits_of(expect_twins(twins, rays)), 0u);
  twins.add(asset, 1, kIdentity);
  twins.both([&](nifkit::Scene& scene) { scene.set_instance_vertices(0, {}); });
  twins.commit();
  expect_twins(twins, rays);
}

/// A commit copies only what has bent since the last one, besides the scene.
TEST_P(GpuInstances, CommitsCopyWhatHasBent) {
  TwinScenes twins(config());
  const uint32_t asset = twins.load(random_asset(21, {.objects = 1, .instances = 0, .bvhs = 1, .skins = 1}));
  Random random(23);
  for (uint32_t i = 0; i < 6; ++i) twins.add(asset, 1, random_transform(random, 4));
  const auto uploads_of = [&](uint32_t bent) {
    for (uint32_t i = 0; i < bent; ++i)
      twins.both([&](nifkit::Scene& scene) { scene.set_instance_vertices(i, {}); });
    twins.move(5, random_transform(random, 4));
    const uint32_t before = machine().uploads;
    twins.commit();
    return machine().uploads - before;
  };
  twins.commit();
  const uint32_t of_a_scene = uploads_of(0);
  EXPECT_EQ(uploads_of(4), of_a_scene + 4);
  EXPECT_EQ(uploads_of(0), of_a_scene);
  EXPECT_EQ(uploads_of(1), of_a_scene + 1);
  expect_twins(twins, some_rays(24));
}

/// Each kind of object, left as the sole instance under a number other than 0: by removal, by flags, by a
/// mask of 0.
TEST_P(GpuInstances, TheLastOne) {
  const format::Asset asset = random_asset(11, kObjectsOfAllKinds);
  const std::vector<NifRay> rays = some_rays(12, 600);
  Random random(13);
  for (uint32_t object = 0; object < asset.objects.size(); ++object) {
    const Matrix place = object % 2 ? kIdentity : random_transform(random, 2);
    TwinScenes alone(config());
    alone.add(alone.load(asset), object, place);
    alone.commit();
    Everything expected = expect_twins(alone, rays);
    for (uint32_t& instance : expected.hits.instance) instance = instance == 0 ? 2 : instance;
    for (uint32_t& instance : expected.open_instance) instance = instance == 0 ? 2 : instance;
    for (const uint32_t how : {0u, 1u, 2u}) {
      TwinScenes twins(config());
      const uint32_t loaded = twins.load(asset);
      for (uint32_t i = 0; i < 4; ++i) twins.add(loaded, i == 2 ? object : i, place);
      if (how != 1) twins.commit();
      twins.both([&](nifkit::Scene& scene) {
        for (const uint32_t i : {0u, 1u, 3u}) {
          if (how == 0) scene.remove_instance(i);
          if (how == 1) scene.set_instance_flags(i, NIF_INSTANCE_DISABLED);
          if (how == 2) scene.set_instance_mask(i, 0);
        }
      });
      twins.commit();
      expect_equal(expect_twins(twins, rays), expected);
      if (how == 0) continue;
      // And back again.
      twins.both([&](nifkit::Scene& scene) {
        scene.set_instance_flags(3, 0);
        scene.set_instance_mask(3, kAllBits);
      });
      twins.commit();
      const Everything said = expect_twins(twins, rays);
      EXPECT_EQ(std::count(said.hits.instance.begin(), said.hits.instance.end(), 0), 0);
    }
  }
}

/// An instance that is disabled before the first commit is not in the hierarchy; once enabled, it is.
TEST_P(GpuInstances, EnabledAgain) {
  TwinScenes twins(config()), plain(config());
  fill(twins, 14, 8);
  fill(plain, 14, 8);
  plain.commit();
  const std::vector<NifRay> rays = some_rays(15);
  const Everything expected = expect_twins(plain, rays);
  const auto set_flags = [&](uint32_t flags) {
    twins.both([&](nifkit::Scene& scene) {
      for (uint32_t i = 0; i < 8; i += 2) scene.set_instance_flags(i, flags);
    });
    twins.commit();
  };
  set_flags(NIF_INSTANCE_DISABLED);
  const Everything fewer = expect_twins(twins, rays);
  EXPECT_LT(hits_of(fewer), hits_of(expected));
  set_flags(0);
  expect_equal(expect_twins(twins, rays), expected);
  set_flags(NIF_INSTANCE_DISABLED);
  expect_equal(expect_twins(twins, rays), fewer);
}

/// A removed instance's asset is freed on the GPU at the commit, which waits for queries of the old scene.
TEST_P(GpuInstances, AssetsAreDroppedAfterQueriesOfThem) {
  TwinScenes twins(config());
  const uint32_t first = fill(twins, 16, 6), second = twins.load(random_asset(17, kObjectsOfAllKinds));
  for (uint32_t i = 0; i < 6; ++i) twins.add(second, i, kIdentity);
  twins.commit();
  const uint64_t bytes_of_first = twins.gpu_asset(first).info().gpu_bytes,
                 bytes_of_second = twins.gpu_asset(second).info().gpu_bytes;
  ASSERT_GT(bytes_of_first, 1000u);
  twins.forget(first);
  twins.forget(second);
  const std::vector<NifRay> rays = some_rays(18);
  const Answers expected = query_all(twins.cpu(), rays);
  GpuQuery asked(machine(), gpu(), rays);
  void* stream = asked.query.stream = machine().make_stream(gpu());
  ASSERT_EQ(nifQuery(twins.gpu(), &asked.query, &asked.outputs), NIF_OK) << nifGetErrorMessage();
  GpuHitQuery hits(machine(), gpu(), rays);
  hits.query.stream = stream;
  ASSERT_EQ(nifIntersect(twins.gpu(), &hits.query, &hits.hits), NIF_OK) << nifGetErrorMessage();
  const FirstHits expected_hits = intersect_all(twins.cpu(), rays);
  twins.both([](nifkit::Scene& scene) {
    for (uint32_t i = 0; i < 6; ++i) scene.remove_instance(i);
  });
  EXPECT_TRUE(asked.answers.untouched());
  uint64_t allocated = machine().allocated;
  twins.commit();
  EXPECT_LE(machine().allocated + bytes_of_first, allocated);
  EXPECT_FALSE(asked.answers.untouched());
  expect_same(asked.answers.get(), expected);
  EXPECT_EQ(count_different_hits(hits.get(), expected_hits), 0u);
  machine().free_stream(stream);
  expect_twins(twins, rays);
  twins.both([](nifkit::Scene& scene) {
    for (uint32_t i = 6; i < 12; ++i) scene.remove_instance(i);
  });
  allocated = machine().allocated;
  twins.commit();
  EXPECT_LE(machine().allocated + bytes_of_second, allocated);
  EXPECT_EQ(hits_of(expect_twins(twins, rays)), 0u);
}

/// If the GPU has no room for the remaining scene, the CPU answers, and the next commit frees the asset.
TEST_P(GpuInstances, AssetsAreDroppedByACommitThatSucceeds) {
  TwinScenes twins(config());
  const uint32_t first = fill(twins, 19, 6), second = twins.load(random_asset(20, kObjectsOfAllKinds));
  twins.commit();
  twins.forget(first);
  twins.both([](nifkit::Scene& scene) {
    for (uint32_t i = 0; i < 6; ++i) scene.remove_instance(i);
  });
  for (uint32_t i = 0; i < 6; ++i) twins.add(second, i, kIdentity);
  ASSERT_EQ(nifCommitScene(twins.cpu()), NIF_OK);
  machine().fail_allocation = 1;
  EXPECT_EQ(nifCommitScene(twins.gpu()), NIF_ERROR_OUT_OF_DEVICE_MEMORY);
  const std::vector<NifRay> rays = some_rays(21, 500);
  EXPECT_EQ(query_all(twins.gpu(), rays), query_all(twins.cpu(), rays));
  ASSERT_EQ(nifCommitScene(twins.gpu()), NIF_OK) << nifGetErrorMessage();
  expect_twins(twins, rays);
}

/// 64 bits, of some instances; and other ones after a commit.
TEST_P(GpuInstances, UserValues) {
  TwinScenes twins(config());
  fill(twins, 22, 7);
  twins.commit();
  const std::vector<NifRay> rays = some_rays(23);
  const auto value = [](uint32_t instance) { return 0xfedcba9876543210u + (uint64_t{instance} << 33); };
  const auto expect_users = [&](const std::vector<uint64_t>& users) {
    const Everything said = expect_twins(twins, rays);
    for (size_t i = 0; i < rays.size(); ++i)
      ASSERT_EQ(said.hits.user[i], said.hits.hit[i] ? users[said.hits.instance[i]] : 0) << i;
  };
  std::vector<uint64_t> users(7, 0);
  expect_users(users);
  for (uint32_t i = 1; i < 7; i += 2) {
    users[i] = value(i);
    twins.both([&](nifkit::Scene& scene) { scene.set_instance_user(i, users[i]); });
  }
  twins.commit();
  expect_users(users);
  users = std::vector<uint64_t>(7, 0);
  twins.both([&](nifkit::Scene& scene) {
    for (uint32_t i = 0; i < 7; ++i) scene.set_instance_user(i, 0);
  });
  twins.commit();
  expect_users(users);
  // One instance alone.
  twins.both([&](nifkit::Scene& scene) {
    for (uint32_t i = 0; i < 6; ++i) scene.remove_instance(i);
    scene.set_instance_user(6, value(6));
  });
  twins.commit();
  users[6] = value(6);
  expect_users(users);
}

/// Lists name the instance if only one leaves a ray open, and none if several do.
TEST_P(GpuInstances, ThatLeaveRaysOpen) {
  TwinScenes twins(config());
  fill(twins, 24, 30);
  twins.commit();
  const Everything said = expect_twins(twins, some_rays(25, 4000));
  std::vector<uint32_t> named(30, 0);
  uint32_t several = 0;
  for (const OpenRay& ray : said.open.open) {
    const uint32_t instance = said.open_instance[ray.ray];
    if (instance == NIF_NONE)
      ++several;
    else
      ++named.at(instance);
  }
  EXPECT_GT(several, 10u);
  EXPECT_GT(std::count_if(named.begin(), named.end(), [](uint32_t n) { return n > 0; }), 10);
}

/// In a world of 10,000 km, rays near the scene's origin see what they see near 0.
TEST_P(GpuInstances, FarAway) {
  constexpr double kFar = 0x1p23 + 0x1p-20;  // no float has all of its bits
  TwinScenes near(config()), far(config());
  fill(near, 26, 9);
  fill(far, 26, 9);
  near.commit();
  far.both([&](nifkit::Scene& scene) {
    for (uint32_t i = 0; i < 9; ++i) scene.set_instance_origin(i, {kFar, -kFar, 3 * kFar});
    scene.set_origin({kFar, -kFar, 3 * kFar});
  });
  far.commit();
  const std::vector<NifRay> rays = some_rays(27);
  const Everything expected = expect_twins(near, rays);
  EXPECT_GT(hits_of(expected), 100u);
  expect_equal(expect_twins(far, rays), expected);
  // A camera that moves, and an instance that moves with it.
  far.both([&](nifkit::Scene& scene) {
    scene.set_origin({kFar + 0.3, -kFar - 1e-9, 3 * kFar});
    scene.set_instance_origin(4, {kFar + 0.7, -kFar, 3 * kFar + 1e-5});
  });
  far.commit();
  EXPECT_GT(hits_of(expect_twins(far, rays)), 100u);
  // From far away: 48 bits of a place.
  far.both([&](nifkit::Scene& scene) { scene.set_origin({kFar - 1000.1, -kFar, 3 * kFar}); });
  far.commit();
  std::vector<NifRay> there = rays;
  for (NifRay& ray : there) ray.origin[0] += 1000.1f;
  EXPECT_GT(hits_of(expect_twins(far, there)), 100u);
}

/// In any layout, they go to the GPU with the rays of nifQuery; the CPU answers the other calls.
TEST_P(GpuInstances, MasksOfHostMemory) {
  TwinScenes twins(config());
  fill(twins, 28, 9);
  twins.both([](nifkit::Scene& scene) {
    for (uint32_t i = 0; i < 9; ++i) scene.set_instance_mask(i, 1u << i % 3);
  });
  twins.commit();
  const std::vector<NifRay> rays = some_rays(29);
  Masks each, apart{{}, 12}, backwards{{}, uint64_t(-4)};
  for (size_t i = 0; i < rays.size(); ++i) {
    each.values.push_back(uint32_t(i % 8));
    apart.values.insert(apart.values.end(), {uint32_t(i % 8), 7, 0});
  }
  backwards.values.assign(each.values.rbegin(), each.values.rend());
  const Everything expected = ask_cpu(twins.cpu(), rays, each);
  const uint32_t pipelined = machine().pipelined;
  uint64_t launched = machine().rays_launched;
  expect_equal(ask_cpu(twins.gpu(), rays, each), expected);
  EXPECT_EQ(machine().rays_launched, launched + 2 * rays.size()) << "of two queries";
  expect_equal(ask_cpu(twins.gpu(), rays, apart), expected);
  for (const uint32_t mask : {5u, 8u})
    expect_equal(ask_cpu(twins.gpu(), rays, {{mask}, 0}), ask_cpu(twins.cpu(), rays, {{mask}, 0}));

  NifRays asked = nifMakeRays(rays.data(), rays.size());
  backwards.put(asked, &backwards.values.back());
  Answers answers(rays.size());
  const NifAnswers outputs = answers.outputs();
  ASSERT_EQ(nifQuery(twins.gpu(), &asked, &outputs), NIF_OK) << nifGetErrorMessage();
  expect_same(answers, expected.answers);
  // In a stream, at an odd address, and as a job.
  std::vector<char> odd(4 * rays.size() + 1);
  std::memcpy(odd.data() + 1, each.values.data(), 4 * rays.size());
  each.put(asked, odd.data() + 1);
  asked.stream = machine().make_stream(gpu());
  std::fill(answers.logit.begin(), answers.logit.end(), 7);
  ASSERT_EQ(nifQuery(twins.gpu(), &asked, &outputs), NIF_OK) << nifGetErrorMessage();
  expect_same(answers, expected.answers);
  std::fill(answers.logit.begin(), answers.logit.end(), 7);
  launched = machine().rays_launched;
  NifJob job = nullptr;
  ASSERT_EQ(nifQueryAsync(twins.gpu(), &asked, &outputs, &job), NIF_OK) << nifGetErrorMessage();
  EXPECT_EQ(nifWaitJob(job), NIF_OK);
  nifReleaseJob(job);
  expect_same(answers, expected.answers);
  EXPECT_EQ(machine().rays_launched, launched + rays.size());
  machine().free_stream(asked.stream);
  asked.stream = nullptr;
  EXPECT_EQ(machine().pipelined, pipelined);

  const auto say_visible = [](void*, uint64_t count, const uint64_t*, uint8_t* visible) {
    std::fill_n(visible, count, uint8_t{1});
  };
  Answers by_fallback(rays.size());
  const NifAnswers wanted = by_fallback.outputs();
  ASSERT_EQ(nifQueryWithFallback(twins.gpu(), &asked, &outputs, 2, say_visible, nullptr), NIF_OK);
  ASSERT_EQ(nifQueryWithFallback(twins.cpu(), &asked, &wanted, 2, say_visible, nullptr), NIF_OK);
  EXPECT_EQ(answers, by_fallback);
  double seconds;
  EXPECT_EQ(nifMeasureQuery(twins.gpu(), &asked, &outputs, NIF_MEASURE_QUERY, 1, &seconds),
            NIF_ERROR_INVALID_ARGUMENT);
}

/// The GPU finishes what it has started.
TEST_P(GpuInstances, CancelledJobsGoOn) {
  TwinScenes twins(config());
  fill(twins, 30, 5);
  twins.commit();
  const std::vector<NifRay> rays = some_rays(31);
  GpuQuery asked(machine(), gpu(), rays);
  GpuHitQuery hits(machine(), gpu(), rays);
  asked.query.stream = hits.query.stream = machine().make_stream(gpu());
  NifJob jobs[2] = {};
  ASSERT_EQ(nifQueryAsync(twins.gpu(), &asked.query, &asked.outputs, &jobs[0]), NIF_OK);
  ASSERT_EQ(nifIntersectAsync(twins.gpu(), &hits.query, &hits.hits, &jobs[1]), NIF_OK);
  const uint32_t waits = machine().waits;
  for (NifJob job : jobs) {
    EXPECT_EQ(nifCancelJob(job), NIF_OK) << nifGetErrorMessage();
    uint32_t done = 7;
    EXPECT_EQ(nifIsJobDone(job, &done), NIF_OK);
    EXPECT_EQ(done, 0u);
  }
  EXPECT_EQ(machine().waits, waits);
  for (NifJob job : jobs) {
    EXPECT_EQ(nifWaitJob(job), NIF_OK) << nifGetErrorMessage();
    EXPECT_EQ(nifCancelJob(job), NIF_OK);
    EXPECT_EQ(nifWaitJob(job), NIF_OK);
    nifReleaseJob(job);
  }
  machine().free_stream(asked.query.stream);
  expect_same(asked.answers.get(), query_all(twins.cpu(), rays));
  EXPECT_EQ(count_different_hits(hits.get(), intersect_all(twins.cpu(), rays)), 0u);

  // In host memory it is answered before it can be cancelled.
  Answers answers(rays.size());
  const NifRays of_host = nifMakeRays(rays.data(), rays.size());
  const NifAnswers outputs = answers.outputs();
  NifJob job = nullptr;
  ASSERT_EQ(nifQueryAsync(twins.gpu(), &of_host, &outputs, &job), NIF_OK);
  EXPECT_EQ(nifCancelJob(job), NIF_OK);
  EXPECT_EQ(nifWaitJob(job), NIF_OK) << nifGetErrorMessage();
  nifReleaseJob(job);
  expect_same(answers, query_all(twins.cpu(), rays));
}

}  // namespace
}  // namespace nif::test
