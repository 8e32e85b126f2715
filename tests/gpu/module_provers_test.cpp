// Assets that prove nothing, on the GPU: no answer about them is certain there, as on the CPU. And objects that
// cannot be answered do not keep the others of their asset from the GPU.
#include "tests/format/damaged.hpp"
#include "tests/gpu/gpu_hit_query.hpp"
#include "tests/gpu/gpu_open_query.hpp"

namespace nif::test {
namespace {

constexpr RandomAssetOptions kEveryEncoding{.objects = 2,
                                            .instances = 0,
                                            .max_voxels = 10,
                                            .bvhs = 1,
                                            .sphericals = 1,
                                            .exacts = 1,
                                            .proofs = 1,
                                            .cutouts = 1};

class GpuProvers : public GpuModuleTest, public testing::WithParamInterface<uint32_t> {
 protected:
  /// Returns how many answers are certain.
  size_t expect_twins(const TwinScenes& twins, const std::vector<NifRay>& rays) {
    const Answers expected = query_all(twins.cpu(), rays);
    expect_same(query_all(twins.gpu(), rays), expected);
    const FirstHits hits = intersect_all(twins.cpu(), rays);
    EXPECT_EQ(count_different_hits(intersect_on_gpu(machine(), GetParam(), twins.gpu(), rays), hits), 0u);
    const OpenAnswers open = query_open(twins.cpu(), rays, rays.size()),
                      got = query_open_on_gpu(machine(), GetParam(), twins.gpu(), rays, rays.size());
    expect_same(got, open);
    EXPECT_EQ(got.count, open.count);
    EXPECT_TRUE(got.open == open.open);
    return size_t(std::ranges::count(expected.certain, 1) + std::ranges::count(hits.certain, 1));
  }
};
// Waves of 32 lanes and of 64.
INSTANTIATE_TEST_SUITE_P(Each, GpuProvers, testing::Values(0u, 2u),
                         [](const auto& p) { return std::string(name_of(kMatrixKinds[p.param])); });

TEST_P(GpuProvers, OfRevisionZeroProveNothing) {
  format::Asset asset = random_asset(1, kEveryEncoding);
  const std::vector<std::byte> good = format::encode(asset);
  asset.prover = 0;
  const std::vector<std::byte> file = format::encode(asset);
  const std::vector<NifRay> rays = rays_near(format::read_asset(file, "test"), 1, 1001);
  const Matrix moved{0.9f, 0.1f, 0, 0.1f, 0, -1.1f, 0.2f, 0, 0.1f, 0, 1, -0.1f};
  for (const char* way : {",pipeline=on", ",pipeline=off"}) {
    for (uint32_t object = 0; object < asset.objects.size(); ++object)
      for (const Matrix& transform : {kIdentity, moved}) {
        TwinScenes twins(config(GetParam()) + way);
        twins.add(twins.load(file), object, transform);
        twins.commit();
        EXPECT_EQ(expect_twins(twins, rays), 0u);
      }
    TwinScenes all(config(GetParam()) + way);
    const uint32_t unproven = all.load(file), proven = all.load(good);
    for (uint32_t object = 0; object < asset.objects.size(); ++object) all.add(unproven, object, moved);
    all.commit();
    EXPECT_EQ(expect_twins(all, rays), 0u);
    for (uint32_t object = 0; object < asset.objects.size(); ++object) all.add(proven, object, kIdentity);
    all.commit();
    EXPECT_GT(expect_twins(all, rays), 100u) << "what others block";
  }
}

TEST_P(GpuProvers, OfObjectsThatCannotBeAnswered) {
  const std::vector<std::byte> good = format::encode(random_asset(2, kEveryEncoding));
  const std::vector<NifRay> rays = rays_near(format::read_asset(good, "test"), 2, 501);
  for (const uint32_t broken : {0u, 2u, 5u}) {
    TwinScenes twins(config(GetParam()));
    const uint32_t asset = twins.load(with_record<format::ObjectRecord>(
        good, format::kObjects, broken, [](auto& r) { r.flags = format::kDeforms; }));
    for (uint32_t object = 0; object < twins.objects(asset); ++object)
      if (object != broken) twins.add(asset, object, kIdentity);
    twins.commit();
    EXPECT_GT(expect_twins(twins, rays), 100u);
  }
}

}  // namespace
}  // namespace nif::test
