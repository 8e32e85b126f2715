// Instances: transforms map rays to object space, and several answers are combined as nif.h says.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "tests/runtime/runtime_fixture.hpp"
#include "tests/support/plain_scene.hpp"

namespace nif::test {
namespace {

class Scenes : public RuntimeTest {};

TEST_F(Scenes, TransformsKeepAnswers) {
  // Exact in binary floating point: scaling by powers of two, mirrors, quarter turns.
  const Matrix transforms[] = {{2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0},        // uniform
                               {0.5f, 0, 0, 0, 0, 4, 0, 0, 0, 0, 2, 0},     // not
                               {-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0},       // mirror
                               {0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1, 0},       // quarter turn
                               {0, 0, -8, 0, 0.25f, 0, 0, 0, 0, 1, 0, 0}};  // all of it
  for (uint64_t seed = 0; seed < 4; ++seed) {
    const format::AssetView& view = make(seed);
    const NifAsset asset = load();
    Random random(seed);
    const auto rays = random_rays(random, view.objects[0].as<kernels::SegmentField>(), 1000);
    const Answers plain = query_all(scene_of(asset, 0), rays);
    for (const Matrix& transform : transforms) {
      std::vector<NifRay> world;
      for (const NifRay& ray : rays) world.push_back(to_world(ray, transform));
      const Answers answers = query_all(scene_of(asset, 0, transform.data()), world);
      EXPECT_EQ(answers.visible, plain.visible);
      EXPECT_EQ(answers.logit, plain.logit);
      EXPECT_EQ(answers.certain, plain.certain);
    }
  }
}

TEST_F(Scenes, GeneralTransformsAlmostKeepAnswers) {
  uint64_t different = 0, certain = 0, asked = 0;
  for (uint64_t seed = 0; seed < 10; ++seed) {
    const format::AssetView& view = make(seed);
    const NifAsset asset = load();
    Random random(seed);
    Matrix transform = kIdentity;
    for (size_t k = 0; k < 12; ++k) transform[k] += random.between(-0.4f, 0.4f) + (k % 4 == 3 ? 50.0f : 0.0f);
    const auto rays = random_rays(random, view.objects[1].as<kernels::SegmentField>(), 1000);
    std::vector<NifRay> world;
    for (const NifRay& ray : rays) world.push_back(to_world(ray, transform));
    const Answers plain = query_all(scene_of(asset, 1), rays);
    const Answers answers = query_all(scene_of(asset, 1, transform.data()), world);
    for (size_t i = 0; i < rays.size(); ++i) {
      ++asked;
      certain += answers.certain[i];
      different += answers.visible[i] != plain.visible[i];
    }
  }
  EXPECT_LT(different, asked / 20);  // random features and networks are far from smooth
  EXPECT_GT(certain, asked / 4);
}

TEST_F(Scenes, NothingIsCertainWherePrecisionIsLost) {
  const format::AssetView& view = make(3);
  const NifAsset asset = load();
  Random random(3);
  const auto rays = random_rays(random, view.objects[0].as<kernels::SegmentField>(), 500);
  const auto certain_with = [&](const Matrix& transform, const Matrix& of_rays) {
    std::vector<NifRay> world;
    for (const NifRay& ray : rays) world.push_back(to_world(ray, of_rays));
    const Answers answers = query_all(scene_of(asset, 0, transform.data()), world);
    return std::count(answers.certain.begin(), answers.certain.end(), 1);
  };
  const auto before = certain_with(kIdentity, kIdentity);
  EXPECT_GT(before, 0);
  // Far from the world's origin, together with the instance: as precise as near it.
  const Matrix far{1, 0, 0, 1024, 0, 1, 0, 0, 0, 0, 1, 0};
  EXPECT_GT(certain_with(far, far), before / 2);
  // Rays from far away, a needle, a nearly singular matrix: an answer, but not a certain one.
  const Matrix away{1, 0, 0, 1e6f, 0, 1, 0, 0, 0, 0, 1, 0}, needle{1e4f, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0},
      skewed{1, 1, 0, 0, 1, 1.0000005f, 0, 0, 0, 0, 1, 0};
  for (const Matrix& bad : {needle, skewed}) EXPECT_EQ(certain_with(bad, kIdentity), 0);
  EXPECT_EQ(certain_with(far, away), 0);
}

TEST_F(Scenes, SeveralInstancesCombine) {
  uint64_t mixed = 0;
  for (uint64_t seed = 0; seed < 10; ++seed) {
    const format::AssetView& view = make(seed);
    const NifAsset asset = load();
    const NifScene whole = new_scene();
    std::vector<NifScene> single;
    for (uint32_t object = 0; object < view.objects.size(); ++object) {
      // All in the same position and of about the same size, so that many rays meet several.
      const kernels::SegmentField &field = view.objects[object].as<kernels::SegmentField>(),
                                  &first = view.objects[0].as<kernels::SegmentField>();
      const float scale = std::exp2(std::round(std::log2(field.voxels_per_unit / first.voxels_per_unit)));
      const Matrix transform{scale, 0,     0,     first.origin[0] - scale * field.origin[0],
                             0,     scale, 0,     first.origin[1] - scale * field.origin[1],
                             0,     0,     scale, first.origin[2] - scale * field.origin[2]};
      ASSERT_EQ(nifAddInstance(whole, asset, object, transform.data(), nullptr), NIF_OK);
      single.push_back(scene_of(asset, object, transform.data()));
    }
    ASSERT_EQ(nifCommitScene(whole), NIF_OK);
    Random random(seed);
    const auto rays = random_rays(random, view.objects[0].as<kernels::SegmentField>(), 500);
    const Answers answers = query_all(whole, rays);
    std::vector<Answers> alone;
    for (const NifScene scene : single) alone.push_back(query_all(scene, rays));
    for (size_t i = 0; i < rays.size(); ++i) {
      bool visible = true, all_certain = true, certainly_occluded = false;
      int32_t logit = NIF_LOGIT_CERTAIN;
      float probability = 1;
      for (const Answers& one : alone) {
        visible = visible && one.visible[i];
        all_certain = all_certain && one.certain[i];
        certainly_occluded = certainly_occluded || (one.certain[i] && !one.visible[i]);
        logit = std::min(logit, one.logit[i]);
        probability *= one.probability[i];
      }
      ASSERT_EQ(answers.visible[i], visible);
      ASSERT_EQ(answers.certain[i], certainly_occluded || (visible && all_certain));
      ASSERT_EQ(answers.logit[i], logit);
      // A single factor may be too small for a float, so the product is not computed in floats.
      if (probability < std::numeric_limits<float>::min()) {
        ASSERT_LT(answers.probability[i], std::numeric_limits<float>::min());
      } else {
        ASSERT_FLOAT_EQ(answers.probability[i], probability);
      }
      if (certainly_occluded) {
        ASSERT_EQ(answers.probability[i], 0.0f);
      }
      mixed += certainly_occluded && !all_certain;
    }
  }
  EXPECT_GT(mixed, 0u);
}

/// The walls of boxes are outside their objects. A ray along a wall misses whatever the other axes say. So it also misses all boxes inside, and a hierarchy changes nothing.
TEST(BoxRule, ARayAlongAWallMisses) {
  const kernels::WorldBox box{{-1, -2, -3}, {1, 2, 3}};
  for (size_t along = 0; along < 3; ++along)
    for (const float zero : {0.0f, -0.0f, 0x1p-130f})
      for (const float end : {1e30f, INFINITY})
        for (const float way : {1.0f, -1.0f})
          for (int place = 0; place < 25; ++place) {
            // On two other axes: before, on, between, on and behind the walls.
            kernels::Segment ray{{}, {zero, zero, zero}, -end, end};
            ray.direction[along] = way;
            bool within = true;
            for (size_t k = 1, rest = size_t(place); k < 3; ++k, rest /= 5) {
              const size_t a = (along + k) % 3;
              ray.origin[a] = std::array{-2.0f, -1.0f, 0.5f, 1.0f, 2.0f}[rest % 5] * box.max[a];
              within = within && rest % 5 == 2;
            }
            kernels::BoxRay prepared;
            ASSERT_TRUE(kernels::prepare_box_ray(ray, prepared));
            EXPECT_EQ(kernels::may_meet(box, ray, prepared), within)
                << along << ' ' << zero << ' ' << end << ' ' << place;
          }
}

/// A hierarchy changes nothing: a ray that passes a box passes each box around it. Small whole numbers put
/// origins on walls, and huge ones make distances overflow.
TEST(BoxRule, ABoxAroundAnotherIsPassedIfThatIs) {
  Random random(4);
  const auto coordinate = [&] {
    const auto whole = float(random.between(-3, 3));
    return random.below(16) == 0 ? whole * 0x1p+120f : whole;
  };
  uint64_t passed = 0, missed = 0;
  for (int i = 0; i < 500'000; ++i) {
    kernels::WorldBox inner, outer;
    kernels::Segment ray{
        {}, {}, random.below(2) ? -INFINITY : coordinate(), random.below(2) ? INFINITY : coordinate()};
    for (size_t a = 0; a < 3; ++a) {
      const float one = coordinate(), other = coordinate();
      inner.min[a] = std::min(one, other), inner.max[a] = std::max(one, other);
      outer.min[a] = std::min(inner.min[a], coordinate()),
      outer.max[a] = std::max(inner.max[a], coordinate());
      ray.origin[a] = coordinate();
      ray.direction[a] = random.below(2) ? 0.0f : std::clamp(coordinate(), -0x1p+50f, 0x1p+50f);
      if (random.below(16) == 0) ray.direction[a] *= 0x1p-59f;
    }
    // Boxes of instances are rounded outward, so none is flat.
    const bool flat =
        inner.min[0] == inner.max[0] || inner.min[1] == inner.max[1] || inner.min[2] == inner.max[2];
    kernels::BoxRay prepared;
    if (flat || !kernels::prepare_box_ray(ray, prepared)) continue;
    if (!kernels::may_meet(inner, ray, prepared)) {
      ++missed;
      continue;
    }
    ++passed;
    ASSERT_TRUE(kernels::may_meet(outer, ray, prepared)) << i;
  }
  EXPECT_GT(passed, 10'000u);
  EXPECT_GT(missed, 10'000u);
}

/// Zeros of either sign are equal, so they must not show in which order instances were asked.
TEST(JoinedHits, DoNotDependOnTheOrder) {
  Random random(6);
  for (int i = 0; i < 20'000; ++i) {
    kernels::Hit hits[3];
    for (kernels::Hit& hit : hits) {
      hit.t = std::array{0.0f, -0.0f, 1.0f}[random.below(3)];
      hit.triangle = random.below(9);
      if (random.below(4) != 0) hit.low = std::array{0.0f, -0.0f, -1.0f}[random.below(3)];
      if (random.below(4) != 0) hit.high = hit.t;
    }
    std::array order{0u, 1u, 2u};
    kernels::SceneHit first;
    for (const uint32_t k : order) first.add(hits[k], k);
    while (std::next_permutation(order.begin(), order.end())) {
      kernels::SceneHit joined;
      for (const uint32_t k : order) joined.add(hits[k], k);
      ASSERT_EQ(joined.instance, first.instance);
      ASSERT_EQ(std::memcmp(static_cast<kernels::Hit*>(&joined), static_cast<kernels::Hit*>(&first),
                            sizeof(kernels::Hit)),
                0)
          << i;
    }
  }
}

/// The same if t is almost too large for a float: values computed from it overflow, and tmax does not.
TEST(BoxRule, TheEndsOfTheFloatsAreNoWalls) {
  constexpr float kSize = 0x1p50f;
  const kernels::WorldBox box{{-kSize, -kSize, -kSize}, {kSize, kSize, kSize}};
  Random random(3);
  uint64_t met = 0;
  for (int i = 0; i < 100'000; ++i) {
    // It is inside at tmax, and then, reversed, at tmin.
    kernels::Segment ray{{}, {}, 0, std::numeric_limits<float>::max()};
    bool within = true;
    for (int a = 0; a < 3; ++a) {
      ray.direction[a] = random.between(-0x1p-59f, 0x1p-59f);
      const double way = double(ray.direction[a]) * double(ray.tmax);
      ray.origin[a] = float(double(random.between(-kSize, kSize)) - way);
      within = within && std::abs(double(ray.origin[a]) + way) <= double(kSize);
    }
    kernels::BoxRay prepared;
    if (!within || !kernels::prepare_box_ray(ray, prepared)) continue;
    ++met;
    ASSERT_TRUE(kernels::may_meet(box, ray, prepared)) << i;
    for (float& x : ray.direction) x = -x;
    ray.tmin = -ray.tmax, ray.tmax = 0;
    ASSERT_TRUE(kernels::prepare_box_ray(ray, prepared));
    ASSERT_TRUE(kernels::may_meet(box, ray, prepared)) << i;
  }
  EXPECT_GT(met, 10'000u);
}

/// Overflows, or components of the direction near 0, do not make a ray miss a box: a ray that a triangle
/// blocks is never certainly visible among several instances, wherever it starts and however short its
/// direction is.
TEST_F(Scenes, NoBoxIsMissedForWantOfNumbers) {
  const format::AssetView& view = make(0, {.objects = 1, .instances = 0, .bvhs = 1});
  const kernels::TrianglesField& field = view.objects[1].as<kernels::TrianglesField>();
  const NifAsset asset = load();
  Random random(5);
  uint64_t stopped = 0, proven = 0;
  for (const float place : {0.0f, 2e38f}) {
    const Matrix there{1, 0, 0, place, 0, 1, 0, 0, 0, 0, 1, 0}, aside{1, 0, 0, 0, 0, 1, 0, 1e9f, 0, 0, 1, 0};
    const NifScene alone = scene_of(asset, 1), both = new_scene();
    ASSERT_EQ(nifAddInstance(both, asset, 1, there.data(), nullptr), NIF_OK);
    ASSERT_EQ(nifAddInstance(both, asset, 1, aside.data(), nullptr), NIF_OK);
    ASSERT_EQ(nifCommitScene(both), NIF_OK);
    // Along x, through the object's middle parts; the same rays from nearby give the expected answers.
    std::vector<NifRay> rays, nearby;
    for (int i = 0; i < 10000; ++i) {
      const kernels::Segment inside = random_segment(random, field);
      NifRay ray = to_ray(inside);
      ray.direction[0] = std::exp2(float(int(random.below(121)) - 60));
      for (const size_t a : {1, 2})
        ray.direction[a] = std::array{0.0f, -0.0f, 1e-45f, -0x1p-127f, 0x1p-126f}[random.below(5)];
      ray.tmin = 0, ray.tmax = std::array{INFINITY, 3e38f}[random.below(2)];
      ray.origin[0] = -100;
      nearby.push_back(ray);
      ray.origin[0] = -std::array{1e3f, 1e9f, 1e18f, 1e30f, 8e37f, 2e38f}[random.below(6)];
      rays.push_back(ray);
    }
    const Answers what = query_all(alone, nearby), answers = query_all(both, rays);
    for (size_t i = 0; i < rays.size(); ++i) {
      // Does it reach the object, without being moved by rounding on the way?
      const double t = (double(place) - double(rays[i].origin[0])) / double(rays[i].direction[0]);
      const bool aslant =
          t * double(std::max(std::abs(rays[i].direction[1]), std::abs(rays[i].direction[2]))) > 1e-6;
      if (what.visible[i] || t * 1.001 > double(rays[i].tmax) || aslant) continue;
      ++stopped;
      ASSERT_FALSE(answers.visible[i] && answers.certain[i])
          << rays[i].origin[0] << ' ' << rays[i].direction[0] << ' ' << rays[i].direction[1] << ' ' << place;
    }
    proven += uint64_t(std::count(answers.certain.begin(), answers.certain.end(), 1));
  }
  EXPECT_GT(stopped, 500u);
  EXPECT_GT(proven, 500u);
}

TEST_F(Scenes, WholeAssets) {
  const format::AssetView& view = make(5);
  const NifAsset asset = load();
  const Matrix outer{2, 0, 0, 3, 0, 0, -1, 1, 0, 1, 0, -2};
  const NifScene whole = new_scene(), parts = new_scene();
  ASSERT_EQ(nifAddInstance(whole, asset, 2, nullptr, nullptr), NIF_OK);
  ASSERT_EQ(nifAddInstance(parts, asset, 2, nullptr, nullptr), NIF_OK);
  uint32_t first = 99, count = 99;
  ASSERT_EQ(nifAddAsset(whole, asset, outer.data(), &first, &count), NIF_OK);
  EXPECT_EQ(first, 1u);
  EXPECT_EQ(count, view.instances.size());
  for (const format::InstanceView& placed : view.instances) {
    Matrix combined;
    for (size_t row = 0; row < 3; ++row)
      for (size_t column = 0; column < 4; ++column) {
        double sum = column == 3 ? double(outer[4 * row + 3]) : 0.0;
        for (size_t k = 0; k < 3; ++k)
          sum += double(outer[4 * row + k]) * double(placed.transform[4 * k + column]);
        combined[4 * row + column] = static_cast<float>(sum);
      }
    ASSERT_EQ(nifAddInstance(parts, asset, placed.object, combined.data(), nullptr), NIF_OK);
  }
  ASSERT_EQ(nifCommitScene(whole), NIF_OK);
  ASSERT_EQ(nifCommitScene(parts), NIF_OK);
  Random random(5);
  const auto rays = random_rays(random, view.objects[2].as<kernels::SegmentField>(), 500);
  EXPECT_EQ(query_all(whole, rays), query_all(parts, rays));

  // A file without instances: each object once.
  RandomAssetOptions options;
  options.instances = 0;
  make(6, options);
  const NifScene bare = new_scene();
  ASSERT_EQ(nifAddAsset(bare, load(), nullptr, &first, &count), NIF_OK);
  EXPECT_EQ(first, 0u);
  EXPECT_EQ(count, 3u);
}

TEST_F(Scenes, AnAssetThatPlacesNothing) {
  const format::AssetView& view = make(6, {.instances = 0, .places_nothing = true});
  const NifAsset asset = load();
  auto info = nifkit::sized<NifAssetInfo>();
  ASSERT_EQ(nifGetAssetInfo(asset, &info), NIF_OK);
  EXPECT_EQ(info.places_nothing, 1u);
  EXPECT_EQ(info.proves, 1u);
  const NifScene scene = new_scene();
  uint32_t first = 99, count = 99;
  ASSERT_EQ(nifAddAsset(scene, asset, nullptr, &first, &count), NIF_OK);
  EXPECT_EQ(first, 0u);
  EXPECT_EQ(count, 0u);
  ASSERT_EQ(nifCommitScene(scene), NIF_OK);
  Random random(6);
  const auto rays = random_rays(random, view.objects[0].as<kernels::SegmentField>(), 50);
  const Answers answers = query_all(scene, rays);
  EXPECT_EQ(std::count(answers.visible.begin(), answers.visible.end(), 1), 50);
  ASSERT_EQ(nifAddInstance(scene, asset, 1, nullptr, nullptr), NIF_OK) << "its objects are there";
}

TEST_F(Scenes, MovingAnInstance) {
  const format::AssetView& view = make(7);
  const NifAsset asset = load();
  const Matrix there{0, -1, 0, 2, 1, 0, 0, 0, 0, 0, 3, 0};
  Random random(7);
  const auto rays = random_rays(random, view.objects[0].as<kernels::SegmentField>(), 500);
  const NifScene scene = scene_of(asset, 0);
  const Answers at_home = query_all(scene, rays);
  ASSERT_EQ(nifSetInstanceTransform(scene, 0, there.data()), NIF_OK);
  ASSERT_EQ(nifCommitScene(scene), NIF_OK);
  EXPECT_EQ(query_all(scene, rays), query_all(scene_of(asset, 0, there.data()), rays));
  ASSERT_EQ(nifSetInstanceTransform(scene, 0, nullptr), NIF_OK);
  ASSERT_EQ(nifCommitScene(scene), NIF_OK);
  EXPECT_EQ(query_all(scene, rays), at_home);
}

TEST_F(Scenes, BoundsAndBytes) {
  const format::AssetView& view = make(8);
  const NifAsset asset = load();
  const NifScene scene = new_scene();
  auto info = nifkit::sized<NifSceneInfo>();
  ASSERT_EQ(nifCommitScene(scene), NIF_OK);
  ASSERT_EQ(nifGetSceneInfo(scene, &info), NIF_OK);
  EXPECT_GT(info.bounds_min[0], info.bounds_max[0]);
  const Matrix mirrored{-2, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0};
  for (int i = 0; i < 1000; ++i) ASSERT_EQ(nifAddInstance(scene, asset, 0, mirrored.data(), nullptr), NIF_OK);
  ASSERT_EQ(nifGetSceneInfo(scene, &info), NIF_OK);
  EXPECT_EQ(info.committed, 0u);
  ASSERT_EQ(nifCommitScene(scene), NIF_OK);
  ASSERT_EQ(nifGetSceneInfo(scene, &info), NIF_OK);
  EXPECT_EQ(info.committed, 1u);
  EXPECT_EQ(info.instance_count, 1000u);
  EXPECT_LT(info.resident_bytes, 1000 * 2 * 128u);
  // The box (here that of the grid, too) and an eighth of a voxel.
  const float margin = 0.125f / view.objects[0].as<kernels::SegmentField>().voxels_per_unit;
  EXPECT_FLOAT_EQ(info.bounds_min[0], -2 * (view.objects[0].aabb_max[0] + margin) + 1);
  EXPECT_FLOAT_EQ(info.bounds_max[0], -2 * (view.objects[0].aabb_min[0] - margin) + 1);
  EXPECT_FLOAT_EQ(info.bounds_max[1], view.objects[0].aabb_max[1] + margin);
}

}  // namespace
}  // namespace nif::test
