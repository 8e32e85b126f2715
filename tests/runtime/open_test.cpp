// nifQueryOpen: proven rays are answered as usual, and the others are listed, with the interval that matters.
#include <algorithm>
#include <cmath>
#include <limits>

#include "formats/nif/parts.hpp"
#include "kernels/reference/encodings/reference_exact.hpp"
#include "kernels/reference/instance.hpp"
#include "tests/runtime/open_answers.hpp"
#include "tests/support/query_object.hpp"
#include "tests/support/random_exact.hpp"

namespace nif::test {
namespace {

bool is_ray(const NifRay& ray) {
  const kernels::Segment segment = to_segment(ray);
  kernels::BoxRay prepared;
  return kernels::prepare_box_ray(segment, prepared);
}

constexpr RandomAssetOptions kAllEncodings{
    .objects = 2, .instances = 0, .bvhs = 1, .sphericals = 1, .exacts = 1, .proofs = 2, .cutouts = 1};

TEST_F(RuntimeTest, OpenRaysAreThoseThatAreNotCertain) {
  for (uint64_t seed = 0; seed < 4; ++seed) {
    const format::AssetView& view = make(seed, kAllEncodings);
    const NifAsset asset = load();
    const auto rays = rays_near(view, seed, 5001);
    std::vector<NifScene> scenes;
    for (uint32_t object = 0; object < view.objects.size(); ++object)
      scenes.push_back(scene_of(asset, object));
    Random random(seed);
    scenes.push_back(new_scene());
    for (int i = 0; i < 7; ++i) {
      std::array<float, 12> transform = kIdentity;
      for (size_t k = 0; k < 12; ++k) transform[k] += random.between(-0.3f, 0.3f);
      const auto object = random.below(uint32_t(view.objects.size()));
      ASSERT_EQ(nifAddInstance(scenes.back(), asset, object, transform.data(), nullptr), NIF_OK);
    }
    ASSERT_EQ(nifCommitScene(scenes.back()), NIF_OK);
    size_t listed = 0, narrowed = 0;
    for (const NifScene scene : scenes) {
      const Answers plain = query_all(scene, rays);
      const OpenAnswers open = query_open(scene, rays, rays.size());
      ASSERT_EQ(open.count, open.open.size());
      std::vector<const OpenRay*> of(rays.size());
      for (const OpenRay& ray : open.open) {
        ASSERT_LT(ray.ray, rays.size());
        ASSERT_EQ(of[ray.ray], nullptr) << "listed twice";
        of[ray.ray] = &ray;
      }
      for (size_t i = 0; i < rays.size(); ++i) {
        ASSERT_EQ(of[i] != nullptr, !plain.certain[i] && is_ray(rays[i])) << i;
        ASSERT_EQ(open.bits[i / 8] >> (i % 8) & 1, open.visible[i]);
        if (!of[i]) {
          ASSERT_EQ(open.visible[i], plain.visible[i]);
          ASSERT_EQ(open.certain[i], plain.certain[i]);
          continue;
        }
        ASSERT_EQ(open.visible[i], 0);
        ASSERT_EQ(open.certain[i], 0);
        ASSERT_EQ(open.probability[i], 0.5f);
        ASSERT_EQ(open.logit[i], -1);
        ASSERT_TRUE(rays[i].tmin <= of[i]->tmin && of[i]->tmin <= of[i]->tmax && of[i]->tmax <= rays[i].tmax)
            << of[i]->tmin << ' ' << of[i]->tmax;
        ++listed;
        narrowed += rays[i].tmin < of[i]->tmin && of[i]->tmax < rays[i].tmax;
      }
    }
    EXPECT_GT(listed, 1000u);
    EXPECT_GT(narrowed, 300u);
  }
}

TEST_F(RuntimeTest, OpenRaysDoNotDependOnThreadsOrInstructions) {
  const format::AssetView& view = make(9, kAllEncodings);
  const auto rays = rays_near(view, 9, 20'000);
  std::optional<OpenAnswers> first;
  for (const char* config :
       {"threads=1,isa=scalar", "threads=3", "threads=1,isa=sse4", "threads=1,isa=avx2",
        "threads=2,isa=avx512", "threads=1,isa=neon", "memory=least", "memory=least,isa=sse4"}) {
    NifDevice device = nullptr;
    if (nifNewDevice(config, nullptr, &device) == NIF_ERROR_NOT_AVAILABLE) continue;
    SCOPED_TRACE(config);
    NifAsset asset = nullptr;
    ASSERT_EQ(nifLoadAssetMemory(device, file_.data(), file_.size(), NIF_LOAD_COPY, &asset), NIF_OK);
    NifScene scene = nullptr;
    ASSERT_EQ(nifNewScene(device, &scene), NIF_OK);
    ASSERT_EQ(nifAddAsset(scene, asset, nullptr, nullptr, nullptr), NIF_OK);
    ASSERT_EQ(nifCommitScene(scene), NIF_OK);
    const OpenAnswers open = query_open(scene, rays, rays.size());
    if (!first) first = open;
    EXPECT_EQ(open.visible, first->visible);
    EXPECT_EQ(open.certain, first->certain);
    EXPECT_TRUE(open.open == first->open);
    nifReleaseScene(scene);
    nifReleaseAsset(asset);
    nifReleaseDevice(device);
  }
}

TEST_F(RuntimeTest, OpenRaysAreCountedWhereThereIsNoRoom) {
  const format::AssetView& view = make(3, {.objects = 0, .instances = 0, .proofs = 1});
  const NifScene scene = scene_of(load(), 0);
  const auto rays = rays_near(view, 3, 5000);
  const OpenAnswers all = query_open(scene, rays, rays.size());
  ASSERT_GT(all.count, 100u);
  for (const size_t capacity : {size_t{0}, size_t{1}, size_t{100}, size_t{all.count}}) {
    const OpenAnswers some = query_open(scene, rays, capacity);
    EXPECT_EQ(some.count, all.count);
    EXPECT_EQ(some.open.size(), capacity);
    for (const OpenRay& ray : some.open)
      EXPECT_TRUE(std::binary_search(all.open.begin(), all.open.end(), ray)) << ray.ray;
    EXPECT_EQ(some.visible, all.visible);
  }
}

/// Whatever blocks an open ray does so in the listed interval.
TEST(OpenParts, HaveAllThatTrianglesCanBlock) {
  uint64_t open = 0, blocked = 0;
  for (uint64_t seed = 0; seed < 200; ++seed) {
    Random random(seed);
    const RandomExact data = random_exact(random, 9);
    const kernels::ExactField field = data.field();
    for (int i = 0; i < 500; ++i) {
      const kernels::Segment segment = random_segment(random, field);
      kernels::OpenInterval part;
      const kernels::Answer answer = kernels::prove(field.planes, segment, part);
      const bool visible = kernels::query(field.triangles, segment).visible;
      if (answer.certain) {
        ASSERT_EQ(answer.visible, visible);
        continue;
      }
      kernels::Segment narrowed = segment;
      narrowed.tmin = part.begin;
      narrowed.tmax = part.end;
      ASSERT_EQ(kernels::query(field.triangles, narrowed).visible, visible);
      ++open;
      blocked += !visible;
    }
  }
  EXPECT_GT(open, 10'000u);
  EXPECT_GT(blocked, 1'000u);
}

TEST_F(RuntimeTest, OpenQueriesOfWrongArgumentsAreRefused) {
  make(3, {.objects = 0, .instances = 0, .proofs = 1});
  const NifScene scene = scene_of(load(), 0), uncommitted = new_scene();
  const NifRay ray{};
  NifRays query = nifMakeRays(&ray, 1);
  const auto outputs = nifkit::sized<NifAnswers>();
  uint32_t number = 0, count[2] = {};
  NifOpenRays open{};
  open.struct_size = sizeof(open);
  open.capacity = 1;
  open.rays = &number;
  open.count = count;
  EXPECT_EQ(nifQueryOpen(scene, &query, &outputs, &open), NIF_OK) << "no outputs, and no tmin and tmax";
  const auto refused = [&](NifError error, const NifRays& asked, const NifOpenRays& lists) {
    EXPECT_EQ(nifQueryOpen(scene, &asked, &outputs, &lists), error) << nifGetErrorMessage();
  };
  NifOpenRays wrong = open;
  wrong.count = nullptr;
  refused(NIF_ERROR_INVALID_ARGUMENT, query, wrong);
  wrong.count = reinterpret_cast<uint32_t*>(reinterpret_cast<char*>(count) + 1);
  refused(NIF_ERROR_INVALID_ARGUMENT, query, wrong);
  wrong = open;
  wrong.rays = nullptr;
  refused(NIF_ERROR_INVALID_ARGUMENT, query, wrong);
  wrong.capacity = 0;
  refused(NIF_OK, query, wrong);
  wrong.struct_size = 0;
  refused(NIF_ERROR_INVALID_ARGUMENT, query, wrong);
  NifRays more = query;
  more.count = uint64_t{1} << 32;
  refused(NIF_ERROR_INVALID_ARGUMENT, more, open);
  more = query;
  more.memory = NIF_MEMORY_DEVICE;
  refused(NIF_ERROR_NOT_AVAILABLE, more, open);
  EXPECT_EQ(nifQueryOpen(scene, &query, nullptr, &open), NIF_OK) << "no answers at all";
  EXPECT_EQ(nifQueryOpen(scene, nullptr, &outputs, &open), NIF_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(nifQueryOpen(scene, &query, &outputs, nullptr), NIF_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(nifQueryOpen(nullptr, &query, &outputs, &open), NIF_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(nifQueryOpen(uncommitted, &query, &outputs, &open), NIF_ERROR_INVALID_OPERATION);
  query.count = 0;
  count[0] = 7;
  EXPECT_EQ(nifQueryOpen(scene, &query, &outputs, &open), NIF_OK);
  EXPECT_EQ(count[0], 0u);
}

}  // namespace
}  // namespace nif::test
