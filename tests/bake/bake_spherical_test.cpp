// Training of `spherical` fields: gradients, learning, the same bytes for any number of threads, recovery.
#include <gtest/gtest.h>
#include <hwy/targets.h>
#include <tbb/global_control.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "bake/bake.hpp"
#include "bake/ground_truth/prepare.hpp"
#include "bake/spherical/spherical_trainer.hpp"
#include "bake/spherical/spherical_trainer_kernels.hpp"
#include "formats/base/status.hpp"
#include "formats/nif/reader.hpp"
#include "formats/nif/writer.hpp"
#include "kernels/reference/reference_encodings.hpp"
#include "tests/bake/quiet_bake.hpp"
#include "tests/bake/training_fault.hpp"
#include "tests/support/test_random.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

using bake::RaySet;

/// Small grids, few rays.
bake::BakeOptions small_fields() {
  bake::BakeOptions options;
  options.encoding = "spherical";
  options.spherical.fields.outer.resolution = 64;
  options.spherical.fields.inner.resolution = 32;
  options.spherical.fields.inner.distance_resolution = 32;
  options.spherical.rays = 400'000;
  options.evaluation_rays = 20'000;
  return options;
}

/// One block of samples through a small network over three grids, to compare gradients with finite
/// differences.
struct SmallModel {
  static constexpr uint32_t kEntries = 10, kFeatures[3] = {2, 3, 1};
  std::vector<float> entries[3];
  std::vector<float> weights;
  std::vector<bake::LatentLookup> lookups[3];
  std::vector<uint8_t> labels;
  static constexpr uint32_t kMaxOutputs = 3;
  alignas(64) float targets[(kMaxOutputs - 1) * bake::kTrainLanes];
  bake::NetworkShape shape;

  explicit SmallModel(uint32_t hidden_layers, uint32_t outputs = 1) {
    Random random(hidden_layers);
    uint32_t before = 6;
    shape.layer_count = hidden_layers + 1;
    for (uint32_t l = 0; l <= hidden_layers; ++l) {
      const uint32_t after = l == hidden_layers ? outputs : 8;
      shape.layers[l] = {before, after, shape.weights, 0};
      shape.weights += before * after;
      shape.widest = 8;
      before = after;
    }
    for (uint32_t i = 0; i < shape.weights; ++i) weights.push_back(random.between(-0.6f, 0.6f));
    for (int g = 0; g < 3; ++g) {
      for (uint32_t i = 0; i < kEntries * 3 * kFeatures[g]; ++i)
        entries[g].push_back(random.between(-1.0f, 1.0f));
      for (uint32_t s = 0; s < bake::kTrainLanes; ++s) {
        bake::LatentLookup lookup{};
        for (uint32_t c = 0; c < (g == 2 ? 2u : 4u); ++c) {
          lookup.entries[c] = random.below(kEntries);
          lookup.weights[c] = random.unit();
        }
        lookups[g].push_back(lookup);
      }
    }
    for (uint32_t s = 0; s < bake::kTrainLanes; ++s) labels.push_back(uint8_t(random.below(2)));
    for (float& target : targets) target = random.between(-0.5f, 0.5f);
  }

  struct Gradients {
    alignas(64) float inputs[6 * bake::kTrainLanes] = {};
    std::vector<float> weights;
    double loss = 0;
  };
  bake::SphericalLoss loss = bake::SphericalLoss::squared;

  Gradients run() const {
    Gradients result;
    bake::SphericalModel model{shape, weights.data(), 0.01f, loss, 3, {}, {2.0f, 0.5f}};
    for (int g = 0; g < 3; ++g) model.grids[g] = {kFeatures[g], g == 2 ? 2u : 4u, entries[g].data()};
    const auto aligned = [](size_t floats) {
      return std::unique_ptr<float[], decltype(&std::free)>(
          static_cast<float*>(std::aligned_alloc(64, (floats * sizeof(float) + 63) / 64 * 64)), &std::free);
    };
    const auto scratch = aligned(bake::spherical_scratch_floats(shape));
    const auto lanes = aligned(size_t(shape.weights) * bake::kVirtualLanes);
    std::fill_n(lanes.get(), size_t(shape.weights) * bake::kVirtualLanes, 0.f);
    uint8_t wrong[bake::kTrainLanes];
    bake::SphericalSlice slice{{lookups[0].data(), lookups[1].data(), lookups[2].data()},
                               labels.data(),
                               targets,
                               result.inputs,
                               lanes.get(),
                               wrong,
                               0};
    bake::train_spherical(model, bake::kTrainLanes, scratch.get(), slice);
    result.loss = slice.loss;
    result.weights.resize(shape.weights);
    float* const groups[] = {lanes.get()};
    bake::sum_lanes(groups, 0, shape.weights, result.weights.data());
    return result;
  }
  double difference(float& parameter) {
    // Larger than the rounding of the loss, and small enough that few leaky ReLUs change their slope.
    constexpr float kStep = 4e-4f;
    const float before = parameter;
    parameter = before + kStep;
    const double above = run().loss;
    parameter = before - kStep;
    const double below = run().loss;
    parameter = before;
    return (above - below) / (2 * double(kStep));
  }
};

TEST(SphericalTraining, GradientsAreThoseOfFiniteDifferences) {
  using enum bake::SphericalLoss;
  for (const auto& [layers, outputs, loss] : {std::tuple{1u, 1u, squared},
                                              {2u, 1u, squared},
                                              {3u, 1u, squared},
                                              {2u, 1u, cross_entropy},
                                              {2u, 3u, squared},
                                              {1u, 2u, cross_entropy}}) {
    SmallModel model(layers, outputs);
    model.loss = loss;
    const SmallModel::Gradients found = model.run();
    double largest = 0;
    for (uint32_t i = 0; i < model.shape.weights; ++i) {
      const double expected = model.difference(model.weights[i]);
      ASSERT_NEAR(double(found.weights[i]), expected, 0.01 + 0.02 * std::abs(expected)) << "weight " << i;
      largest = std::max(largest, std::abs(expected));
    }
    EXPECT_GT(largest, 0.1);
    uint32_t input = 0;
    for (int g = 0; g < 3; ++g)
      for (uint32_t f = 0; f < SmallModel::kFeatures[g]; ++f, ++input)
        for (uint32_t e = 0; e < SmallModel::kEntries; ++e) {
          double gradient = 0;
          for (uint32_t s = 0; s < bake::kTrainLanes; ++s)
            for (uint32_t c = 0; c < 4; ++c)
              if (model.lookups[g][s].entries[c] == e)
                gradient += double(model.lookups[g][s].weights[c]) *
                            double(found.inputs[input * bake::kTrainLanes + s]);
          const double expected = model.difference(model.entries[g][e * 3 * SmallModel::kFeatures[g] + f]);
          ASSERT_NEAR(gradient, expected, 0.01 + 0.02 * std::abs(expected)) << "grid " << g << " entry " << e;
        }
  }
}

TEST(SphericalTraining, LearnsABall) {
  bake::BakeOptions options = small_fields();
  options.spherical.rays = 2'000'000;
  const bake::BakeResult result = bake_quietly(scene_of({icosphere(4)}), options);
  // 48 % of the lines through a ball's box miss it. No ray from its surface is blocked, and a quarter of
  // those from the box's corners.
  EXPECT_LT(result.sets[size_t(RaySet::outer_lines)].error(), 0.18);
  EXPECT_LT(result.sets[size_t(RaySet::inner_surface)].error(), 0.02);
  EXPECT_LT(result.sets[size_t(RaySet::inner_volume)].error(), 0.15);
  for (RaySet set : bake::kRaySets) EXPECT_EQ(result.sets[size_t(set)].certain_wrong, 0u);
  EXPECT_EQ(result.objects[0].encoding, "spherical");
  EXPECT_EQ(result.objects[0].recoveries, 0u);
  EXPECT_GT(result.objects[0].training_rays, 5'500'000u);
}

TEST(SphericalTraining, GivesTheSameBytesForAnyNumberOfThreads) {
  std::vector<std::vector<std::byte>> files;
  for (const size_t threads : {1, 2, 3}) {
    tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    files.push_back(format::encode(bake_quietly(scene_of({torus(40, 20)}), small_fields()).asset));
  }
  EXPECT_TRUE(files[0] == files[1]);
  EXPECT_TRUE(files[0] == files[2]);
}

TEST(SphericalTraining, GivesTheSameBytesWithNarrowerVectors) {
  const std::string target = bake::trainer_target();
  if (!target.starts_with("AVX3")) GTEST_SKIP() << "the widest vectors here are " << target;
  const auto widest = format::encode(bake_quietly(scene_of({torus(40, 20)}), small_fields()).asset);
  hwy::DisableTargets(HWY_AVX3 | HWY_AVX3_DL);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
  const std::string narrower = bake::trainer_target();
  const auto narrow = format::encode(bake_quietly(scene_of({torus(40, 20)}), small_fields()).asset);
  hwy::DisableTargets(0);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
  ASSERT_EQ(narrower, "AVX2");
  EXPECT_TRUE(widest == narrow);
}

TEST(SphericalTraining, GoesBackIfTheLossIsNotFinite) {
  bake::BakeOptions options = small_fields();
  options.spherical.rays = 2'000'000;
  const TrainingFault fault(100);
  const bake::BakeResult result = bake_quietly(scene_of({icosphere(4)}), options);
  EXPECT_EQ(result.objects[0].recoveries, 1u);
  EXPECT_LT(result.sets[size_t(RaySet::outer_lines)].error(), 0.22);
}

TEST(SphericalTraining, FailsIfTrainingDoesNotHelp) {
  bake::BakeOptions options = small_fields();
  {
    const TrainingFault fault(0, 1'000);
    EXPECT_EQ(status_of(scene_of({icosphere(3)}), options), Status::training_failed);
  }
  options.mix = bake::Mix{0, 0, 1, 0, 0};  // a cube fills its box, so no ray can start in it
  EXPECT_EQ(status_of(scene_of({cube()}), options), Status::training_failed);
}

TEST(SphericalTraining, CanBeCancelled) {
  std::atomic<bool> cancel{false};
  const mesh::Scene scene = scene_of({torus(40, 20)});
  bake::BakeOptions options = small_fields();
  options.spherical.rays = 20'000'000;
  try {
    bake::bake(
        scene, options,
        [&](const bake::BakeProgress& p) { cancel = p.stage == bake::BakeProgress::Stage::training; },
        cancel);
    FAIL() << "it went on";
  } catch (const Error& error) {
    EXPECT_EQ(error.status(), Status::interrupted);
  }
}

TEST(SphericalTraining, LearnsFromAnySourceOfRays) {
  // A wall at x = 0 in a box of side 2: visible exactly where the ray goes away from it.
  format::Object object;
  object.aabb_min = {0, -1, -1}, object.aabb_max = {2, 1, 1};
  bake::SphericalOptions options;
  options.inner.resolution = options.inner.distance_resolution = 16;
  options.outer.resolution = 16;
  bake::SphericalTrainer trainer({bake::spherical_bounds(object)}, options);
  const std::atomic<bool> cancel{false};
  Random random(1);
  const auto draw = [&](size_t count) {
    bake::SphericalRays rays;
    for (size_t i = 0; i < count; ++i) {
      rays.segments.push_back({{1, random.between(-0.5f, 0.5f), 0},
                               {random.between(-1.0f, 1.0f), random.between(-0.1f, 0.1f), 0.2f},
                               0,
                               100});
      rays.visible.push_back(rays.segments.back().direction[0] > 0);
    }
    return rays;
  };
  EXPECT_TRUE(trainer.learn(draw(3000), 1, {}, cancel));
  EXPECT_EQ(trainer.inner_rays(), 0u) << "less than a batch waits";
  EXPECT_TRUE(trainer.learn(draw(200'000), 2, {}, cancel));
  EXPECT_EQ(trainer.outer_rays(), 0u);
  EXPECT_EQ(trainer.inner_rays(), 203'000 / 4096 * 4096 * 2u);
  const format::SphericalNetworks networks = trainer.networks();
  const format::SphericalGrids grids = trainer.grids(0);
  const kernels::SphericalField field = format::field_of(grids, networks, object.bounds());
  const bake::SphericalRays test = draw(10'000);
  size_t wrong = 0;
  for (size_t i = 0; i < test.segments.size(); ++i)
    wrong += kernels::query(field, test.segments[i]).visible != (test.visible[i] != 0);
  EXPECT_LT(wrong, 500u);
}

TEST(SphericalBake, SharesANetworkOrDoesNot) {
  const mesh::Scene scene = scene_of({icosphere(3), torus(40, 20), icosphere(3)});
  for (const bool shared : {false, true}) {
    SCOPED_TRACE(shared);
    bake::BakeOptions options = small_fields();
    options.spherical.shared_network = shared;
    options.spherical.fields.half_networks = shared;
    const bake::BakeResult result = bake_quietly(scene, options);
    const auto file = format::encode(result.asset);
    const format::AssetView view = format::read_asset(file, "file");
    ASSERT_EQ(view.objects.size(), 2u);
    EXPECT_EQ(view.instances.size(), 3u);
    EXPECT_EQ(view.spherical_networks.size(), shared ? 1u : 2u);
    EXPECT_EQ(view.objects[1].spherical->network, shared ? 0u : 1u);
    EXPECT_EQ(view.spherical_networks[0].bytes, (4544 + 5280) * (shared ? 2u : 4u));
    for (const bake::ObjectReport& object : result.objects) {
      EXPECT_LT(object.sets[size_t(RaySet::outer_lines)].error(), 0.30) << object.name;
      EXPECT_LT(object.sets[size_t(RaySet::inner_surface)].error(), 0.20) << object.name;
    }
    const auto metadata = nlohmann::json::parse(view.metadata);
    EXPECT_EQ(metadata["options"]["preset"], "paper");
    EXPECT_EQ(metadata["options"]["spherical"]["outer"]["resolution"], 64);
    EXPECT_EQ(metadata["options"]["spherical"]["shared_network"], shared);
    EXPECT_EQ(metadata["objects"][1]["encoding"], "spherical");

    // The file gives the same answers as the baker's own copy.
    for (size_t i = 0; i < 2; ++i) {
      const kernels::AnyField field = format::field_of(result.asset, result.asset.objects[i]),
                              in_file = format::field_of(view.objects[i]);
      const bake::Prepared prepared = bake::prepare(scene.meshes[i]);
      const bake::GroundTruth truth(prepared);
      for (RaySet set : bake::kRaySets)
        for (const kernels::Segment& s : bake::make_ray_set(truth.source(), set, 1000, 3).segments)
          ASSERT_EQ(kernels::query(field, s).logit, kernels::query(in_file, s).logit);
    }
  }
}

TEST(SphericalBake, KnowsItsBytesBeforehand) {
  bake::BakeOptions options = small_fields();
  options.max_bytes = 20'000;
  EXPECT_EQ(status_of(scene_of({icosphere(3)}), options), Status::target_not_met);
  options.max_bytes = 200'000;
  options.evaluation_rays = 0;
  const bake::BakeResult result = bake_quietly(scene_of({icosphere(3)}), options);
  EXPECT_LE(format::encode(result.asset).size(), 200'000u);
}

TEST(SphericalOptions, OutOfRangeAreRefusedByName) {
  using Options = bake::SphericalOptions;
  const auto refusal = [](const std::function<void(Options&)>& change) -> std::string {
    Options options;
    change(options);
    try {
      bake::check(options);
    } catch (const Error& error) {
      return error.status() == Status::usage ? error.what() : "another status";
    }
    return "";
  };
  EXPECT_EQ(refusal([](Options&) {}), "");
  EXPECT_TRUE(refusal([](Options& o) { o.outer.resolution = 0; }).starts_with("outer.resolution 0"));
  EXPECT_TRUE(refusal([](Options& o) { o.outer.width = 30; }).starts_with("outer.width 30"));
  EXPECT_TRUE(refusal([](Options& o) { o.outer.batch = 1000; }).starts_with("outer.batch 1000"));
  EXPECT_TRUE(refusal([](Options& o) { o.inner.features = 9; }).starts_with("inner.features 9"));
  EXPECT_TRUE(refusal([](Options& o) { o.inner.hidden_layers = 4; }).starts_with("inner.layers 4"));
  EXPECT_TRUE(refusal([](Options& o) {
                o.inner.distance_resolution = 1;
              }).starts_with("inner.distance_resolution 1"));
  EXPECT_TRUE(refusal([](Options& o) { o.learning_rate = 0; }).starts_with("learning_rate 0"));
  EXPECT_TRUE(refusal([](Options& o) { o.slope = NAN; }).starts_with("slope nan"));
  EXPECT_TRUE(refusal([](Options& o) { o.latent_reach = 2; }).starts_with("latent_reach 2"));
  EXPECT_TRUE(refusal([](Options& o) { o.beta1 = 1; }).starts_with("beta1 1"));
  EXPECT_TRUE(refusal([](Options& o) { o.beta2 = -1; }).starts_with("beta2 -1"));
  EXPECT_TRUE(refusal([](Options& o) { o.epsilon = 0; }).starts_with("epsilon 0"));
}

}  // namespace
}  // namespace nif::test
