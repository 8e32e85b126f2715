// The GPU module gives the CPU's answers: by the same calls of nif.h, with kernels that the emulator runs.
#include "kernels/gpu/planes/skipping_traversal.hpp"
#include "tests/gpu/module_fixture.hpp"

namespace nif::test {
namespace {

/// A GPU, and the kernels that it uses.
struct Way {
  uint32_t gpu;
  const char* pipeline;
};
/// Each kind of matrix instruction; the one kernel, in waves of 32 and of 64 lanes; and the faster way.
constexpr Way kWays[] = {{0, "on"}, {1, "on"},  {2, "on"},  {3, "on"},  {4, "on"},
                         {5, "on"}, {0, "off"}, {2, "off"}, {0, "auto"}};

class GpuAnswers : public GpuModuleTest, public testing::WithParamInterface<Way> {
 protected:
  uint32_t gpu() const { return GetParam().gpu; }
  bool by_one_kernel() const { return std::string_view(GetParam().pipeline) == "off"; }
  std::string config() const { return GpuModuleTest::config(gpu()) + ",pipeline=" + GetParam().pipeline; }

  /// In host memory, and in GPU memory.
  void expect_twins(const TwinScenes& twins, const std::vector<NifRay>& rays) {
    const Answers expected = query_all(twins.cpu(), rays);
    expect_same(query_all(twins.gpu(), rays), expected);
    GpuQuery on_gpu(machine(), gpu(), rays);
    void* stream = on_gpu.query.stream = machine().make_stream(gpu());
    ASSERT_EQ(nifQuery(twins.gpu(), &on_gpu.query, &on_gpu.outputs), NIF_OK) << nifGetErrorMessage();
    machine().wait_stream(stream);
    machine().free_stream(stream);
    expect_same(on_gpu.answers.get(), expected);
  }
};
INSTANTIATE_TEST_SUITE_P(EachWay, GpuAnswers, testing::ValuesIn(kWays), [](const auto& p) {
  return std::string(name_of(kMatrixKinds[p.param.gpu])) + "_" + p.param.pipeline;
});

TEST_P(GpuAnswers, ScenesOfAllEncodings) {
  Random random(1);
  for (uint64_t seed = 0; seed < 6; ++seed) {
    machine().order = seed;
    TwinScenes twins(config());
    const uint32_t mixed = twins.load(random_asset(seed, {.objects = 2,
                                                          .bvhs = 2,
                                                          .sphericals = 2,
                                                          .exacts = 2,
                                                          .proofs = 2,
                                                          .cutouts = 1,
                                                          .features = seed % 2 ? 2u : 0u}));
    const uint32_t other = twins.load(random_asset(seed + 100, {.objects = 1, .max_voxels = 30}));
    for (uint32_t i = 0; i < 12 + seed * 5; ++i) {
      const bool from_other = random.below(4) == 0;
      twins.add(from_other ? other : mixed, from_other ? 0 : random.below(twins.objects(mixed)),
                random_transform(random, 8));
    }
    twins.commit();
    expect_twins(twins, rays_in_cube(random, 12, 3000 + seed));
  }
}

/// Scenes of one kind of objects have their own kernels.
TEST_P(GpuAnswers, ScenesOfOneEncoding) {
  Random random(2);
  for (const RandomAssetOptions& options :
       {RandomAssetOptions{.objects = 2, .features = 2}, RandomAssetOptions{.objects = 0, .bvhs = 2},
        RandomAssetOptions{.objects = 0, .sphericals = 2}, RandomAssetOptions{.objects = 0, .exacts = 2},
        RandomAssetOptions{.objects = 0, .proofs = 2, .cutouts = 1}}) {
    TwinScenes twins(config());
    const uint32_t asset = twins.load(random_asset(7, options));
    for (uint32_t i = 0; i < 9; ++i)
      twins.add(asset, random.below(twins.objects(asset)), random_transform(random, 6));
    twins.commit();
    expect_twins(twins, rays_in_cube(random, 9, 3000));
  }
}

/// A sole instance is queried with every ray; without a transform it takes rays as they are.
TEST_P(GpuAnswers, ScenesOfOneInstance) {
  Random random(3);
  const format::Asset asset =
      random_asset(3, {.objects = 1, .bvhs = 1, .sphericals = 1, .exacts = 1, .proofs = 1, .cutouts = 1});
  for (uint32_t object = 0; object < asset.objects.size(); ++object)
    for (const bool identity : {true, false}) {
      TwinScenes twins(config());
      twins.add(twins.load(asset), object, identity ? kIdentity : random_transform(random, 4));
      twins.commit();
      expect_twins(twins, rays_in_cube(random, 6, 2000));
    }
}

/// Through a transform with an imprecise inverse nothing is certain, and the outputs say so.
TEST_P(GpuAnswers, SkewedInstances) {
  Random random(15);
  TwinScenes twins(config());
  const uint32_t asset = twins.load(random_asset(15, {.objects = 1, .bvhs = 1}));
  for (uint32_t i = 0; i < 4; ++i) {
    Matrix stretched = kIdentity;
    stretched[5 * (i % 3)] = 3e4f;
    stretched[3] = static_cast<float>(i);
    twins.add(asset, i % 2, stretched);
  }
  twins.commit();
  const std::vector<NifRay> rays = rays_in_cube(random, 6, 3000);
  expect_twins(twins, rays);
  const Answers answers = query_all(twins.gpu(), rays);
  EXPECT_GT(std::count(answers.certain.begin(), answers.certain.end(), 0), 100);
}

TEST_P(GpuAnswers, EmptyScenes) {
  TwinScenes twins(config());
  twins.commit();
  Random random(4);
  expect_twins(twins, rays_in_cube(random, 3, 500));
}

TEST_P(GpuAnswers, BatchesOfAnySize) {
  Random random(5);
  TwinScenes twins(config());
  const uint32_t asset = twins.load(random_asset(5, {.objects = 1, .bvhs = 1}));
  for (uint32_t i = 0; i < 4; ++i) twins.add(asset, i % 2, random_transform(random, 3));
  twins.commit();
  for (const size_t count : {1u, 2u, 7u, 8u, 9u, 31u, 32u, 33u, 63u, 64u, 65u, 127u, 500u})
    expect_twins(twins, rays_in_cube(random, 5, count));
}

/// Networks too wide for a full block's shared memory.
TEST_P(GpuAnswers, TheWidestNetworks) {
  Random random(6);
  format::Asset asset;
  asset.objects.push_back(random_spherical_object(random, "wide", 8));
  const format::SphericalGrids grids = asset.objects[0].spherical->grids;
  for (const uint32_t width : {96u, 100u, kernels::kMaxSphericalWidth}) {
    asset.spherical_networks = {random_networks(random, grids, 4)};
    for (format::SphericalLayers* layers :
         {&asset.spherical_networks[0].outer, &asset.spherical_networks[0].inner}) {
      layers->width = width;
      layers->weights = random_halves(
          random, kernels::spherical_weights(layers->inputs, width, layers->hidden_layers), 0.2f);
    }
    TwinScenes twins(config());
    twins.add(twins.load(asset), 0, random_transform(random, 3));
    twins.commit();
    expect_twins(twins, rays_in_cube(random, 5, 300));
  }
}

/// Any layout of the inputs, any outputs.
TEST_P(GpuAnswers, LayoutsAndOutputs) {
  Random random(8);
  TwinScenes twins(config());
  const uint32_t asset = twins.load(random_asset(8, {.objects = 2, .bvhs = 1}));
  for (uint32_t i = 0; i < 5; ++i) twins.add(asset, i % 3, random_transform(random, 4));
  twins.commit();
  constexpr size_t kCount = 333;
  const std::vector<NifRay> rays = rays_in_cube(random, 6, kCount);
  for (uint32_t which = 1; which < 64; ++which) {
    // Misaligned floats; aligned floats, with or without gaps between rays.
    const size_t offset = which % 3 == 0 ? 1 : 4, stride = which % 3 == 0 ? 45 : which % 3 == 1 ? 48 : 32;
    std::vector<char> packed(kCount * stride + offset);
    for (size_t i = 0; i < kCount; ++i)
      std::memcpy(packed.data() + offset + i * stride, &rays[i], sizeof(NifRay));
    const GpuArray on_gpu(machine(), gpu(), packed.data(), packed.size());
    // Bit 5: no tmin and tmax, and one direction for all.
    const auto describe = [&](const char* start) {
      const auto* ray = reinterpret_cast<const NifRay*>(start + offset);
      NifRays query = nifMakeRays(ray, kCount);
      query.origin_stride = query.direction_stride = query.tmin_stride = query.tmax_stride = stride;
      if (which & 32) query.tmin = query.tmax = nullptr, query.direction_stride = 0;
      return query;
    };
    const auto choose = [&](NifAnswers outputs) {
      if (!(which & 1)) outputs.visible = nullptr;
      if (!(which & 2)) outputs.visible_bits = nullptr;
      if (!(which & 4)) outputs.certain = nullptr;
      if (!(which & 8)) outputs.probability = nullptr;
      if (!(which & 16)) outputs.logit = nullptr;
      return outputs;
    };
    if ((which & 31) == 0) continue;
    Answers expected(kCount), got(kCount);
    NifRays query = describe(packed.data());
    NifAnswers outputs = choose(expected.outputs());
    ASSERT_EQ(nifQuery(twins.cpu(), &query, &outputs), NIF_OK);
    outputs = choose(got.outputs());
    ASSERT_EQ(nifQuery(twins.gpu(), &query, &outputs), NIF_OK) << nifGetErrorMessage();
    expect_same(got, expected);

    query = describe(on_gpu.as<char>());
    const GpuAnswerArrays answers(machine(), gpu(), kCount);
    outputs = choose(answers.outputs());
    query.memory = NIF_MEMORY_DEVICE;
    query.stream = machine().make_stream(gpu());
    ASSERT_EQ(nifQuery(twins.gpu(), &query, &outputs), NIF_OK) << nifGetErrorMessage();
    machine().wait_stream(query.stream);
    machine().free_stream(query.stream);
    const Answers there = answers.get();
    if (outputs.visible) {
      EXPECT_EQ(there.visible, expected.visible);
    }
    if (outputs.visible_bits) {
      EXPECT_EQ(there.bits, expected.bits);
    }
    if (outputs.certain) {
      EXPECT_EQ(there.certain, expected.certain);
    }
    if (outputs.logit) {
      EXPECT_EQ(there.logit, expected.logit);
    }
    if (!outputs.visible) {
      EXPECT_EQ(there.visible, std::vector<uint8_t>(kCount, 0xa5)) << "not asked for";
    }
  }
}

/// More rays than one launch takes are split, which does not change answers.
TEST_P(GpuAnswers, QueriesAreCutIntoLaunches) {
  Random random(9);
  TwinScenes twins(config());
  const uint32_t asset = twins.load(random_asset(9, {.objects = 2}));
  for (uint32_t i = 0; i < 5; ++i) twins.add(asset, i % 2, random_transform(random, 4));
  twins.commit();
  const std::vector<NifRay> rays = rays_in_cube(random, 6, 1001);
  const Answers expected = query_all(twins.cpu(), rays);
  machine().most_rays = 104;
  GpuQuery on_gpu(machine(), gpu(), rays);
  on_gpu.query.stream = machine().make_stream(gpu());
  const uint32_t before = machine().launches;
  ASSERT_EQ(nifQuery(twins.gpu(), &on_gpu.query, &on_gpu.outputs), NIF_OK) << nifGetErrorMessage();
  if (by_one_kernel()) {
    EXPECT_EQ(machine().launches - before, 10u);
  }
  machine().wait_stream(on_gpu.query.stream);
  machine().free_stream(on_gpu.query.stream);
  expect_same(on_gpu.answers.get(), expected);
}

/// 2^32 + 1 rays: enough launches are put into the stream. They are not run here.
TEST_P(GpuAnswers, QueriesMayHaveMoreRaysThan32BitsCount) {
  TwinScenes twins(config());
  twins.add(twins.load(random_asset(9, {.objects = 1})), 0, kIdentity);
  twins.commit();
  machine().most_rays = 1u << 30;
  GpuQuery on_gpu(machine(), gpu(), std::vector<NifRay>(1));
  on_gpu.query.count = (uint64_t{1} << 32) + 1;
  on_gpu.query.origin_stride = on_gpu.query.direction_stride = 0;
  on_gpu.query.tmin_stride = on_gpu.query.tmax_stride = 0;
  const uint32_t before = machine().launches;
  const uint64_t rays = machine().rays_launched;
  machine().discard = true;
  ASSERT_EQ(nifQuery(twins.gpu(), &on_gpu.query, &on_gpu.outputs), NIF_OK) << nifGetErrorMessage();
  if (by_one_kernel()) {
    EXPECT_EQ(machine().launches - before, 5u);
  }
  EXPECT_EQ(machine().rays_launched - rays, on_gpu.query.count);
  machine().discard = false;
}

/// A query in device memory does not wait; several streams proceed independently.
TEST_P(GpuAnswers, NeverWaitsImplicitly) {
  Random random(10);
  TwinScenes twins(config());
  const uint32_t asset = twins.load(random_asset(10, {.objects = 2, .bvhs = 1}));
  for (uint32_t i = 0; i < 6; ++i) twins.add(asset, i % 3, random_transform(random, 4));
  twins.commit();
  const std::vector<NifRay> rays[] = {rays_in_cube(random, 6, 400), rays_in_cube(random, 6, 300),
                                      rays_in_cube(random, 6, 200)};
  GpuQuery first(machine(), gpu(), rays[0]), second(machine(), gpu(), rays[1]),
      third(machine(), gpu(), rays[2]);
  first.query.stream = machine().make_stream(gpu());
  second.query.stream = third.query.stream = machine().make_stream(gpu());
  const uint32_t waits = machine().waits, uploads = machine().uploads;
  for (GpuQuery* one : {&first, &second, &third})
    ASSERT_EQ(nifQuery(twins.gpu(), &one->query, &one->outputs), NIF_OK) << nifGetErrorMessage();
  EXPECT_EQ(machine().waits, waits);
  EXPECT_EQ(machine().uploads, uploads);
  EXPECT_TRUE(first.answers.untouched() && second.answers.untouched() && third.answers.untouched());
  machine().wait_stream(second.query.stream);
  EXPECT_TRUE(first.answers.untouched());
  expect_same(second.answers.get(), query_all(twins.cpu(), rays[1]));
  expect_same(third.answers.get(), query_all(twins.cpu(), rays[2]));

  // A commit waits for the scene's running queries: they are about the old scene.
  const Answers expected = query_all(twins.cpu(), rays[0]);
  for (uint32_t i = 0; i < 6; ++i) twins.move(i, random_transform(random, 4));
  EXPECT_TRUE(first.answers.untouched());
  twins.commit();
  EXPECT_FALSE(first.answers.untouched());
  expect_same(first.answers.get(), expected);
  expect_twins(twins, rays[0]);
  machine().free_stream(first.query.stream);
  machine().free_stream(second.query.stream);
}

/// An asset is uploaded once, with the first commit, and is freed on the GPU with its last reference.
TEST_P(GpuAnswers, AssetsAreUploadedOnce) {
  nifkit::Device device(config());
  const auto file = format::encode(random_asset(11, {.objects = 2, .bvhs = 1, .sphericals = 1, .exacts = 1}));
  nifkit::Asset asset = nifkit::Asset::load(device, file);
  EXPECT_EQ(asset.info().gpu_bytes, 0u);
  const uint32_t uploads = machine().uploads;
  EXPECT_EQ(machine().allocations, 0u);
  {
    nifkit::Scene first(device), second(device);
    for (nifkit::Scene* scene : {&first, &second}) {
      scene->add_asset(asset);
      scene->commit();
    }
    EXPECT_EQ(machine().allocations, 3u) << "the asset and two scenes";
    uint64_t words = 0;  // for empty-space skipping
    const format::AssetView view = format::read_asset(file, "test");
    for (const format::ObjectView& object : view.objects)
      if (object.is<kernels::SegmentField>()) {
        const kernels::SegmentField& field = object.as<kernels::SegmentField>();
        words += uint64_t{field.voxels[0]} * field.voxels[1] * field.voxels[2] + field.child_count;
      }
    const uint64_t bytes = asset.info().gpu_bytes;
    EXPECT_GT(bytes, sizeof(uint32_t) * words + 1000u);
    EXPECT_LT(bytes, sizeof(uint32_t) * words + 2 * asset.info().file_bytes);
    EXPECT_GT(machine().allocated, bytes);
    first.commit();  // nothing has changed
    EXPECT_EQ(machine().uploads - uploads, 3u);
  }
  EXPECT_EQ(machine().allocations, 1u);
  asset = nifkit::Asset();
  EXPECT_EQ(machine().allocations, 0u);
}

/// Networks that objects share are on the GPU only once.
TEST_P(GpuAnswers, WhatObjectsShareIsUploadedOnce) {
  Random random(16);
  format::Asset asset;
  for (int i = 0; i < 4; ++i) asset.objects.push_back(random_spherical_object(random, "it", 4));
  for (format::Object& object : asset.objects) object.spherical->grids = asset.objects[0].spherical->grids;
  asset.spherical_networks = {random_networks(random, asset.objects[0].spherical->grids, 4)};
  format::SphericalLayers& outer = asset.spherical_networks[0].outer;
  outer.width = kernels::kMaxSphericalWidth;
  outer.hidden_layers = 2;
  outer.weights = random_halves(random, kernels::spherical_weights(outer.inputs, outer.width, 2), 0.1f);
  const auto file = format::encode(asset);
  const nifkit::Device device(config());
  const nifkit::Asset loaded = nifkit::Asset::load(device, file);
  nifkit::Scene scene(device);
  scene.add_asset(loaded);
  scene.commit();
  EXPECT_GT(loaded.info().gpu_bytes, 2 * outer.weights.size());
  EXPECT_LT(loaded.info().gpu_bytes, file.size() + 8192);
}

TEST_P(GpuAnswers, Jobs) {
  Random random(12);
  TwinScenes twins(config());
  const uint32_t asset = twins.load(random_asset(12, {.objects = 2}));
  for (uint32_t i = 0; i < 4; ++i) twins.add(asset, i % 2, random_transform(random, 4));
  twins.commit();
  const std::vector<NifRay> rays = rays_in_cube(random, 6, 300);
  const Answers expected = query_all(twins.cpu(), rays);

  // In device memory: done when the stream is; polled, waited for, or released.
  void* stream = machine().make_stream(gpu());
  GpuQuery polled(machine(), gpu(), rays), awaited(machine(), gpu(), rays), dropped(machine(), gpu(), rays);
  NifJob jobs[3] = {};
  GpuQuery* queries[] = {&polled, &awaited, &dropped};
  for (int i = 0; i < 3; ++i) {
    queries[i]->query.stream = stream;
    ASSERT_EQ(nifQueryAsync(twins.gpu(), &queries[i]->query, &queries[i]->outputs, &jobs[i]), NIF_OK)
        << nifGetErrorMessage();
  }
  uint32_t done = 7;
  ASSERT_EQ(nifIsJobDone(jobs[0], &done), NIF_OK);
  EXPECT_EQ(done, 0u);
  EXPECT_TRUE(polled.answers.untouched());
  nifReleaseJob(jobs[2]);
  EXPECT_TRUE(dropped.answers.untouched()) << "releasing a job does not wait for it";
  for (int i = 0; i < 100 && !done; ++i) ASSERT_EQ(nifIsJobDone(jobs[0], &done), NIF_OK);
  EXPECT_EQ(done, 1u);
  expect_same(polled.answers.get(), expected);
  ASSERT_EQ(nifWaitJob(jobs[1]), NIF_OK);
  expect_same(awaited.answers.get(), expected);
  ASSERT_EQ(nifIsJobDone(jobs[1], &done), NIF_OK);
  EXPECT_EQ(done, 1u);
  nifReleaseJob(jobs[0]);
  nifReleaseJob(jobs[1]);
  machine().wait_stream(stream);
  expect_same(dropped.answers.get(), expected);
  machine().free_stream(stream);

  // In host memory: answered when the call returns.
  Answers answers(rays.size());
  NifRays query = nifMakeRays(rays.data(), rays.size());
  const NifAnswers outputs = answers.outputs();
  NifJob job = nullptr;
  ASSERT_EQ(nifQueryAsync(twins.gpu(), &query, &outputs, &job), NIF_OK) << nifGetErrorMessage();
  ASSERT_EQ(nifIsJobDone(job, &done), NIF_OK);
  EXPECT_EQ(done, 1u);
  expect_same(answers, expected);
  EXPECT_EQ(nifWaitJob(job), NIF_OK);
  nifReleaseJob(job);
}

TEST_P(GpuAnswers, MeasuredOnes) {
  Random random(14);
  TwinScenes twins(config());
  const uint32_t asset = twins.load(random_asset(14, {.objects = 1, .bvhs = 1}));
  for (uint32_t i = 0; i < 4; ++i) twins.add(asset, i % 2, random_transform(random, 3));
  twins.commit();
  const std::vector<NifRay> rays = rays_in_cube(random, 6, 1001);
  Answers answers(rays.size());
  NifRays query = nifMakeRays(rays.data(), rays.size());
  const NifAnswers outputs = answers.outputs();
  const Answers expected = query_all(twins.cpu(), rays);
  double seconds[3 * NIF_MEASURED_STAGES] = {};
  machine().most_rays = 504;
  ASSERT_EQ(nifMeasureQuery(twins.gpu(), &query, &outputs, NIF_MEASURE_ONE_KERNEL, 3, seconds), NIF_OK);
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(seconds[i], 2e-6, 1e-9) << "two launches, and no copies";
  expect_same(answers, expected);
  ASSERT_EQ(nifMeasureQuery(twins.gpu(), &query, &outputs, NIF_MEASURE_PIPELINE, 3, seconds), NIF_OK);
  for (int i = 0; i < 3; ++i) EXPECT_GT(seconds[i], 10e-6);
  expect_same(answers, expected);
  ASSERT_EQ(nifMeasureQuery(twins.gpu(), &query, &outputs, NIF_MEASURE_STAGES, 3, seconds), NIF_OK);
  expect_same(answers, expected);
  // Traversal, sorting, inputs, networks, no inner fields, the rest. Every launch takes a microsecond here,
  // one for inputs alone as long as one with networks: so networks take no time.
  for (int round = 0; round < 3; ++round) {
    const double* stages = seconds + round * NIF_MEASURED_STAGES;
    EXPECT_GT(stages[0], 0);
    EXPECT_NEAR(stages[1], 2 * stages[2], 1e-9);
    EXPECT_NEAR(stages[3], 0, 1e-9);
    EXPECT_EQ(stages[4] + stages[5], 0);
    EXPECT_GT(stages[6], 0);
  }
  EXPECT_EQ(nifMeasureQuery(twins.cpu(), &query, &outputs, NIF_MEASURE_QUERY, 3, seconds),
            NIF_ERROR_NOT_AVAILABLE);
  EXPECT_EQ(nifMeasureQuery(twins.gpu(), &query, &outputs, NIF_MEASURE_QUERY, 0, seconds),
            NIF_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(nifMeasureQuery(twins.gpu(), &query, &outputs, NifMeasure(5), 1, seconds),
            NIF_ERROR_INVALID_ARGUMENT);
  machine().fail_allocation = 2;
  EXPECT_EQ(nifMeasureQuery(twins.gpu(), &query, &outputs, NIF_MEASURE_QUERY, 3, seconds),
            NIF_ERROR_OUT_OF_DEVICE_MEMORY);
}

/// A BVH without proofs: hardly an answer differs, and nothing else can be measured so.
TEST_P(GpuAnswers, MeasuredOnesOfSinglePrecision) {
  Random random(16);
  TwinScenes twins(config());
  const uint32_t asset = twins.load(random_asset(14, {.objects = 1, .bvhs = 2}));
  const uint32_t exact = twins.load(random_asset(14, {.objects = 0, .bvhs = 2}));
  for (uint32_t i = 0; i < 4; ++i) twins.add(exact, i % 2, random_transform(random, 3));
  twins.commit();
  const std::vector<NifRay> rays = rays_in_cube(random, 6, 5000);
  std::vector<uint8_t> visible(rays.size(), 7), expected(rays.size());
  query_visible(twins.cpu(), rays, expected);
  const NifRays query = nifMakeRays(rays.data(), rays.size());
  NifAnswers outputs = nifkit::Answers().visible(visible).get(rays.size());
  double seconds[2];
  ASSERT_EQ(nifMeasureQuery(twins.gpu(), &query, &outputs, NIF_MEASURE_SINGLE_BVH, 2, seconds), NIF_OK)
      << nifGetErrorMessage();
  size_t different = 0, blocked = 0;
  for (size_t i = 0; i < rays.size(); ++i) {
    different += visible[i] != expected[i];
    blocked += !visible[i];
  }
  EXPECT_LT(different, rays.size() / 500);
  EXPECT_GT(blocked, 20u);
  std::vector<int32_t> logit(rays.size());
  outputs.logit = logit.data();
  EXPECT_EQ(nifMeasureQuery(twins.gpu(), &query, &outputs, NIF_MEASURE_SINGLE_BVH, 2, seconds),
            NIF_ERROR_INVALID_ARGUMENT);
  outputs.logit = nullptr;
  twins.add(asset, 0, kIdentity);
  twins.commit();
  EXPECT_EQ(nifMeasureQuery(twins.gpu(), &query, &outputs, NIF_MEASURE_SINGLE_BVH, 2, seconds),
            NIF_ERROR_INVALID_ARGUMENT)
      << "a segment object is among them";
}

/// The CPU answers single rays and queries with a fallback.
TEST_P(GpuAnswers, WhatTheCpuAnswers) {
  Random random(13);
  TwinScenes twins(config());
  twins.add(twins.load(random_asset(13, {.objects = 1})), 0, kIdentity);
  twins.commit();
  const std::vector<NifRay> rays = rays_in_cube(random, 6, 200);
  const Answers expected = query_all(twins.cpu(), rays);
  const uint32_t launches = machine().launches;
  for (size_t i = 0; i < rays.size(); ++i) {
    ASSERT_EQ(query_alone(twins.gpu(), rays[i]), expected.visible[i]);
  }
  uint64_t asked = 0;
  const NifFallback count = [](void* user, uint64_t n, const uint64_t*, uint8_t*) {
    *static_cast<uint64_t*>(user) += n;
  };
  Answers answers(rays.size());
  NifRays query = nifMakeRays(rays.data(), rays.size());
  const NifAnswers outputs = answers.outputs();
  ASSERT_EQ(nifQueryWithFallback(twins.gpu(), &query, &outputs, 2, count, &asked), NIF_OK)
      << nifGetErrorMessage();
  EXPECT_GT(asked, 0u);
  EXPECT_EQ(machine().launches, launches);
  query.memory = NIF_MEMORY_DEVICE;
  EXPECT_EQ(nifQueryWithFallback(twins.gpu(), &query, &outputs, 2, count, &asked), NIF_ERROR_NOT_AVAILABLE);
}

}  // namespace
}  // namespace nif::test
