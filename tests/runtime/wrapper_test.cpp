// nif.hpp gives the same answers as nif.h, with handles that release themselves, and errors as exceptions.
#include "tests/runtime/runtime_fixture.hpp"

namespace nif::test {
namespace {

class Wrapper : public RuntimeTest {};

TEST_F(Wrapper, LoadsAndQueries) {
  const format::AssetView& view = make(1);
  nifkit::Device device("threads=1");
  nifkit::Scene scene(device);
  {
    const nifkit::Asset asset = nifkit::Asset::load(device, file_);
    EXPECT_EQ(asset.info().object_count, 3u);
    EXPECT_STREQ(asset.object(1).name, "object 1 \u00e9");
    EXPECT_STREQ(asset.instance(0).name, "instance 0");
    EXPECT_EQ(asset.metadata(), view.metadata);
    EXPECT_EQ(scene.add_instance(asset, 0, kIdentity), 0u);
    EXPECT_EQ(scene.add_asset(asset), 1u);
    EXPECT_EQ(scene.add_asset(asset, kIdentity), 5u);
    scene.set_instance_transform(0, kIdentity);
  }
  nifkit::Scene copy = scene;
  device = nifkit::Device();
  scene.commit();
  EXPECT_EQ(copy.info().committed, 1u);
  Random random(1);
  const auto rays = random_rays(random, view.objects[0].as<kernels::SegmentField>(), 99);
  const Answers expected = query_all(scene.get(), rays);
  Answers answers(rays.size());
  copy.query(rays, nifkit::Answers()
                       .visible(answers.visible)
                       .visible_bits(answers.bits)
                       .certain(answers.certain)
                       .probability(answers.probability)
                       .logit(answers.logit));
  EXPECT_EQ(answers, expected);
  EXPECT_EQ(copy.query(rays[5]), expected.visible[5] == 1);

  std::vector<uint8_t> later(rays.size());
  nifkit::Job job = copy.query_async(rays, nifkit::Answers().visible(later));
  const nifkit::Job same = std::move(job);
  same.wait();
  EXPECT_TRUE(same.done());
  EXPECT_EQ(later, expected.visible);
  std::ranges::fill(later, uint8_t(7));
  { const nifkit::Job waits = copy.query_async(rays, nifkit::Answers().visible(later)); }
  EXPECT_EQ(later, expected.visible) << "the job's destructor waits";

  std::vector<float> t(rays.size()), normal(3 * rays.size());
  std::vector<uint64_t> user(rays.size());
  copy.set_instance_user(0, 77);
  copy.commit();
  copy.intersect(rays, nifkit::Hits().hit(later).t(t).normal(normal).user(user));
  for (size_t i = 0; i < rays.size(); ++i) EXPECT_EQ(later[i], !expected.visible[i]);
  std::vector<uint8_t> one_by_one(rays.size());
  copy.intersect_async(rays, nifkit::Hits().hit(one_by_one)).wait();
  EXPECT_EQ(one_by_one, later);

  size_t asked = 0;
  copy.query_with_fallback(rays, nifkit::Answers().visible(later), 2,
                           [&](std::span<const uint64_t> uncertain, std::span<uint8_t> answers_of_uncertain) {
                             asked += uncertain.size();
                             std::ranges::fill(answers_of_uncertain, uint8_t(0));
                           });
  EXPECT_EQ(asked, size_t(std::ranges::count(expected.certain, 0)));
  for (size_t i = 0; i < rays.size(); ++i) EXPECT_EQ(later[i], expected.certain[i] ? expected.visible[i] : 0);
}

TEST_F(Wrapper, Throws) {
  const nifkit::Device device;
  try {
    nifkit::Asset::load(device, "nowhere.nif");
    FAIL();
  } catch (const nifkit::Error& error) {
    EXPECT_EQ(error.code(), NIF_ERROR_FILE_NOT_FOUND);
    EXPECT_STREQ(error.what(), "nowhere.nif: there is no such file");
  }
  const std::vector<NifRay> rays(9);
  std::vector<uint8_t> bits(1);
  nifkit::Scene scene(device);
  scene.commit();
  EXPECT_THROW(scene.query(rays, nifkit::Answers().visible_bits(bits)), nifkit::Error);
  std::vector<float> normals(3 * rays.size() - 1);
  EXPECT_THROW(scene.intersect(rays, nifkit::Hits().normal(normals)), nifkit::Error);
  std::vector<uint32_t> masks(rays.size() - 1);
  EXPECT_THROW(nifkit::Rays(rays).masks(masks), nifkit::Error);
  EXPECT_THROW(nifkit::Device("isa=none"), nifkit::Error);
}

}  // namespace
}  // namespace nif::test
