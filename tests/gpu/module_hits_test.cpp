// nifIntersect in GPU memory gives the same bits in every output as on the CPU.
#include "formats/nif/reader.hpp"
#include "tests/gpu/gpu_hit_query.hpp"
#include "tests/runtime/open_answers.hpp"
#include "tests/support/row_of_voxels.hpp"

namespace nif::test {
namespace {

/// All encodings, with any number of features; and two features per corner, as the baker makes.
constexpr RandomAssetOptions kHitAssets{.objects = 2,
                                        .instances = 0,
                                        .bvhs = 2,
                                        .sphericals = 2,
                                        .exacts = 2,
                                        .proofs = 2,
                                        .cutouts = 1,
                                        .colors = 5,
                                        .sources = 3};
constexpr RandomAssetOptions kPairAssets{.objects = 2, .instances = 0, .features = 2};

class GpuFirstHits : public GpuModuleTest, public testing::WithParamInterface<uint32_t> {
 protected:
  uint32_t gpu() const { return GetParam(); }

  /// Returns how many rays hit something.
  size_t expect_twins(const TwinScenes& twins, const std::vector<NifRay>& rays) {
    const FirstHits expected = intersect_all(twins.cpu(), rays);
    const FirstHits got = intersect_on_gpu(machine(), gpu(), twins.gpu(), rays);
    EXPECT_EQ(count_different_hits(got, expected), 0u);
    return size_t(std::count(expected.hit.begin(), expected.hit.end(), 1));
  }
};
// Waves of 32 lanes and of 64.
INSTANTIATE_TEST_SUITE_P(Each, GpuFirstHits, testing::Values(0u, 2u),
                         [](const auto& p) { return std::string(name_of(kMatrixKinds[p.param])); });

TEST_P(GpuFirstHits, OfOneInstanceAreThoseOfTheCpu) {
  for (const RandomAssetOptions& options : {kHitAssets, kPairAssets})
    for (uint64_t seed = 0; seed < 3; ++seed) {
      const std::vector<std::byte> file = format::encode(random_asset(seed, options));
      const format::AssetView view = format::read_asset(file, "test");
      const std::vector<NifRay> rays = rays_near(view, seed, 1501);
      size_t met = 0;
      for (uint32_t object = 0; object < view.objects.size(); ++object)
        for (const bool moved : {false, true}) {
          machine().order = object;
          TwinScenes twins(config(gpu()));
          Matrix transform = kIdentity;
          if (moved) transform = {0.9f, 0.1f, 0, 0.1f, 0, -1.1f, 0.2f, 0, 0.1f, 0, 1, -0.1f};
          twins.add(twins.load(file), object, transform);
          twins.commit();
          met += expect_twins(twins, rays);
        }
      EXPECT_GT(met, 100 * view.objects.size());
    }
}

/// Rays with more open cells than the reference keeps: then the last one replaces some.
TEST_P(GpuFirstHits, OfManyOpenCells) {
  size_t first = 0, between = 0, last = 0;
  for (uint64_t seed = 0; seed < 12; ++seed) {
    const std::vector<std::byte> file = format::encode(asset_of_a_row(seed));
    const format::AssetView view = format::read_asset(file, "test");
    const kernels::SegmentField& field = view.objects[0].as<kernels::SegmentField>();
    Random random(seed);
    const std::vector<NifRay> rays = rays_in_a_row(random, field, 500);
    TwinScenes twins(config(gpu()));
    twins.add(twins.load(file), 0, kIdentity);
    twins.commit();
    expect_twins(twins, rays);

    const FirstHits hits = intersect_all(twins.cpu(), rays);
    for (size_t i = 0; i < rays.size(); ++i) {
      kernels::TraversalResult traversal;
      kernels::OpenCells open;
      kernels::follow_segment<true>(field, to_segment(rays[i]), traversal, kernels::KeepCells{open},
                                    kernels::NoVisit());
      if (traversal.interval_count <= kernels::OpenCells::kRoom || !hits.hit[i]) continue;
      const bool in_first =
          hits.t[i]<open.cells[1].enter, in_last = hits.t[i]> open.cells[kernels::OpenCells::kRoom - 2].leave;
      ++(in_first ? first : in_last ? last : between);
    }
  }
  EXPECT_GT(first, 100u);
  EXPECT_GT(between, 50u);
  EXPECT_GT(last, 100u);
}

/// Any transforms: mirrored, stretched, skewed, overlapping, two in the same position.
TEST_P(GpuFirstHits, OfMixedScenesAreThoseOfTheCpu) {
  size_t met = 0;
  for (uint64_t seed = 0; seed < 3; ++seed)
    for (const size_t count : {size_t{2}, size_t{9}, size_t{40}}) {
      machine().order = seed;
      Random random(seed);
      TwinScenes twins(config(gpu()));
      const std::vector<std::byte> file = format::encode(random_asset(seed, kHitAssets));
      const format::AssetView view = format::read_asset(file, "test");
      const uint32_t all = twins.load(file), pairs = twins.load(random_asset(seed, kPairAssets));
      for (size_t i = 0; i < count; ++i) {
        const bool any = random.below(4) != 0;
        const uint32_t object = random.below(any ? uint32_t(view.objects.size()) : 2);
        const Matrix transform = random_transform(random, 2);
        twins.add(any ? all : pairs, object, transform);
        if (i == 0) twins.add(any ? all : pairs, object, transform);
      }
      twins.commit();
      met += expect_twins(twins, rays_near(view, seed, 3001));
      met += expect_twins(twins, rays_in_cube(random, 3, 3000));
    }
  EXPECT_GT(met, 10'000u);
}

/// Instances about which nothing is proven, because their transforms are too skewed.
TEST_P(GpuFirstHits, OfSkewedInstances) {
  const std::vector<std::byte> file = format::encode(random_asset(4, kHitAssets));
  const format::AssetView view = format::read_asset(file, "test");
  TwinScenes alone(config(gpu())), several(config(gpu()));
  const uint32_t one = alone.load(file), asset = several.load(file);
  const Matrix skewed{1, 0, 0, 0, 0, 1, 0, 0, 0, 0.9f, 1e-4f, 0};
  alone.add(one, 2, skewed);
  for (uint32_t object = 0; object < view.objects.size(); ++object) {
    several.add(asset, object, kIdentity);
    several.add(asset, object, skewed);
  }
  alone.commit();
  several.commit();
  const std::vector<NifRay> rays = rays_near(view, 4, 3000);
  expect_twins(alone, rays);
  EXPECT_GT(expect_twins(several, rays), 500u);
}

TEST_P(GpuFirstHits, OfAnEmptySceneAndOfNoRays) {
  TwinScenes empty(config(gpu()));
  empty.commit();
  Random random(1);
  EXPECT_EQ(expect_twins(empty, rays_in_cube(random, 5, 300)), 0u);
  const uint32_t launches = machine().launches;
  EXPECT_EQ(expect_twins(empty, {}), 0u);
  EXPECT_EQ(machine().launches, launches);
}

TEST_P(GpuFirstHits, OfBatchesOfAnySize) {
  TwinScenes twins(config(gpu()));
  const std::vector<std::byte> file = format::encode(random_asset(6, kHitAssets));
  const format::AssetView view = format::read_asset(file, "test");
  const uint32_t asset = twins.load(file);
  for (uint32_t object = 0; object < view.objects.size(); ++object) twins.add(asset, object, kIdentity);
  twins.commit();
  for (const size_t count : {1, 2, 31, 32, 33, 63, 64, 65, 127, 128, 129, 191, 193, 1000})
    expect_twins(twins, rays_near(view, count, count));
}

/// Splitting into launches does not change answers.
TEST_P(GpuFirstHits, GoOnFromLaunchToLaunch) {
  machine().most_rays = 1000;
  TwinScenes twins(config(gpu()));
  const std::vector<std::byte> file = format::encode(random_asset(5, kHitAssets));
  const format::AssetView view = format::read_asset(file, "test");
  const uint32_t asset = twins.load(file);
  for (uint32_t object = 0; object < view.objects.size(); ++object) twins.add(asset, object, kIdentity);
  twins.commit();
  const uint32_t launches = machine().launches;
  EXPECT_GT(expect_twins(twins, rays_near(view, 5, 4321)), 1000u);
  EXPECT_EQ(machine().launches - launches, 5u);
}

/// 2^32 + 1 rays: enough launches are put into the stream. They are not run here.
TEST_P(GpuFirstHits, OfMoreRaysThan32BitsCount) {
  TwinScenes twins(config(gpu()));
  twins.add(twins.load(random_asset(9, {.objects = 1})), 0, kIdentity);
  twins.commit();
  machine().most_rays = 1u << 30;
  GpuHitQuery asked(machine(), gpu(), std::vector<NifRay>(1));
  asked.query.count = (uint64_t{1} << 32) + 1;
  asked.query.origin_stride = asked.query.direction_stride = 0;
  asked.query.tmin_stride = asked.query.tmax_stride = 0;
  const uint32_t launches = machine().launches;
  const uint64_t rays = machine().rays_launched;
  machine().discard = true;
  EXPECT_EQ(nifIntersect(twins.gpu(), &asked.query, &asked.hits), NIF_OK) << nifGetErrorMessage();
  EXPECT_EQ(machine().launches - launches, 5u);
  EXPECT_EQ(machine().rays_launched - rays, asked.query.count);
  machine().discard = false;
}

/// Any layout of the rays, and any outputs: outputs that are not requested are not written, and the others do
/// not change.
TEST_P(GpuFirstHits, LayoutsAndOutputs) {
  TwinScenes twins(config(gpu()));
  const std::vector<std::byte> file = format::encode(random_asset(7, kHitAssets));
  const format::AssetView view = format::read_asset(file, "test");
  const uint32_t asset = twins.load(file);
  for (uint32_t object = 0; object < view.objects.size(); ++object)
    twins.add(asset, object, {0.8f, 0, 0.1f, 0, 0, 0.9f, 0, 0.05f * float(object), 0, 0, -1, 0});
  twins.commit();
  constexpr size_t kCount = 333;
  std::vector<NifRay> rays = rays_near(view, 7, kCount);
  for (NifRay& ray : rays) ray.tmin = 0.125f;  // one for all
  const FirstHits expected = intersect_all(twins.cpu(), rays);

  // Columns, one after the other, at an odd address.
  std::vector<float> columns;
  for (int a = 0; a < 3; ++a)
    for (const NifRay& ray : rays) columns.push_back(ray.origin[a]);
  for (int a = 0; a < 3; ++a)
    for (const NifRay& ray : rays) columns.push_back(ray.direction[a]);
  for (const NifRay& ray : rays) columns.push_back(ray.tmax);
  columns.push_back(0.125f);
  std::vector<char> odd(4 * columns.size() + 1);
  std::memcpy(odd.data() + 1, columns.data(), 4 * columns.size());
  const GpuArray memory(machine(), gpu(), odd.data(), odd.size());
  const auto column = [&](size_t i) {
    return reinterpret_cast<const float*>(memory.as<char>() + 1 + 4 * kCount * i);
  };

  Random random(7);
  for (uint32_t trial = 0; trial < 40; ++trial) {
    GpuHitQuery asked(machine(), gpu(), rays);
    if (trial % 2 == 1) {
      for (size_t a = 0; a < 3; ++a) {
        asked.query.origin[a] = column(a);
        asked.query.direction[a] = column(3 + a);
      }
      asked.query.tmax = column(6);
      asked.query.tmin = column(7);
      asked.query.origin_stride = asked.query.direction_stride = asked.query.tmax_stride = 4;
      asked.query.tmin_stride = 0;
    }
    // At first each output alone.
    const NifHits everything = asked.hits;
    uint32_t wanted = trial < 22 ? 1u << trial / 2 : random.below(2047) + 1;
    const auto keep = [&](auto*& member) {
      if ((wanted & 1) == 0) member = nullptr;
      wanted >>= 1;
    };
    NifHits& hits = asked.hits;
    keep(hits.hit), keep(hits.certain), keep(hits.t), keep(hits.t_low), keep(hits.t_high), keep(hits.normal);
    keep(hits.u), keep(hits.v), keep(hits.instance), keep(hits.object), keep(hits.triangle);
    ASSERT_EQ(nifIntersect(twins.gpu(), &asked.query, &hits), NIF_OK) << nifGetErrorMessage();
    NifJob job = nullptr;  // of the same stream, and behind it
    const GpuHitQuery behind(machine(), gpu(), rays);
    ASSERT_EQ(nifIntersectAsync(twins.gpu(), &behind.query, &behind.hits, &job), NIF_OK);
    ASSERT_EQ(nifWaitJob(job), NIF_OK);
    nifReleaseJob(job);

    const NifHits asked_for = asked.hits;
    asked.hits = everything;
    const FirstHits got = asked.get();
    const auto check = [&](const void* member, const auto& array, const auto& same) {
      const size_t bytes = array.size() * sizeof(array[0]);
      if (member)
        EXPECT_EQ(std::memcmp(array.data(), same.data(), bytes), 0);
      else
        EXPECT_EQ(std::vector<uint8_t>(bytes, 0xa5),
                  std::vector<uint8_t>(reinterpret_cast<const uint8_t*>(array.data()),
                                       reinterpret_cast<const uint8_t*>(array.data()) + bytes));
    };
    check(asked_for.hit, got.hit, expected.hit);
    check(asked_for.certain, got.certain, expected.certain);
    check(asked_for.t, got.t, expected.t);
    check(asked_for.t_low, got.low, expected.low);
    check(asked_for.t_high, got.high, expected.high);
    check(asked_for.normal, got.normal, expected.normal);
    check(asked_for.u, got.u, expected.u);
    check(asked_for.v, got.v, expected.v);
    check(asked_for.instance, got.instance, expected.instance);
    check(asked_for.object, got.object, expected.object);
    check(asked_for.triangle, got.triangle, expected.triangle);
  }
}

/// A job is done when the stream has executed it, and nothing waits before that.
TEST_P(GpuFirstHits, Jobs) {
  TwinScenes twins(config(gpu()));
  const std::vector<std::byte> file = format::encode(random_asset(8, kHitAssets));
  const format::AssetView view = format::read_asset(file, "test");
  twins.add(twins.load(file), 2, kIdentity);
  twins.commit();
  const std::vector<NifRay> rays = rays_near(view, 8, 2000);
  const FirstHits expected = intersect_all(twins.cpu(), rays);
  GpuHitQuery asked(machine(), gpu(), rays);
  void* stream = asked.query.stream = machine().make_stream(gpu());
  const uint32_t waits = machine().waits;
  NifJob job = nullptr;
  ASSERT_EQ(nifIntersectAsync(twins.gpu(), &asked.query, &asked.hits, &job), NIF_OK) << nifGetErrorMessage();
  EXPECT_EQ(machine().waits, waits);
  EXPECT_EQ(asked.hits.hit[0], 0xa5);
  uint32_t done = 7;
  ASSERT_EQ(nifIsJobDone(job, &done), NIF_OK);
  EXPECT_EQ(done, 0u);
  ASSERT_EQ(nifWaitJob(job), NIF_OK);
  ASSERT_EQ(nifIsJobDone(job, &done), NIF_OK);
  EXPECT_EQ(done, 1u);
  nifReleaseJob(job);
  EXPECT_EQ(count_different_hits(asked.get(), expected), 0u);

  // A commit waits for the scene's earlier queries.
  GpuHitQuery later(machine(), gpu(), rays);
  later.query.stream = stream;
  ASSERT_EQ(nifIntersect(twins.gpu(), &later.query, &later.hits), NIF_OK);
  twins.move(0, {1, 0, 0, 100, 0, 1, 0, 0, 0, 0, 1, 0});
  twins.commit();
  EXPECT_EQ(count_different_hits(later.get(), expected), 0u);
  machine().free_stream(stream);
}

TEST_F(GpuModuleTest, FirstHitsOfHostMemoryAreFoundByTheCpu) {
  const std::vector<std::byte> file = format::encode(random_asset(3, kHitAssets));
  TwinScenes twins(config());
  twins.add(twins.load(file), 0, kIdentity);
  twins.commit();
  const std::vector<NifRay> rays = rays_near(format::read_asset(file, "test"), 3, 3000);
  const uint32_t launches = machine().launches;
  const FirstHits expected = intersect_all(twins.cpu(), rays);
  EXPECT_EQ(count_different_hits(intersect_all(twins.gpu(), rays), expected), 0u);
  FirstHits later(rays.size());
  const NifRays query = nifMakeRays(rays.data(), rays.size());
  const NifHits outputs = later.outputs();
  NifJob job = nullptr;
  ASSERT_EQ(nifIntersectAsync(twins.gpu(), &query, &outputs, &job), NIF_OK);
  ASSERT_EQ(nifWaitJob(job), NIF_OK);
  nifReleaseJob(job);
  EXPECT_EQ(count_different_hits(later, expected), 0u);
  EXPECT_EQ(machine().launches, launches);
}

TEST_F(GpuModuleTest, FirstHitsOfWrongArgumentsAreRefused) {
  TwinScenes twins(config());
  const std::vector<std::byte> file = format::encode(random_asset(3, kHitAssets));
  twins.add(twins.load(file), 0, kIdentity);
  twins.commit();
  const std::vector<NifRay> rays = rays_near(format::read_asset(file, "test"), 3, 100);
  const GpuHitQuery good(machine(), 0, rays);
  const auto refused = [&](NifError error, const NifRays& query, const NifHits& hits,
                           const char* because = "") {
    EXPECT_EQ(nifIntersect(twins.gpu(), &query, &hits), error) << nifGetErrorMessage();
    EXPECT_NE(std::string(nifGetErrorMessage()).find(because), std::string::npos) << nifGetErrorMessage();
    NifJob job = nullptr;
    EXPECT_EQ(nifIntersectAsync(twins.gpu(), &query, &hits, &job), error) << nifGetErrorMessage();
    EXPECT_EQ(job, nullptr);
  };
  const uint32_t launches = machine().launches;

  FirstHits here(rays.size());
  const NifHits outputs = here.outputs();
  const auto refuse_of_host = [&](auto NifHits::*member, const char* name) {
    NifHits hits = good.hits;
    hits.*member = outputs.*member;
    refused(NIF_ERROR_WRONG_POINTER, good.query, hits, name);
  };
  refuse_of_host(&NifHits::hit, "hits: hit is memory of the host");
  refuse_of_host(&NifHits::t, "hits: t is memory of the host");
  refuse_of_host(&NifHits::normal, "hits: normal is");
  refuse_of_host(&NifHits::instance, "hits: instance is");
  refuse_of_host(&NifHits::object, "hits: object is");
  refuse_of_host(&NifHits::triangle, "hits: triangle is");
  refuse_of_host(&NifHits::u, "hits: u is");
  refuse_of_host(&NifHits::v, "hits: v is");
  refuse_of_host(&NifHits::certain, "hits: certain is");
  refuse_of_host(&NifHits::t_low, "hits: t_low is");
  refuse_of_host(&NifHits::t_high, "hits: t_high is");
  refuse_of_host(&NifHits::color, "hits: color is");
  const GpuArray elsewhere(machine(), 1, nullptr, 1200);
  NifHits hits = good.hits;
  hits.normal = elsewhere.as<float>();
  refused(NIF_ERROR_WRONG_POINTER, good.query, hits, "hits: normal is memory of another GPU");
  hits = nifkit::sized<NifHits>();
  refused(NIF_ERROR_INVALID_ARGUMENT, good.query, hits, "all outputs are null");

  NifRays query = good.query;
  query.tmin = &rays[0].tmin;
  refused(NIF_ERROR_WRONG_POINTER, query, good.hits, "rays: tmin");
  query = nifMakeRays(rays.data(), rays.size());
  query.stream = machine().make_stream(0);
  refused(NIF_ERROR_NOT_AVAILABLE, query, outputs, "host memory");
  machine().free_stream(query.stream);
  query = good.query;
  query.stream = machine().make_stream(1);
  refused(NIF_ERROR_INVALID_ARGUMENT, query, good.hits, "stream");
  machine().free_stream(query.stream);
  EXPECT_EQ(machine().launches, launches);

  query.stream = machine().make_stream(0);
  machine().fail_launch = 1;
  refused(NIF_ERROR_DEVICE_LOST, query, good.hits);
  machine().free_stream(query.stream);
  machine().lost = false;
  // The CPU still finds those in host memory.
  EXPECT_EQ(count_different_hits(intersect_all(twins.gpu(), rays), intersect_all(twins.cpu(), rays)), 0u);
}

}  // namespace
}  // namespace nif::test
