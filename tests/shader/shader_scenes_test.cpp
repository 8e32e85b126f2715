// Scenes of instances in one buffer are answered by a shader with the bits of nifQuery and nifQueryOpen.
#include <algorithm>
#include <cmath>
#include <functional>

#include "formats/nif/writer.hpp"
#include "kernels/shader/shader_tables.hpp"
#include "tests/runtime/open_answers.hpp"
#include "tests/shader/shader_fixture.hpp"
#include "tests/support/random_asset.hpp"
#include "tests/support/test_first_hits.hpp"
#include "tests/support/to_world.hpp"

namespace nif::test {
namespace {

/// Turned, scaled, perhaps mirrored or skewed, and moved by up to `far`.
Matrix random_placement(Random& random, float far) {
  Matrix matrix{};
  const float angle = random.between(0.0f, 6.28f), c = std::cos(angle), s = std::sin(angle);
  const uint32_t a = random.below(3), b = (a + 1) % 3;
  for (uint32_t i = 0; i < 3; ++i) matrix[5 * i] = 1;
  matrix[5 * a] = matrix[5 * b] = c;
  matrix[4 * a + b] = -s;
  matrix[4 * b + a] = s;
  const float scale = random.between(0.5f, 2.0f);
  for (uint32_t row = 0; row < 3; ++row)
    for (uint32_t column = 0; column < 3; ++column) matrix[4 * row + column] *= scale;
  if (random.below(4) == 0) std::for_each_n(matrix.begin(), 3, [](float& m) { m = -m; });
  if (random.below(4) == 0) matrix[1] += random.below(2) ? 0.5f : 30.0f;  // the latter leaves no proof
  if (random.below(8) == 0) matrix[10] *= 5000;                           // no proof survives this
  for (uint32_t row = 0; row < 3; ++row) matrix[4 * row + 3] = random.between(-far, far);
  return matrix;
}

class ShaderScenes : public ShaderTest {
 protected:
  void SetUp() override {
    ShaderTest::SetUp();
    file_ = format::encode(random_asset(11, {.objects = 2, .instances = 3, .proofs = 1, .features = 2}));
    view_ = std::make_unique<format::AssetView>(format::read_asset(file_, "test"));
    asset_ = nifkit::Asset::load(device_, std::span<const std::byte>(file_));
  }

  /// Rays near the instances, in world space; some are odd.
  std::vector<NifRay> rays_of(const std::vector<Matrix>& placements, size_t count) {
    std::vector<NifRay> rays = rays_near(*view_, 13, count);
    Random random(14);
    for (NifRay& ray : rays) {
      if (!placements.empty()) ray = to_world(ray, placements[random.below(uint32_t(placements.size()))]);
      if (random.below(8) == 0) ray.direction[random.below(3)] = random.below(2) ? 0.0f : -0.0f;
      if (random.below(100) == 0) ray.direction[random.below(3)] = 1e-39f;
      if (random.below(100) == 0) ray.origin[random.below(3)] = INFINITY;
      if (random.below(100) == 0) std::for_each_n(ray.direction, 3, [](float& d) { d *= 0x1p-70f; });
      if (random.below(20) == 0) ray.tmin = -INFINITY;
    }
    return rays;
  }

  /// In GLSL and in HLSL.
  void expect_equal(const nifkit::Scene& scene, const std::vector<NifRay>& rays,
                    uint32_t mask = 0xffffffffu) {
    for (const char* language : {"", "_hlsl"}) expect_equal_in(language, scene, rays, mask);
  }
  void expect_equal_in(const std::string& language, const nifkit::Scene& scene,
                       const std::vector<NifRay>& rays, uint32_t mask) {
    std::vector<kernels::Segment> segments;
    for (const NifRay& ray : rays) segments.push_back(to_segment(ray));
    const std::vector<uint32_t> words = scene.shader_tables();
    const auto shader = ask_shader(*vulkan_, shader_code("query_scene" + language), words, 0, segments, mask);
    Answers cpu(rays.size());
    NifRays query = nifMakeRays(rays.data(), rays.size());
    query.mask = &mask;
    const NifAnswers outputs = cpu.outputs();
    ASSERT_EQ(nifQuery(scene.get(), &query, &outputs), NIF_OK) << nifGetErrorMessage();
    size_t different = 0, probabilities = 0, occluded = 0, learned = 0;
    for (size_t i = 0; i < rays.size(); ++i) {
      different += shader[i].visible != cpu.visible[i] || shader[i].certain != cpu.certain[i] ||
                   shader[i].logit != cpu.logit[i];
      different += (shader[i].instance == NIF_NONE) != (cpu.visible[i] == 1);
      probabilities += !(std::abs(shader[i].probability - cpu.probability[i]) <= 1e-5f);
      occluded += !cpu.visible[i];
      learned += !cpu.certain[i];
    }
    EXPECT_EQ(different, 0u);
    EXPECT_EQ(probabilities, 0u);
    some_occluded_ += occluded;
    some_learned_ += learned;
    if (mask != 0xffffffffu) return;
    const auto proven = ask_shader(*vulkan_, shader_code("prove_scene" + language), words, 0, segments);
    const OpenAnswers open = query_open(scene.get(), rays, rays.size());
    size_t next = 0, intervals = 0;
    different = 0;
    for (uint32_t i = 0; i < rays.size(); ++i) {
      different += proven[i].visible != open.visible[i] || proven[i].certain != open.certain[i];
      if (next >= open.open.size() || open.open[next].ray != i) continue;
      intervals += proven[i].open_begin != open.open[next].tmin || proven[i].open_end != open.open[next].tmax;
      ++next;
    }
    EXPECT_EQ(different, 0u);
    EXPECT_EQ(intervals, 0u);
    EXPECT_EQ(next, open.count);
  }

  nifkit::Device device_{"shaders=on"};
  std::vector<std::byte> file_;
  std::unique_ptr<format::AssetView> view_;
  nifkit::Asset asset_;
  size_t some_occluded_ = 0, some_learned_ = 0;
};

TEST_F(ShaderScenes, OfManyInstancesAnswerAsTheCpu) {
  Random random(12);
  for (const float far : {3.0f, 40.0f, 3e4f}) {
    nifkit::Scene scene(device_);
    std::vector<Matrix> placements;
    for (uint32_t i = 0; i < 9; ++i) {
      placements.push_back(random_placement(random, far));
      scene.add_instance(asset_, i % 3, placements.back());
    }
    scene.add_instance(asset_, 0);  // not transformed
    placements.push_back(kIdentity);
    scene.set_instance_mask(3, 6);
    scene.set_instance_mask(4, 0);
    scene.set_instance_flags(5, NIF_INSTANCE_DISABLED);
    scene.commit();
    const std::vector<uint32_t> words = scene.shader_tables();
    EXPECT_EQ(words[kernels::shader::kInstanceCount], 8u);
    EXPECT_EQ(words[kernels::shader::kSceneWordCount], words.size());
    const std::vector<NifRay> rays = rays_of(placements, 6000);
    for (const uint32_t mask : {0xffffffffu, 2u, 0u}) {
      SCOPED_TRACE(mask);
      expect_equal(scene, rays, mask);
    }
  }
  EXPECT_GT(some_occluded_, 5000u);
  EXPECT_GT(some_learned_, 1000u);
}

TEST_F(ShaderScenes, OfOneInstanceAnswerAsTheCpu) {
  Random random(15);
  for (const bool turned : {false, true}) {
    const Matrix placement = turned ? random_placement(random, 5) : kIdentity;
    nifkit::Scene scene(device_);
    scene.add_instance(asset_, 0, placement);
    scene.commit();
    for (const uint32_t mask : {0xffffffffu, 0u}) expect_equal(scene, rays_of({placement}, 6000), mask);
  }
  EXPECT_GT(some_occluded_, 1000u);
}

TEST_F(ShaderScenes, FarFromZeroHaveRemainders) {
  nifkit::Scene scene(device_);
  // Where floats are 1/512 apart.
  constexpr float kFar = 3e4f;
  constexpr std::array<double, 3> kPlaces[] = {{4e6 + 1.0 / 3, -3e6 + 1.0 / 7, 1e6},
                                               {4e6 + 2, -3e6 + 0.1, 1e6}};
  for (const auto& place : kPlaces) scene.set_instance_origin(scene.add_instance(asset_, 0), place);
  constexpr std::array<double, 3> kCamera = {4e6 - double(kFar), -3e6 - double(kFar), 1e6};
  scene.set_origin(kCamera);
  scene.commit();
  expect_equal(scene, rays_of({Matrix{1, 0, 0, kFar, 0, 1, 0, kFar, 0, 0, 1, 0}}, 6000));
  EXPECT_GT(some_occluded_, 50u);
}

TEST_F(ShaderScenes, MayProveNothing) {
  const auto file =
      format::encode(random_asset(11, {.objects = 1, .instances = 0, .features = 2, .proves_nothing = true}));
  const nifkit::Asset other = nifkit::Asset::load(device_, std::span<const std::byte>(file));
  nifkit::Scene scene(device_);
  scene.add_instance(asset_, 0);
  constexpr Matrix kBeside{1, 0, 0, 2, 0, 1, 0, 0, 0, 0, 1, 0};
  scene.add_instance(other, 0, kBeside);
  scene.commit();
  EXPECT_EQ(scene.shader_tables()[kernels::shader::kSceneFlags], 0u);
  expect_equal(scene, rays_of({}, 4000));
}

TEST_F(ShaderScenes, MayBeEmpty) {
  nifkit::Scene scene(device_);
  scene.commit();
  EXPECT_EQ(scene.shader_tables().size(), size_t(kernels::shader::kSceneWords));
  expect_equal(scene, rays_of({}, 500));
}

/// Hundreds of instances, so that the tree over them has several levels.
TEST_F(ShaderScenes, OfHundredsOfInstancesAnswerAsTheCpu) {
  Random random(22);
  nifkit::Scene scene(device_);
  std::vector<Matrix> placements;
  for (uint32_t i = 0; i < 300; ++i) {
    placements.push_back(random_placement(random, 60));
    scene.add_instance(asset_, i % 3, placements.back());
  }
  for (const uint32_t gone : {3u, 77u, 299u}) scene.set_instance_flags(gone, NIF_INSTANCE_DISABLED);
  scene.commit();
  const std::vector<uint32_t> before = scene.shader_tables();
  expect_equal(scene, rays_of(placements, 6000));
  EXPECT_GT(some_occluded_, 1000u);

  // After some moved, only the words before the objects differ.
  for (const uint32_t moved : {0u, 5u, 250u})
    scene.set_instance_transform(moved, random_placement(random, 60));
  scene.commit();
  const std::vector<uint32_t> after = scene.shader_tables();
  ASSERT_EQ(after.size(), before.size());
  const uint32_t objects = before[kernels::shader::kObjects];
  EXPECT_LT(objects, before.size());
  EXPECT_FALSE(std::equal(before.begin(), before.begin() + objects, after.begin()));
  EXPECT_TRUE(std::equal(before.begin() + objects, before.end(), after.begin() + objects));
  expect_equal(scene, rays_of(placements, 2000));
}

/// Planes, networks and triangles together: what is certain is the CPU's.
TEST_F(ShaderScenes, MayHaveTriangles) {
  const auto file = format::encode(random_asset(
      31, {.objects = 1, .instances = 0, .bvhs = 2, .exacts = 1, .proofs = 1, .features = 2, .sources = 2}));
  const format::AssetView view = format::read_asset(file, "test");
  const nifkit::Asset asset = nifkit::Asset::load(device_, std::span<const std::byte>(file));
  Random random(32);
  size_t certain = 0, in_all = 0, first = 0, hits = 0;
  for (const float far : {2.0f, 30.0f, 1e4f}) {
    nifkit::Scene scene(device_), triangles(device_);
    std::vector<Matrix> placements;
    for (uint32_t i = 0; i < 40; ++i) {
      placements.push_back(random_placement(random, far));
      scene.add_instance(asset, i % 5, placements.back());
      triangles.add_instance(asset, i % 5 == 0 || i % 5 == 4 ? 1u : i % 5, placements.back());
    }
    scene.add_instance(asset, 1);
    triangles.add_instance(asset, 1);
    scene.commit();
    triangles.commit();
    std::vector<NifRay> rays = rays_near(view, 33, 6000);
    for (NifRay& ray : rays) {
      ray = to_world(ray, placements[random.below(uint32_t(placements.size()))]);
      if (random.below(50) == 0) ray.direction[random.below(3)] = 0;
      if (random.below(100) == 0) ray.origin[random.below(3)] = INFINITY;
    }
    std::vector<kernels::Segment> segments;
    for (const NifRay& ray : rays) segments.push_back(to_segment(ray));
    const NifRays query = nifMakeRays(rays.data(), rays.size());
    for (const nifkit::Scene* each : {&scene, &triangles}) {
      const std::vector<uint32_t> words = each->shader_tables();
      Answers cpu(rays.size());
      const NifAnswers outputs = cpu.outputs();
      ASSERT_EQ(nifQuery(each->get(), &query, &outputs), NIF_OK) << nifGetErrorMessage();
      FirstHits cpu_hits(rays.size());
      const NifHits hit_outputs = cpu_hits.outputs();
      ASSERT_EQ(nifIntersect(each->get(), &query, &hit_outputs), NIF_OK) << nifGetErrorMessage();
      for (const bool rough : {false, true}) {
        if (rough && each == &scene) continue;  // the planes of random objects are of no surface
        const auto answers =
            ask_shader(*vulkan_, shader_code(rough ? "rough_scene" : "query_scene"), words, 0, segments);
        const auto shader_hits =
            hits_of_shader(*vulkan_, shader_code(rough ? "hits_rough_scene" : "hits_scene"), words, segments);
        size_t wrong = 0, wrong_hits = 0;
        for (size_t i = 0; i < rays.size(); ++i) {
          wrong += answers[i].certain && answers[i].visible != cpu.visible[i];
          const ShaderHit& hit = shader_hits[i];
          wrong_hits += hit.certain && hit.hit != cpu_hits.hit[i];
          if (hit.certain && hit.hit)
            wrong_hits += hit.triangle != cpu_hits.triangle[i] || hit.instance != cpu_hits.instance[i];
          certain += answers[i].certain;
          first += hit.certain;
          hits += hit.certain && hit.hit;
        }
        in_all += rays.size();
        EXPECT_EQ(wrong, 0u) << far << ' ' << rough;
        EXPECT_EQ(wrong_hits, 0u) << far << ' ' << rough;
      }
    }
  }
  EXPECT_GT(certain, in_all / 3);
  EXPECT_GT(first, in_all / 4);
  EXPECT_GT(hits, in_all / 20);
}

TEST_F(ShaderScenes, ThatMovedAreWrittenWithoutTheirObjects) {
  Random random(4);
  const auto file = format::encode(random_asset(
      4, {.objects = 1, .instances = 0, .bvhs = 1, .exacts = 1, .proofs = 1, .features = 2, .sources = 1}));
  const nifkit::Asset asset = nifkit::Asset::load(device_, std::span<const std::byte>(file));
  nifkit::Scene scene(device_);
  for (uint32_t i = 0; i < 13; ++i) scene.add_instance(asset, i % 4, random_placement(random, 10));
  scene.commit();
  const std::vector<uint32_t> before = scene.shader_tables();
  const uint32_t moving = before[kernels::shader::kObjects];
  for (uint32_t i = 0; i < 13; ++i) scene.set_instance_transform(i, random_placement(random, 10));
  scene.commit();

  std::vector<uint32_t> moved = before;
  uint64_t count = 0;
  for (const uint64_t capacity :
       {uint64_t{0}, uint64_t{moving} - 1, uint64_t{moving} + 1, before.size() - 1}) {
    EXPECT_EQ(nifGetSceneShaderTables(scene.get(), moved.data(), capacity, &count),
              NIF_ERROR_INVALID_ARGUMENT);
    EXPECT_EQ(moved, before);
  }
  ASSERT_EQ(nifGetSceneShaderTables(scene.get(), moved.data(), moving, &count), NIF_OK)
      << nifGetErrorMessage();
  EXPECT_EQ(count, before.size());
  EXPECT_NE(moved, before);
  EXPECT_TRUE(std::equal(moved.begin() + moving, moved.end(), before.begin() + moving));
  EXPECT_EQ(moved, scene.shader_tables());
}

TEST_F(ShaderScenes, AreRefusedInASentence) {
  nifkit::Scene scene(device_);
  uint64_t count = 7;
  EXPECT_EQ(nifGetSceneShaderTables(scene.get(), nullptr, 0, &count), NIF_ERROR_INVALID_OPERATION);
  EXPECT_STREQ(nifGetErrorMessage(), "the scene has changes that are not committed");
  const auto file = format::encode(random_asset(1, {.objects = 0, .instances = 0, .cutouts = 1}));
  scene.add_instance(nifkit::Asset::load(device_, std::span<const std::byte>(file)), 0);
  scene.commit();
  EXPECT_EQ(nifGetSceneShaderTables(scene.get(), nullptr, 0, &count), NIF_ERROR_NOT_AVAILABLE);
  EXPECT_NE(std::string(nifGetErrorMessage()).find("has the encoding 'cutout'"), std::string::npos);
  EXPECT_EQ(count, 7u);
  EXPECT_EQ(nifGetSceneShaderTables(scene.get(), nullptr, 0, nullptr), NIF_ERROR_INVALID_ARGUMENT);
  EXPECT_EQ(nifGetSceneShaderTables(nullptr, nullptr, 0, &count), NIF_ERROR_INVALID_ARGUMENT);
}

}  // namespace
}  // namespace nif::test
