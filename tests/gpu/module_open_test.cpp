// nifQueryOpen in GPU memory gives the same answers as on the CPU, and lists the same rays, with the same
// bits of tmin and tmax, in any order.
#include "formats/nif/reader.hpp"
#include "tests/gpu/gpu_open_query.hpp"

namespace nif::test {
namespace {

constexpr RandomAssetOptions kAllEncodings{
    .objects = 2, .instances = 0, .bvhs = 1, .sphericals = 1, .exacts = 1, .proofs = 2, .cutouts = 1};

class GpuOpenRays : public GpuModuleTest, public testing::WithParamInterface<uint32_t> {
 protected:
  uint32_t gpu() const { return GetParam(); }

  /// Returns how many rays were listed.
  size_t expect_twins(const TwinScenes& twins, const std::vector<NifRay>& rays) {
    const OpenAnswers expected = query_open(twins.cpu(), rays, rays.size());
    const OpenAnswers got = query_open_on_gpu(machine(), gpu(), twins.gpu(), rays, rays.size());
    expect_same(got, expected);
    EXPECT_EQ(got.count, expected.count);
    EXPECT_TRUE(got.open == expected.open);
    return got.open.size();
  }
};
// Waves of 32 lanes and of 64.
INSTANTIATE_TEST_SUITE_P(Each, GpuOpenRays, testing::Values(0u, 2u),
                         [](const auto& p) { return std::string(name_of(kMatrixKinds[p.param])); });

TEST_P(GpuOpenRays, AreThoseOfTheCpu) {
  for (uint64_t seed = 0; seed < 3; ++seed) {
    const std::vector<std::byte> file = format::encode(random_asset(seed, kAllEncodings));
    const format::AssetView view = format::read_asset(file, "test");
    const std::vector<NifRay> rays = rays_near(view, seed, 3001);
    size_t listed = 0;
    for (uint32_t object = 0; object < view.objects.size(); ++object)
      for (const bool moved : {false, true}) {
        TwinScenes twins(config(gpu()));
        Matrix transform = kIdentity;
        if (moved) transform = {0.9f, 0.1f, 0, 0.1f, 0, -1.1f, 0.2f, 0, 0.1f, 0, 1, -0.1f};
        twins.add(twins.load(file), object, transform);
        twins.commit();
        listed += expect_twins(twins, rays);
      }
    machine().order = seed;
    TwinScenes twins(config(gpu()));
    const uint32_t asset = twins.load(file);
    Random random(seed);
    for (int i = 0; i < 7; ++i) {
      Matrix transform = kIdentity;
      for (float& m : transform) m += random.between(-0.3f, 0.3f);
      twins.add(asset, random.below(twins.objects(asset)), transform);
    }
    twins.commit();
    EXPECT_GT(expect_twins(twins, rays), 100u);
    EXPECT_GT(listed, 1000u);
  }
}

/// Splitting into launches does not change answers, and ray numbers continue from one to the next.
TEST_P(GpuOpenRays, GoOnFromLaunchToLaunch) {
  machine().most_rays = 1000;
  TwinScenes twins(config(gpu()));
  const std::vector<std::byte> file = format::encode(random_asset(5, kAllEncodings));
  const uint32_t asset = twins.load(file);
  for (uint32_t object = 0; object < twins.objects(asset); ++object) twins.add(asset, object, kIdentity);
  twins.commit();
  const uint32_t launches = machine().launches;
  EXPECT_GT(expect_twins(twins, rays_near(format::read_asset(file, "test"), 5, 4321)), 100u);
  EXPECT_EQ(machine().launches - launches, 5u);
}

TEST_P(GpuOpenRays, AreCountedWhereThereIsNoRoom) {
  const std::vector<std::byte> file =
      format::encode(random_asset(3, {.objects = 0, .instances = 0, .proofs = 1}));
  TwinScenes twins(config(gpu()));
  twins.add(twins.load(file), 0, kIdentity);
  twins.commit();
  const std::vector<NifRay> rays = rays_near(format::read_asset(file, "test"), 3, 3000);
  const OpenAnswers all = query_open(twins.cpu(), rays, rays.size());
  ASSERT_GT(all.count, 100u);
  for (const size_t capacity : {size_t{0}, size_t{1}, size_t{100}, size_t{all.count}}) {
    const OpenAnswers some = query_open_on_gpu(machine(), gpu(), twins.gpu(), rays, capacity);
    EXPECT_EQ(some.count, all.count);
    EXPECT_EQ(some.open.size(), capacity);
    for (const OpenRay& ray : some.open)
      EXPECT_TRUE(std::binary_search(all.open.begin(), all.open.end(), ray)) << ray.ray;
    expect_same(some, all);
  }
}

TEST_P(GpuOpenRays, OfAnEmptySceneAreNone) {
  TwinScenes twins(config(gpu()));
  twins.commit();
  Random random(1);
  EXPECT_EQ(expect_twins(twins, rays_in_cube(random, 5, 300)), 0u);
}

TEST_F(GpuModuleTest, OpenRaysOfHostMemoryAreListedByTheCpu) {
  const std::vector<std::byte> file = format::encode(random_asset(3, kAllEncodings));
  TwinScenes twins(config());
  twins.add(twins.load(file), 0, kIdentity);
  twins.commit();
  const std::vector<NifRay> rays = rays_near(format::read_asset(file, "test"), 3, 3000);
  const uint32_t launches = machine().launches;
  const OpenAnswers got = query_open(twins.gpu(), rays, rays.size()),
                    expected = query_open(twins.cpu(), rays, rays.size());
  EXPECT_EQ(static_cast<const Answers&>(got), static_cast<const Answers&>(expected));
  EXPECT_TRUE(got.open == expected.open);
  EXPECT_EQ(machine().launches, launches);
}

TEST_F(GpuModuleTest, OpenQueriesOfWrongArgumentsAreRefused) {
  TwinScenes twins(config());
  const std::vector<std::byte> file = format::encode(random_asset(3, kAllEncodings));
  twins.add(twins.load(file), 0, kIdentity);
  twins.commit();
  const std::vector<NifRay> rays = rays_near(format::read_asset(file, "test"), 3, 100);
  const GpuOpenQuery good(machine(), 0, rays, rays.size());
  const auto refused = [&](NifError error, const NifRays& query, const NifAnswers& outputs,
                           const NifOpenRays& open) {
    EXPECT_EQ(nifQueryOpen(twins.gpu(), &query, &outputs, &open), error) << nifGetErrorMessage();
  };
  const uint32_t launches = machine().launches;

  uint32_t here[100];
  NifOpenRays open = good.open;
  open.count = here;
  refused(NIF_ERROR_WRONG_POINTER, good.query, good.outputs, open);
  EXPECT_NE(std::string(nifGetErrorMessage()).find("open: count"), std::string::npos);
  open = good.open;
  open.rays = here;
  refused(NIF_ERROR_WRONG_POINTER, good.query, good.outputs, open);
  EXPECT_NE(std::string(nifGetErrorMessage()).find("open: rays"), std::string::npos);
  const GpuArray elsewhere(machine(), 1, nullptr, 400);
  open = good.open;
  open.tmax = elsewhere.as<float>();
  refused(NIF_ERROR_WRONG_POINTER, good.query, good.outputs, open);
  EXPECT_NE(std::string(nifGetErrorMessage()).find("open: tmax"), std::string::npos);
  open = good.open;
  open.count = reinterpret_cast<uint32_t*>(reinterpret_cast<char*>(open.count) + 1);
  refused(NIF_ERROR_INVALID_ARGUMENT, good.query, good.outputs, open);

  NifAnswers outputs = good.outputs;
  uint8_t visible[100];
  outputs.visible = visible;
  refused(NIF_ERROR_WRONG_POINTER, good.query, outputs, good.open);
  NifRays query = nifMakeRays(rays.data(), rays.size());
  query.stream = machine().make_stream(0);
  open.rays = here;
  open.tmin = open.tmax = nullptr;
  open.count = here;
  refused(NIF_ERROR_NOT_AVAILABLE, query, nifkit::sized<NifAnswers>(), open);
  machine().free_stream(query.stream);
  EXPECT_EQ(machine().launches, launches);

  query = good.query;
  query.stream = machine().make_stream(0);
  machine().fail_launch = 1;
  refused(NIF_ERROR_DEVICE_LOST, query, good.outputs, good.open);
  refused(NIF_ERROR_DEVICE_LOST, query, good.outputs, good.open);
  machine().free_stream(query.stream);
  machine().lost = false;
}

}  // namespace
}  // namespace nif::test
