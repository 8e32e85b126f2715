// nif.hpp gives the same answers as nif.h, with handles that release themselves, and errors as exceptions.
#include "tests/runtime/open_answers.hpp"
#include "tests/runtime/runtime_fixture.hpp"

namespace nif::test {
namespace {

class Wrapper : public RuntimeTest {};

template <class Mask>
concept IsMask = requires(nifkit::Rays& rays, Mask mask) {
  rays.mask(static_cast<Mask>(mask));
};
static_assert(IsMask<const uint32_t&> && !IsMask<uint32_t&&>,
              "a mask is a variable, because its place is kept");

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
    EXPECT_EQ(scene.add_asset(asset).first, 1u);
    const nifkit::AddedInstances added = scene.add_asset(asset, kIdentity);
    EXPECT_EQ(added.first, 5u);
    EXPECT_EQ(added.count, asset.info().instance_count);
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

TEST_F(Wrapper, OneRay) {
  const format::AssetView& view = make(1, {.objects = 2, .instances = 0, .bvhs = 1, .exacts = 1});
  const nifkit::Device device;
  nifkit::Scene scene(device);
  const nifkit::Asset asset = nifkit::Asset::load(device, file_);
  EXPECT_EQ(scene.add_asset(asset).count, 4u);
  scene.commit();
  const auto rays = rays_near(view, 2, 99);
  std::vector<float> t(rays.size()), normal(3 * rays.size());
  std::vector<uint32_t> instance(rays.size());
  std::vector<int32_t> logit(rays.size());
  scene.intersect(rays, nifkit::Hits().t(t).normal(normal).instance(instance));
  scene.query(rays, nifkit::Answers().logit(logit));
  for (size_t i = 0; i < rays.size(); ++i) {
    float one_t = -1;
    std::array<float, 3> one_normal{};
    uint32_t one_instance = 0;
    int32_t one_logit = 0;
    scene.intersect(rays[i], nifkit::Hits().t({&one_t, 1}).normal(one_normal).instance({&one_instance, 1}));
    EXPECT_EQ(one_t, t[i]);
    EXPECT_TRUE(std::ranges::equal(one_normal, std::span(normal).subspan(3 * i, 3)));
    EXPECT_EQ(one_instance, instance[i]);
    scene.query(rays[i], nifkit::Answers().logit({&one_logit, 1}));
    EXPECT_EQ(one_logit, logit[i]);
  }
  EXPECT_GT(std::ranges::count(instance, NIF_NONE), 0);
  EXPECT_LT(std::ranges::count(instance, NIF_NONE), 99);
  // Arrays are checked for one ray, too.
  std::array<float, 2> too_short{};
  EXPECT_THROW(scene.intersect(rays[0], nifkit::Hits().normal(too_short)), nifkit::Error);
  EXPECT_THROW(scene.query(rays[0], nifkit::Answers().logit({})), nifkit::Error);
}

TEST_F(Wrapper, ListsOpenRays) {
  const format::AssetView& view = make(1);
  const nifkit::Device device;
  nifkit::Scene scene(device);
  const nifkit::Asset asset = nifkit::Asset::load(device, file_);
  scene.remove_instance(scene.add_instance(asset, 1));
  scene.add_instance(asset, 0);
  EXPECT_EQ(scene.add_instance(asset, 0), 1u);
  scene.remove_instance(0);
  scene.commit();
  Random random(3);
  const auto rays = random_rays(random, view.objects[0].as<kernels::SegmentField>(), 999);
  std::vector<uint8_t> certain(rays.size());
  scene.query(rays, nifkit::Answers().certain(certain));
  const auto uncertain = size_t(std::ranges::count(certain, 0));
  ASSERT_GT(uncertain, 1u);
  std::vector<uint32_t> numbers(rays.size()), instances(rays.size(), 7);
  std::vector<float> tmin(rays.size()), tmax(rays.size());
  const nifkit::Answers none;
  EXPECT_EQ(scene.query_open(rays, none, numbers, tmin, tmax), uncertain);
  for (size_t k = 0; k < uncertain; ++k) EXPECT_EQ(certain[numbers[k]], 0);
  EXPECT_EQ(scene.query_open(rays, none, numbers, tmin, tmax, std::span(instances).first(uncertain - 1)),
            uncertain);
  EXPECT_EQ(size_t(std::ranges::count(instances, 1u)), uncertain - 1);
  EXPECT_EQ(instances[uncertain - 1], 7u) << "the shortest list is the capacity";
}

TEST_F(Wrapper, Scratch) {
  make(1);
  const nifkit::Device device;
  nifkit::Scene scene(device);
  scene.add_asset(nifkit::Asset::load(device, file_));
  scene.commit();
  const std::vector<NifRay> rays(9, NifRay{{-9, 0, 0}, 0, {1, 0, 0}, 99});
  std::vector<uint8_t> visible(rays.size(), 7);
  EXPECT_EQ(scene.query_scratch_bytes(0), 0u);
  const uint64_t bytes = scene.query_scratch_bytes(rays.size());
  std::vector<std::byte> memory(bytes + 64);
  std::byte* const aligned = memory.data() + (64 - reinterpret_cast<uintptr_t>(memory.data()) % 64);
  scene.query(nifkit::Rays(rays).scratch({aligned, bytes}), nifkit::Answers().visible(visible));
  EXPECT_EQ(visible[8], scene.query(rays[8]));
  EXPECT_THROW(
      scene.query(nifkit::Rays(rays).scratch({aligned, bytes - 1}), nifkit::Answers().visible(visible)),
      nifkit::Error);
}

TEST_F(Wrapper, MovesManyInstances) {
  make(1);
  const nifkit::Device device;
  nifkit::Scene scene(device);
  const nifkit::Asset asset = nifkit::Asset::load(device, file_);
  for (uint32_t object : {0u, 1u, 0u}) scene.add_instance(asset, object);
  std::vector<nifkit::Transform> transforms(3, kIdentity);
  const auto x = [&](uint32_t instance) { return scene.instance(instance).transform[3]; };
  for (uint32_t i = 0; i < 3; ++i) transforms[i][3] = float(i + 1);
  scene.set_instance_transforms(transforms);
  EXPECT_EQ(std::vector({x(0), x(1), x(2)}), std::vector({1.f, 2.f, 3.f}));
  const std::array<uint32_t, 2> some{2, 0};
  scene.set_instance_transforms(some, std::span(transforms).first(2));
  EXPECT_EQ(std::vector({x(0), x(1), x(2)}), std::vector({2.f, 2.f, 1.f}));
  EXPECT_THROW(scene.set_instance_transforms(some, transforms), nifkit::Error);
  scene.set_instance_transforms({});
  transforms.resize(4, kIdentity);
  EXPECT_THROW(scene.set_instance_transforms(transforms), nifkit::Error);
}

TEST_F(Wrapper, ListsBackends) {
  EXPECT_STREQ(nifkit::backend(0).name, "cpu");
  EXPECT_EQ(nifkit::backend(0).available, 1u);
  EXPECT_THROW(nifkit::backend(99), nifkit::Error);
}

TEST_F(Wrapper, Throws) {
  const nifkit::Device device;
  try {
    nifkit::Asset::load(device, "nowhere.nif");
    FAIL();
  } catch (const nifkit::Error& error) {
    EXPECT_EQ(error.code(), NIF_ERROR_FILE_NOT_FOUND);
    EXPECT_STREQ(error.code_name(), "NIF_ERROR_FILE_NOT_FOUND");
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
