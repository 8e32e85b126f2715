// Fields for primary rays: they learn hit, depth and normal from views, give the same bytes for any number of
// threads, and are the same in the file as in the baker.
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "bake/bake.hpp"
#include "bake/ground_truth/prepare.hpp"
#include "bake/spherical/primary_trainer.hpp"
#include "formats/base/status.hpp"
#include "formats/nif/reader.hpp"
#include "formats/nif/writer.hpp"
#include "kernels/reference/spherical/primary.hpp"
#include "tests/bake/quiet_bake.hpp"
#include "tests/bake/training_fault.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

/// Rays from viewpoints all around, through a ball of radius 1.2 at the origin: `each` per viewpoint.
std::vector<bake::Segment> rays_from_views(uint64_t seed, size_t eyes, size_t each) {
  std::vector<bake::Segment> rays;
  for (size_t e = 0; e < eyes; ++e) {
    const double azimuth = 2.4 * double(e), height = (double(e) + 0.5) / double(eyes) * 1.6 - 0.8;
    const double across = std::sqrt(1 - height * height);
    const Double3 eye = Double3{across * std::cos(azimuth), across * std::sin(azimuth), height} * 4;
    nif::Random random(seed, 1, e);
    for (size_t i = 0; i < each; ++i) {
      const Double3 at = random.direction() * (1.2 * std::cbrt(random.uniform()));
      rays.push_back(bake::make_segment(eye, at - eye, INFINITY));
    }
  }
  return rays;
}

/// A bake that learns from six views of mesh 0, and nothing about the others.
bake::BakeOptions from_views(uint64_t rounds) {
  bake::BakeOptions options;
  options.encoding = "spherical";
  options.evaluation_rays = 0;
  bake::SphericalOptions& fields = options.spherical.fields;
  fields.outer.resolution = fields.inner.resolution = 16;
  fields.primary.resolution = 64;
  const auto draw = [](uint64_t round) {
    bake::MeshRays rays;
    rays.segments = rays_from_views(round, 6, 4096);
    rays.meshes.assign(rays.segments.size(), 0);
    return rays;
  };
  options.spherical.given = bake::GivenRays{"six views", rounds, draw, draw};
  return options;
}

TEST(PrimaryTraining, LearnsABallFromSeveralViews) {
  const mesh::Mesh ball = icosphere(4);
  const bake::BakeResult result = bake_quietly(scene_of({ball}), from_views(120));
  const std::vector<std::byte> file = format::encode(result.asset);
  const format::AssetView view = format::read_asset(file, "file");
  const format::PrimaryView* primary = view.primary_of(0);
  ASSERT_NE(primary, nullptr);
  EXPECT_EQ(primary->grid_bytes, 2u * 64 * 64 * 3 * 2);
  EXPECT_EQ(primary->network_bytes, (64u * 6 + 64 * 64 + 64 * 5) * 4);
  const uint64_t learned = std::get<bake::SphericalBaking::Report>(result.objects[0].own).primary_rays;
  EXPECT_GT(learned, 2'000'000u);
  EXPECT_EQ(result.objects[0].recoveries, 0u);
  const auto metadata = nlohmann::json::parse(view.metadata);
  EXPECT_EQ(metadata["options"]["spherical"]["primary"]["resolution"], 64);
  EXPECT_EQ(metadata["objects"][0]["primary_rays"], learned);

  const bake::Prepared prepared = bake::prepare(ball);
  const bake::GroundTruth truth(prepared);
  const kernels::PrimaryField own =
      format::field_of(*result.asset.objects[0].primary, result.asset.objects[0].bounds());
  size_t differ = 0, both = 0, behind = 0;
  double depth = 0, angle = 0;
  const std::vector<bake::Segment> rays = rays_from_views(1000, 6, 3000);
  for (const bake::Segment& ray : rays) {
    const kernels::PrimaryAnswer answer = kernels::query_primary(own, ray);
    const kernels::PrimaryAnswer stored = kernels::query_primary(primary->field, ray);
    ASSERT_EQ(answer.hit, stored.hit);
    ASSERT_EQ(answer.t, stored.t);
    ASSERT_EQ(answer.start, stored.start);
    for (int a = 0; a < 3; ++a) ASSERT_EQ(answer.normal[a], stored.normal[a]);
    const auto hit = truth.source().embree.first_hit(ray);
    differ += hit.has_value() != answer.hit;
    if (!hit || !answer.hit) continue;
    ++both;
    const double speed = length(to_double(std::to_array(ray.direction)));
    depth += std::abs(double(answer.t) - double(hit->t)) * speed / std::sqrt(12.0);
    behind += answer.start > hit->t;
    const double cosine = dot(hit->normal, to_double(std::to_array(answer.normal))) / length(hit->normal);
    angle += std::acos(std::clamp(cosine, -1.0, 1.0)) * 180 / std::numbers::pi;
  }
  EXPECT_GT(both, rays.size() / 2);
  EXPECT_LT(double(differ), 0.02 * double(rays.size()));
  EXPECT_LT(depth / double(both), 0.008);
  EXPECT_LT(angle / double(both), 4);
  EXPECT_LT(double(behind), 0.05 * double(both)) << "the margin keeps rays before the surface";
}

TEST(PrimaryTraining, GivesTheSameBytesForAnyNumberOfThreads) {
  std::vector<std::vector<std::byte>> files;
  for (const size_t threads : {1, 2}) {
    tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    files.push_back(format::encode(bake_quietly(scene_of({torus(40, 20)}), from_views(4)).asset));
  }
  EXPECT_TRUE(files[0] == files[1]);
}

/// The visibility field is the same with and without a primary field.
TEST(PrimaryTraining, LeavesVisibilityAsItIs) {
  bake::BakeOptions options = from_views(4);
  format::Asset with = bake_quietly(scene_of({torus(40, 20)}), options).asset;
  options.spherical.given->draw_primary = {};
  format::Asset without = bake_quietly(scene_of({torus(40, 20)}), options).asset;
  EXPECT_TRUE(with.objects[0].primary);
  EXPECT_FALSE(without.objects[0].primary);
  with.objects[0].primary.reset();
  with.metadata.clear();
  without.metadata.clear();
  EXPECT_EQ(format::encode(with), format::encode(without));
}

TEST(PrimaryTraining, HalfPrecisionAndBytesBeforehand) {
  bake::BakeOptions options = from_views(1);
  options.spherical.fields.half_networks = true;
  const bake::BakeResult result = bake_quietly(scene_of({icosphere(2)}), options);
  const format::Primary& primary = *result.asset.objects[0].primary;
  EXPECT_TRUE(primary.half_grids);
  EXPECT_TRUE(primary.half_network);
  EXPECT_EQ(primary.bytes(), 2u * (2 * 64 * 64 * 3 + 64 * 6 + 64 * 64 + 64 * 5));
  options.max_bytes = primary.bytes();
  EXPECT_THROW(bake_quietly(scene_of({icosphere(2)}), options), Error);
}

TEST(PrimaryTraining, GoesBackIfTheLossIsNotFinite) {
  format::Object object;
  object.aabb_min = {-1, -1, -1}, object.aabb_max = {1, 1, 1};
  const kernels::SphericalBounds bounds = bake::spherical_bounds(object);
  bake::SphericalOptions options;
  options.primary.resolution = 16;
  // The wall x = -1, seen from x = 3.
  bake::PrimaryRays rays;
  for (const bake::Segment& ray : rays_from_views(1, 1, 20'000)) {
    const float t = (-1 - ray.origin[0]) / ray.direction[0];
    rays.segments.push_back(ray);
    rays.hits.push_back(t > 0 ? std::optional(bake::PrimaryRays::Hit{t, {1, 0, 0}}) : std::nullopt);
  }
  const std::atomic<bool> cancel{false};
  bake::PrimaryTrainer trainer(bounds, options);
  {
    const TrainingFault fault(3);
    EXPECT_TRUE(trainer.learn(rays, {}, cancel));
  }
  EXPECT_EQ(trainer.recoveries(), 1u);
  EXPECT_EQ(trainer.rays(), 20'000u / 2048 * 2048);
  for (const float weight : trainer.field().network.weights) ASSERT_TRUE(std::isfinite(weight));
  const TrainingFault fault(0, 1000);
  EXPECT_FALSE(bake::PrimaryTrainer(bounds, options).learn(rays, {}, cancel));
}

TEST(PrimaryTraining, FailsWithoutRays) {
  bake::BakeOptions options = from_views(1);
  options.spherical.given->draw_primary = [](uint64_t) { return bake::MeshRays{}; };
  try {
    bake_quietly(scene_of({icosphere(2)}), options);
    FAIL() << "it went on";
  } catch (const Error& error) {
    EXPECT_EQ(error.status(), Status::training_failed);
    EXPECT_NE(std::string(error.what()).find("primary rays"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace nif::test
