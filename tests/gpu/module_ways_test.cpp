// Which kernels the GPU module uses, in which precision, and how much memory they need.
#include "tests/gpu/half_bound.hpp"
#include "tests/gpu/module_fixture.hpp"
#include "tests/support/query_object.hpp"

namespace nif::test {
namespace {

class GpuWays : public GpuModuleTest {
 protected:
  static std::string config(const char* more) { return GpuModuleTest::config() + "," + more; }
  static NifError code_of(const std::string& config) {
    NifDevice device = nullptr;
    const NifError error = nifNewDevice(config.c_str(), nullptr, &device);
    nifReleaseDevice(device);
    return error;
  }
  /// A scene of several instances with networks.
  static void fill(TwinScenes& twins, uint32_t instances = 6) {
    Random random(1);
    const uint32_t asset = twins.load(
        random_asset(1, {.objects = 2, .bvhs = 1, .sphericals = 1, .exacts = 1, .proofs = 1, .cutouts = 1}));
    for (uint32_t i = 0; i < instances; ++i)
      twins.add(asset, i % twins.objects(asset), random_transform(random, 4));
    twins.commit();
  }
  static std::vector<NifRay> some_rays(size_t count = 500) {
    Random random(2);
    return rays_in_cube(random, 7, count);
  }
  /// Counts the launches of the pipeline for a query, and checks its answers.
  uint32_t pipelined(const TwinScenes& twins, const std::vector<NifRay>& rays) {
    const uint32_t before = machine().pipelined;
    expect_same(query_all(twins.gpu(), rays), query_all(twins.cpu(), rays));
    return machine().pipelined - before;
  }
};

TEST_F(GpuWays, AreNamedByTheConfiguration) {
  for (const char* good : {"pipeline=on", "pipeline=off", "pipeline=auto", "precision=single",
                           "precision=half", "precision=half,pipeline=on", "precision=single,pipeline=off"})
    EXPECT_EQ(code_of(config(good)), NIF_OK) << good << ": " << nifGetErrorMessage();
  for (const char* bad : {"pipeline=", "pipeline=1", "precision=double", "precision=half,pipeline=off"}) {
    EXPECT_EQ(code_of(config(bad)), NIF_ERROR_INVALID_ARGUMENT) << bad;
    EXPECT_NE(std::string(nifGetErrorMessage()).find("configuration"), std::string::npos);
  }
  for (const char* on_cpu : {"pipeline=on", "precision=half"})
    EXPECT_EQ(code_of(on_cpu), NIF_ERROR_INVALID_ARGUMENT) << on_cpu;
}

TEST_F(GpuWays, AreWhatTheConfigurationSays) {
  const std::vector<NifRay> rays = some_rays();
  TwinScenes off(config("pipeline=off")), on(config("pipeline=on"));
  fill(off);
  fill(on);
  EXPECT_EQ(pipelined(off, rays), 0u);
  EXPECT_GT(pipelined(on, rays), 10u);
  // Without a network there is nothing to list.
  TwinScenes exact(config("pipeline=on"));
  const uint32_t asset = exact.load(random_asset(1, {.objects = 0, .bvhs = 1}));
  for (int i = 0; i < 2; ++i) exact.add(asset, 0, kIdentity);
  exact.commit();
  EXPECT_EQ(pipelined(exact, rays), 0u);
}

/// The first queries of a size use both ways; then the faster one is known.
TEST_F(GpuWays, AreChosenByMeasuring) {
  for (const bool slow : {true, false}) {
    machine().seconds_of_one_kernel = slow ? 1 : 0;
    TwinScenes twins(config("pipeline=auto"));
    fill(twins);
    for (const size_t size : {600u, 70u}) {
      const std::vector<NifRay> rays = some_rays(size);
      uint32_t by_pipeline = 0;
      for (int i = 0; i < 4; ++i) by_pipeline += pipelined(twins, rays) > 0;
      EXPECT_EQ(by_pipeline, 2u) << "both ways are tried";
      for (int i = 0; i < 3; ++i) EXPECT_EQ(pipelined(twins, rays) > 0, slow) << size << " rays";
      // Moving instances does not change that.
      twins.move(0, kIdentity);
      twins.commit();
      for (int i = 0; i < 3; ++i) EXPECT_EQ(pipelined(twins, rays) > 0, slow) << size << " rays";
      // Queries without details are measured apart: they end earlier.
      uint8_t visible[600];
      const NifRays query = nifMakeRays(rays.data(), rays.size());
      auto outputs = nifkit::sized<NifAnswers>();
      outputs.visible = visible;
      by_pipeline = 0;
      for (int i = 0; i < 4; ++i) {
        const uint32_t before = machine().pipelined;
        ASSERT_EQ(nifQuery(twins.gpu(), &query, &outputs), NIF_OK);
        by_pipeline += machine().pipelined > before;
      }
      EXPECT_EQ(by_pipeline, 2u);
    }
  }
}

/// Nothing waits to learn how long a query took.
TEST_F(GpuWays, AreChosenWithoutWaiting) {
  TwinScenes twins(config("pipeline=auto"));
  fill(twins);
  const std::vector<NifRay> rays = some_rays();
  const GpuArray on_gpu(machine(), 0, rays.data(), rays.size() * sizeof(NifRay));
  std::vector<GpuAnswerArrays> answers;
  void* stream = machine().make_stream(0);
  const uint32_t waits = machine().waits;
  for (int i = 0; i < 8; ++i) {
    answers.emplace_back(machine(), 0, rays.size());
    NifRays query = nifMakeRays(on_gpu.as<NifRay>(), rays.size());
    query.memory = NIF_MEMORY_DEVICE;
    query.stream = stream;
    const NifAnswers outputs = answers.back().outputs();
    ASSERT_EQ(nifQuery(twins.gpu(), &query, &outputs), NIF_OK) << nifGetErrorMessage();
  }
  EXPECT_EQ(machine().waits, waits);
  machine().wait_stream(stream);
  machine().free_stream(stream);
  const Answers expected = query_all(twins.cpu(), rays);
  for (const GpuAnswerArrays& one : answers) expect_same(one.get(), expected);
}

/// A later query reads the time that an earlier one could not read.
TEST_F(GpuWays, AreChosenInSpiteOfErrors) {
  TwinScenes twins(config("pipeline=auto"));
  fill(twins);
  const std::vector<NifRay> rays = some_rays();
  const GpuArray on_gpu(machine(), 0, rays.data(), rays.size() * sizeof(NifRay));
  const GpuAnswerArrays answers(machine(), 0, rays.size());
  NifRays query = nifMakeRays(on_gpu.as<NifRay>(), rays.size());
  query.memory = NIF_MEMORY_DEVICE;
  const NifAnswers outputs = answers.outputs();
  void* streams[3];
  for (void*& stream : streams) {
    stream = machine().make_stream(0);
    query.stream = stream;
    ASSERT_EQ(nifQuery(twins.gpu(), &query, &outputs), NIF_OK) << nifGetErrorMessage();
  }
  machine().wait_stream(streams[0]);
  machine().fail_asking = 3;  // one is done, one is not, one cannot be asked
  EXPECT_EQ(nifQuery(twins.gpu(), &query, &outputs), NIF_ERROR_UNKNOWN);
  EXPECT_EQ(machine().fail_asking, 0u);
  for (void* stream : streams) machine().wait_stream(stream);
  for (int i = 0; i < 3; ++i)
    ASSERT_EQ(nifQuery(twins.gpu(), &query, &outputs), NIF_OK) << nifGetErrorMessage();
  for (void* stream : streams) machine().wait_stream(stream);
  expect_same(answers.get(), query_all(twins.cpu(), rays));
  for (void* stream : streams) machine().free_stream(stream);
}

/// Rays that need more networks than there are rounds, and scenes without details.
TEST_F(GpuWays, CrowdsOfInstances) {
  Random random(5);
  TwinScenes twins(config("pipeline=on"));
  const uint32_t asset = twins.load(random_asset(4, {.objects = 2, .sphericals = 1, .features = 2}));
  for (uint32_t i = 0; i < 60; ++i) twins.add(asset, i % 3, random_transform(random, 3));
  twins.commit();
  const std::vector<NifRay> rays = some_rays(2000);
  const uint32_t before = machine().launches;
  EXPECT_GT(pipelined(twins, rays), 0u);
  EXPECT_GT(machine().launches - before, machine().pipelined ? 20u : 0u);
  std::vector<uint8_t> visible(rays.size()), expected(rays.size()), bits((rays.size() + 7) / 8);
  query_visible(twins.gpu(), rays, visible);
  query_visible(twins.cpu(), rays, expected);
  EXPECT_EQ(visible, expected);
  query_visible_bits(twins.gpu(), rays, bits);
  for (size_t i = 0; i < rays.size(); ++i) ASSERT_EQ(bits[i / 8] >> i % 8 & 1, expected[i]) << i;
}

/// Running queries have their own memory, which later ones reuse; without room for more they take turns.
TEST_F(GpuWays, MemoryIsSharedInTurns) {
  TwinScenes twins(config("pipeline=on"));
  fill(twins);
  const std::vector<NifRay> rays = some_rays();
  const Answers expected = query_all(twins.cpu(), rays);
  const GpuArray on_gpu(machine(), 0, rays.data(), rays.size() * sizeof(NifRay));
  const auto ask = [&](const GpuAnswerArrays& answers, void* stream) {
    NifRays query = nifMakeRays(on_gpu.as<NifRay>(), rays.size());
    query.memory = NIF_MEMORY_DEVICE;
    query.stream = stream;
    const NifAnswers outputs = answers.outputs();
    return nifQuery(twins.gpu(), &query, &outputs);
  };
  const GpuAnswerArrays answers[] = {{machine(), 0, rays.size()},
                                     {machine(), 0, rays.size()},
                                     {machine(), 0, rays.size()},
                                     {machine(), 0, rays.size()}};
  void* streams[3];
  for (void*& stream : streams) stream = machine().make_stream(0);
  const uint32_t before = machine().allocations, waits = machine().waits, held = machine().held_back;
  ASSERT_EQ(ask(answers[0], streams[0]), NIF_OK);
  ASSERT_EQ(ask(answers[1], streams[1]), NIF_OK);
  EXPECT_EQ(machine().allocations, before + 2) << "one for each query that is under way";
  EXPECT_EQ(machine().held_back, held);
  machine().fail_allocation = 1;
  ASSERT_EQ(ask(answers[2], streams[2]), NIF_OK) << nifGetErrorMessage();
  EXPECT_EQ(machine().allocations, before + 2);
  EXPECT_EQ(machine().held_back, held + 1) << "behind one of the others";
  EXPECT_EQ(machine().waits, waits);
  machine().wait_stream(streams[2]);  // and the work that it waits for
  expect_same(answers[2].get(), expected);
  for (void* stream : streams) machine().wait_stream(stream);
  expect_same(answers[0].get(), expected);
  expect_same(answers[1].get(), expected);
  ASSERT_EQ(ask(answers[3], streams[0]), NIF_OK);
  EXPECT_EQ(machine().allocations, before + 2) << "memory that nobody uses any more";
  for (void* stream : streams) machine().wait_stream(stream);
  for (void* stream : streams) machine().free_stream(stream);
  expect_same(answers[3].get(), expected);
}

/// A growing scene seldom needs larger memory, and memory that is too small is freed if memory is short.
TEST_F(GpuWays, MemoryOfAGrowingScene) {
  TwinScenes twins(config("pipeline=on"));
  const std::vector<NifRay> rays = some_rays();
  const GpuArray on_gpu(machine(), 0, rays.data(), rays.size() * sizeof(NifRay));
  const GpuAnswerArrays answers(machine(), 0, rays.size());
  NifRays query = nifMakeRays(on_gpu.as<NifRay>(), rays.size());
  query.memory = NIF_MEMORY_DEVICE;
  query.stream = machine().make_stream(0);
  const NifAnswers outputs = answers.outputs();
  uint32_t taken = 0, freed = 0;
  Random random(3);
  for (uint32_t i = 0; i < 40; ++i) {
    const uint32_t asset = twins.load(random_asset(i, {.objects = 1, .sphericals = 1, .features = 2}));
    for (uint32_t object = 0; object < 2; ++object) twins.add(asset, object, random_transform(random, 4));
    twins.commit();
    const uint32_t before = machine().allocations;
    machine().fail_allocation = i == 0 ? 0 : 1;
    ASSERT_EQ(nifQuery(twins.gpu(), &query, &outputs), NIF_OK) << nifGetErrorMessage();
    const bool was_due = machine().fail_allocation.exchange(0) == 0;
    taken += machine().allocations > before;
    freed += i > 0 && was_due;
    EXPECT_LE(machine().allocations, before + (i == 0));
    machine().wait_stream(query.stream);
  }
  machine().free_stream(query.stream);
  EXPECT_EQ(taken, 1u);
  EXPECT_GT(freed, 1u);
  EXPECT_LT(freed, 9u) << "a power of two of lists each";
  expect_same(answers.get(), query_all(twins.cpu(), rays));
}

/// As docs/gpu.md says. Every scene also needs a few words per list, which are negligible with so many rays.
TEST_F(GpuWays, MemoryOfARay) {
  constexpr uint64_t kRays = 1 << 18;
  const std::vector<NifRay> ray = some_rays(1);
  const GpuArray on_gpu(machine(), 0, ray.data(), sizeof(NifRay));
  const GpuArray visible(machine(), 0, nullptr, kRays);
  for (const bool several : {false, true}) {
    TwinScenes twins(config("pipeline=on"));
    fill(twins, several ? 2 : 1);
    NifRays query = nifMakeRays(on_gpu.as<NifRay>(), kRays);
    query.origin_stride = query.direction_stride = query.tmin_stride = query.tmax_stride = 0;
    query.memory = NIF_MEMORY_DEVICE;
    auto outputs = nifkit::sized<NifAnswers>();
    outputs.visible = visible.as<uint8_t>();
    const uint64_t before = machine().allocated;
    machine().discard = true;
    ASSERT_EQ(nifQuery(twins.gpu(), &query, &outputs), NIF_OK) << nifGetErrorMessage();
    machine().discard = false;
    EXPECT_NEAR(double(machine().allocated - before) / kRays, several ? 181 : 69, 0.1);
  }
}

/// Without memory for the pipeline the one kernel answers, which needs none; but not if another way was
/// requested.
TEST_F(GpuWays, WithoutMemoryForThePipeline) {
  const std::vector<NifRay> rays = some_rays();
  const GpuArray on_gpu(machine(), 0, rays.data(), rays.size() * sizeof(NifRay));
  const GpuAnswerArrays answers(machine(), 0, rays.size());
  const struct {
    const char* config;
    NifError error;
  } cases[] = {{"pipeline=auto", NIF_OK},
               {"pipeline=on", NIF_ERROR_OUT_OF_DEVICE_MEMORY},
               {"precision=half", NIF_ERROR_OUT_OF_DEVICE_MEMORY}};
  for (const auto& [text, error] : cases) {
    TwinScenes twins(config(text));
    fill(twins);
    NifRays query = nifMakeRays(on_gpu.as<NifRay>(), rays.size());
    query.memory = NIF_MEMORY_DEVICE;
    query.stream = machine().make_stream(0);
    const NifAnswers outputs = answers.outputs();
    machine().fail_allocation = 1;
    EXPECT_EQ(nifQuery(twins.gpu(), &query, &outputs), error) << text;
    EXPECT_EQ(machine().fail_allocation, 0u) << "it was asked for";
    machine().wait_stream(query.stream);
    if (error == NIF_OK) {
      expect_same(answers.get(), query_all(twins.cpu(), rays));
    }
    EXPECT_EQ(nifQuery(twins.gpu(), &query, &outputs), NIF_OK) << nifGetErrorMessage();
    machine().wait_stream(query.stream);
    machine().free_stream(query.stream);
  }
}

/// Queries in host memory with several chunks: two run at the same time, or one if the GPU has no memory for
/// more.
TEST_F(GpuWays, PartsOfHostQueries) {
  TwinScenes twins(config("pipeline=off"));
  fill(twins, 2);
  const std::vector<NifRay> rays = some_rays(3 * 262144 + 77);
  std::vector<uint8_t> visible(rays.size(), 7), expected(rays.size());
  std::vector<uint8_t> bits((rays.size() + 7) / 8);
  query_visible(twins.cpu(), rays, expected);
  const uint32_t before = machine().allocations;
  machine().fail_allocation = 2;
  query_visible(twins.gpu(), rays, visible);
  EXPECT_EQ(machine().allocations, before + 1);
  EXPECT_EQ(visible, expected);
  query_visible_bits(twins.gpu(), rays, bits);
  EXPECT_EQ(machine().allocations, before + 2);
  for (size_t i = 0; i < rays.size(); ++i) ASSERT_EQ(bits[i / 8] >> i % 8 & 1, expected[i]) << i;
  // The masks of a chunk lie behind its rays.
  std::vector<uint32_t> masks(262144 + 500, 0);
  for (size_t i = 0; i < masks.size(); i += 3) masks[i] = 1;
  NifRays masked = nifMakeRays(rays.data(), masks.size());
  masked.mask = masks.data();
  masked.mask_stride = sizeof(masks[0]);
  auto outputs = nifkit::sized<NifAnswers>();
  outputs.visible = visible.data();
  ASSERT_EQ(nifQuery(twins.gpu(), &masked, &outputs), NIF_OK) << nifGetErrorMessage();
  for (size_t i = 0; i < masks.size(); ++i) ASSERT_EQ(visible[i], i % 3 == 0 ? expected[i] : 1) << i;
}

/// Half precision affects only `spherical` objects, changes their answers within the bound of the arithmetic,
/// and gives the same each time, whichever way is faster.
TEST_F(GpuWays, HalfPrecision) {
  const format::Asset asset = random_asset(
      3, {.objects = 1, .instances = 0, .bvhs = 1, .sphericals = 1, .exacts = 1, .proofs = 1, .cutouts = 1});
  const auto file = format::encode(asset);
  const format::AssetView view = format::read_asset(file, "test");
  Random random(6);
  std::vector<NifRay> rays;
  for (uint32_t i = 0; i < 3000; ++i)
    rays.push_back(to_ray(random_segment(random, view.objects[i % view.objects.size()])));
  for (const char* text : {"precision=half", "precision=half,pipeline=on"})
    for (uint32_t object = 0; object < view.objects.size(); ++object) {
      TwinScenes twins(config(text));
      twins.add(twins.load(asset), object, kIdentity);
      twins.commit();
      const Answers expected = query_all(twins.cpu(), rays), got = query_all(twins.gpu(), rays);
      if (object != 2) {  // it is the spherical one
        expect_same(got, expected);
        continue;
      }
      const kernels::SphericalField& field = view.objects[object].as<kernels::SphericalField>();
      uint32_t moved = 0;
      for (size_t i = 0; i < rays.size(); ++i) {
        const double bound = half_bound(field, to_segment(rays[i])) * double(kernels::kSphericalLogitUnit);
        ASSERT_LE(std::fabs(double(got.logit[i]) - double(expected.logit[i])), bound) << i;
        ASSERT_EQ(got.certain[i], expected.certain[i]);
        moved += got.logit[i] != expected.logit[i];
      }
      EXPECT_GT(moved, 100u);
      for (int i = 0; i < 5; ++i) EXPECT_EQ(query_all(twins.gpu(), rays), got);
      // The CPU answers single rays.
      for (size_t i = 0; i < 50; ++i) {
        ASSERT_EQ(query_alone(twins.gpu(), rays[i]), expected.visible[i]);
      }
    }
}

/// The kernels for half precision do not support masks: rays with masks are answered in single precision.
TEST_F(GpuModuleTest, MasksAreAnsweredInSinglePrecision) {
  TwinScenes twins(config() + ",precision=half");
  const uint32_t asset = twins.load(random_asset(32, {.objects = 0, .sphericals = 2}));
  for (uint32_t i = 0; i < 2; ++i) twins.add(asset, i, kIdentity);
  twins.commit();
  Random random(33);
  const std::vector<NifRay> rays = rays_in_cube(random, 3, 1500);
  const GpuArray masks(machine(), 0, nullptr, 4);
  *masks.as<uint32_t>() = 1;
  GpuQuery asked(machine(), 0, rays);
  asked.query.mask = masks.as<uint32_t>();
  asked.query.stream = machine().make_stream(0);
  ASSERT_EQ(nifQuery(twins.gpu(), &asked.query, &asked.outputs), NIF_OK) << nifGetErrorMessage();
  machine().wait_stream(asked.query.stream);
  machine().free_stream(asked.query.stream);
  expect_same(asked.answers.get(), query_all(twins.cpu(), rays));
}

}  // namespace
}  // namespace nif::test
