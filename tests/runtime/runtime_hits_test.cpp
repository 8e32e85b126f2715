// nifIntersect: first hits of scenes are those of their objects, and agree with nifQuery.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>

#include "kernels/reference/planes/voxel_colors.hpp"
#include "kernels/reference/scene_hit.hpp"
#include "tests/runtime/open_answers.hpp"
#include "tests/runtime/runtime_first_hits.hpp"
#include "tests/runtime/runtime_fixture.hpp"
#include "tests/support/plain_scene.hpp"

namespace nif::test {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr RandomAssetOptions kHitEncodings{.objects = 2,
                                           .instances = 0,
                                           .bvhs = 2,
                                           .sphericals = 1,
                                           .exacts = 2,
                                           .proofs = 1,
                                           .cutouts = 1,
                                           .colors = 3,
                                           .sources = 3};

struct Placed {
  uint32_t object;
  Matrix transform;
};

/// The hit as the simplest program would find it: tests every instance, the last one first.
kernels::SceneHit plain_hit(const format::AssetView& view, const std::vector<Placed>& instances,
                            const NifRay& asked) {
  const kernels::Segment ray = to_segment(asked);
  kernels::BoxRay box_ray;
  const bool askable = kernels::prepare_box_ray(ray, box_ray);
  kernels::SceneHit nearest;
  if (!askable && instances.size() > 1) {
    if (!(ray.tmin > ray.tmax)) kernels::forget_proof(nearest);
    return nearest;
  }
  for (auto i = uint32_t(instances.size()); i-- > 0;) {
    const auto& [object, transform] = instances[i];
    const kernels::AnyField field = format::field_of(view.objects[object]);
    const auto box = kernels::world_box(kernels::object_box(field), transform.data());
    if (instances.size() > 1 && !kernels::may_meet(box, ray, box_ray)) continue;
    kernels::WorldToObject to_object;
    bool good;
    EXPECT_TRUE(kernels::invert(transform.data(), to_object, good));
    const bool identity = transform == kIdentity;
    const kernels::Segment local = identity ? ray : kernels::to_object(to_object, ray);
    kernels::Hit hit = kernels::intersect(field, local);
    if (!identity && !(ray.tmin > ray.tmax) &&
        !(good && kernels::stays_certain(to_object, kernels::reach_scale(field), ray, local)))
      kernels::forget_proof(hit);
    if (instances.size() > 1) kernels::begin_in_box(hit, kernels::pass_box(box, ray, box_ray).enter);
    nearest.add(hit, i);
  }
  if (nearest.triangle == kernels::kNoTriangle) return nearest;
  const auto* source = view.numbers_of(instances[nearest.instance].object, format::kSourceTriangles);
  if (source) nearest.triangle = kernels::source_triangle(source->field, nearest.triangle);
  return nearest;
}

/// The details of that hit, if there is one.
std::array<float, 3> plain_color(const format::AssetView& view, const std::vector<Placed>& instances,
                                 const NifRay& asked, const kernels::SceneHit& hit) {
  float color[3] = {};
  if (hit.instance == kernels::kNoInstance) return std::to_array(color);
  const auto& [object, transform] = instances[hit.instance];
  kernels::WorldToObject to_object;
  bool good;
  EXPECT_TRUE(kernels::invert(transform.data(), to_object, good));
  const kernels::Segment ray = to_segment(asked);
  const auto* colors = view.colors_of(object);
  kernels::color_at({format::grid_of(view.objects[object]), colors ? colors->values : nullptr},
                    transform == kIdentity ? ray : kernels::to_object(to_object, ray), hit.t, color);
  return std::to_array(color);
}

TEST_F(RuntimeTest, FirstHitsAreTheNearestOfAllInstances) {
  uint64_t met = 0, several = 0, coloured = 0;
  for (uint64_t seed = 0; seed < 6; ++seed) {
    const format::AssetView& view = make(seed, kHitEncodings);
    const NifAsset asset = load();
    Random random(seed);
    std::vector<std::vector<Placed>> scenes;
    for (uint32_t object = 0; object < view.objects.size(); ++object) {
      scenes.push_back({{object, kIdentity}});
      scenes.push_back({{object, random_transform(random, 2)}});
    }
    for (const size_t count : {2u, 9u, 40u}) {
      scenes.emplace_back();
      for (size_t i = 0; i < count; ++i)
        scenes.back().push_back({random.below(uint32_t(view.objects.size())), random_transform(random, 3)});
      scenes.back().push_back(scenes.back().front());  // at the same t
    }
    const std::vector<NifRay> rays = rays_near(view, seed, 1500);
    for (const std::vector<Placed>& instances : scenes) {
      const NifScene scene = new_scene();
      for (const Placed& placed : instances)
        ASSERT_EQ(nifAddInstance(scene, asset, placed.object, placed.transform.data(), nullptr), NIF_OK);
      ASSERT_EQ(nifCommitScene(scene), NIF_OK);
      const FirstHits hits = intersect_all(scene, rays);
      const Answers answers = query_all(scene, rays);
      for (size_t i = 0; i < rays.size(); ++i) {
        SCOPED_TRACE(std::to_string(instances.size()) + " instances, ray " + std::to_string(i));
        const kernels::SceneHit expected = plain_hit(view, instances, rays[i]);
        ASSERT_EQ(hits.hit[i], answers.visible[i] ? 0 : 1);
        ASSERT_EQ(hits.certain[i], answers.certain[i]);
        ASSERT_EQ(hits.t[i], expected.t);
        ASSERT_EQ(hits.low[i], expected.low);
        ASSERT_EQ(hits.high[i], expected.high);
        ASSERT_EQ(hits.instance[i], expected.instance);
        ASSERT_EQ(hits.triangle[i], expected.triangle);
        const std::array<float, 3> color = plain_color(view, instances, rays[i], expected);
        for (size_t c = 0; c < 3; ++c) ASSERT_EQ(hits.color[3 * i + c], color[c]);
        coloured +=
            hits.hit[i] && color != std::array{kernels::kNoColor, kernels::kNoColor, kernels::kNoColor};
        ASSERT_EQ(hits.u[i], expected.u);
        ASSERT_EQ(hits.v[i], expected.v);
        const float* normal = &hits.normal[3 * i];
        const float square = normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2];
        if (!hits.hit[i]) {
          ASSERT_EQ(hits.t[i], kInfinity);
          ASSERT_EQ(hits.object[i], NIF_NONE);
          ASSERT_EQ(square, 0);
          continue;
        }
        ++met;
        several += hits.instance[i] != 0;
        ASSERT_EQ(hits.object[i], instances[hits.instance[i]].object);
        ASSERT_TRUE(std::isfinite(hits.t[i]));
        ASSERT_TRUE(rays[i].tmin <= hits.t[i] && hits.t[i] <= rays[i].tmax);
        ASSERT_TRUE(hits.low[i] <= hits.t[i] && hits.t[i] <= hits.high[i]);
        ASSERT_NEAR(square, 1, 1e-5f);
        const float* d = rays[i].direction;
        ASSERT_LE(normal[0] * d[0] + normal[1] * d[1] + normal[2] * d[2],
                  1e-5f * (std::abs(d[0]) + std::abs(d[1]) + std::abs(d[2])));
      }
    }
  }
  EXPECT_GT(met, 10'000u);
  EXPECT_GT(several, 1000u);
  EXPECT_GT(coloured, 1000u);
  EXPECT_LT(coloured, met);
}

TEST_F(RuntimeTest, FirstHitsDoNotDependOnThreadsOrInstructions) {
  const format::AssetView& view = make(9, kHitEncodings);
  const auto rays = rays_near(view, 9, 10'000);
  std::optional<FirstHits> first;
  for (const char* config :
       {"threads=1,isa=scalar", "threads=3", "threads=1,isa=sse4", "threads=1,isa=avx2",
        "threads=2,isa=avx512", "threads=1,isa=neon", "memory=least", "memory=least,isa=avx2"}) {
    NifDevice device = nullptr;
    if (nifNewDevice(config, nullptr, &device) == NIF_ERROR_NOT_AVAILABLE) continue;
    SCOPED_TRACE(config);
    NifAsset asset = nullptr;
    ASSERT_EQ(nifLoadAssetMemory(device, file_.data(), file_.size(), NIF_LOAD_COPY, &asset), NIF_OK);
    NifScene scene = nullptr;
    ASSERT_EQ(nifNewScene(device, &scene), NIF_OK);
    ASSERT_EQ(nifAddAsset(scene, asset, nullptr, nullptr, nullptr), NIF_OK);
    ASSERT_EQ(nifCommitScene(scene), NIF_OK);
    const FirstHits hits = intersect_all(scene, rays);
    if (!first) first = hits;
    EXPECT_TRUE(hits == *first);

    FirstHits later(rays.size());
    const NifRays query = nifMakeRays(rays.data(), rays.size());
    const NifHits outputs = later.outputs();
    NifJob job = nullptr;
    ASSERT_EQ(nifIntersectAsync(scene, &query, &outputs, &job), NIF_OK) << nifGetErrorMessage();
    ASSERT_EQ(nifWaitJob(job), NIF_OK);
    EXPECT_TRUE(later == *first);
    nifReleaseJob(job);
    nifReleaseScene(scene);
    nifReleaseAsset(asset);
    nifReleaseDevice(device);
  }
}

TEST_F(RuntimeTest, FirstHitsOneOutputAtATime) {
  const format::AssetView& view = make(4, kHitEncodings);
  const auto rays = rays_near(view, 4, 3000);
  const NifScene scene = new_scene();
  ASSERT_EQ(nifAddAsset(scene, load(), nullptr, nullptr, nullptr), NIF_OK);
  ASSERT_EQ(nifCommitScene(scene), NIF_OK);
  const FirstHits all = intersect_all(scene, rays);
  const NifRays query = nifMakeRays(rays.data(), rays.size());
  const auto alone = [&](auto NifHits::*member, const auto& expected) {
    auto array = expected;
    std::fill(array.begin(), array.end(), typename std::decay_t<decltype(array)>::value_type{});
    NifHits hits{};
    hits.struct_size = sizeof(hits);
    hits.*member = array.data();
    ASSERT_EQ(nifIntersect(scene, &query, &hits), NIF_OK);
    EXPECT_EQ(array, expected);
  };
  alone(&NifHits::hit, all.hit);
  alone(&NifHits::certain, all.certain);
  alone(&NifHits::t, all.t);
  alone(&NifHits::t_low, all.low);
  alone(&NifHits::t_high, all.high);
  alone(&NifHits::normal, all.normal);
  alone(&NifHits::u, all.u);
  alone(&NifHits::v, all.v);
  alone(&NifHits::instance, all.instance);
  alone(&NifHits::object, all.object);
  alone(&NifHits::triangle, all.triangle);
  alone(&NifHits::color, all.color);
  alone(&NifHits::user, all.user);
}

TEST_F(RuntimeTest, FirstHitsOfAnEmptySceneAndOfNoRays) {
  const NifScene scene = new_scene();
  ASSERT_EQ(nifCommitScene(scene), NIF_OK);
  const FirstHits hits = intersect_all(scene, {{{0, 0, 0}, 0, {1, 0, 0}, 1}});
  EXPECT_EQ(hits.hit[0], 0);
  EXPECT_EQ(hits.certain[0], 1);
  EXPECT_EQ(hits.instance[0], NIF_NONE);
  EXPECT_EQ(hits.low[0], kInfinity);
  intersect_all(scene, {});
}

TEST_F(RuntimeTest, FirstHitsRefuseWhatIsWrong) {
  make(1, kHitEncodings);
  const NifScene scene = scene_of(load(), 0);
  const std::vector<NifRay> rays(5, NifRay{{0, 0, 0}, 0, {1, 0, 0}, 1});
  FirstHits arrays(rays.size());
  NifRays query = nifMakeRays(rays.data(), rays.size());
  NifHits hits = arrays.outputs();
  const auto refused = [&](const char* because, NifError error = NIF_ERROR_INVALID_ARGUMENT) {
    EXPECT_EQ(nifIntersect(scene, &query, &hits), error);
    EXPECT_NE(std::strstr(nifGetErrorMessage(), because), nullptr) << nifGetErrorMessage();
  };
  EXPECT_EQ(nifIntersect(scene, &query, nullptr), NIF_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(nifIntersect(scene, nullptr, &hits), NIF_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(nifIntersectAsync(scene, &query, &hits, nullptr), NIF_ERROR_INVALID_ARGUMENT);
  hits.struct_size = 3;
  refused("struct_size");
  hits.struct_size = offsetof(NifHits, user);
  refused("struct_size");
  hits = {};
  hits.struct_size = sizeof(hits);
  refused("all outputs are null");
  hits = arrays.outputs();
  query.memory = NIF_MEMORY_DEVICE;
  refused("device memory", NIF_ERROR_NOT_AVAILABLE);
  query.memory = NIF_MEMORY_HOST;
  query.direction[1] = nullptr;
  refused("direction");
  query = nifMakeRays(rays.data(), rays.size());
  EXPECT_EQ(nifIntersect(scene, &query, &hits), NIF_OK);
  const NifScene changed = new_scene();
  EXPECT_EQ(nifIntersect(changed, &query, &hits), NIF_ERROR_INVALID_OPERATION);
}

}  // namespace
}  // namespace nif::test
