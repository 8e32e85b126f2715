// Training learns, gives the same bytes for any number of threads, and survives
// non-finite losses and networks that give all rays the same answer.
#include <gtest/gtest.h>
#include <hwy/targets.h>
#include <tbb/global_control.h>

#include "bake/network/network_trainer.hpp"
#include "bake/network/network_trainer_kernels.hpp"
#include "bake/reference_answers.hpp"
#include "formats/base/status.hpp"
#include "kernels/reference/planes/grid_traversal.hpp"
#include "tests/bake/training_fault.hpp"
#include "tests/support/occupied_object.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

using bake::RaySet;

bake::TrainingOptions short_training() {
  bake::TrainingOptions options;
  options.mix = {0.4, 0.3, 0, 0.3, 0};
  options.rays = 1'000'000;
  options.rays_per_round = 250'000;
  options.batch = 1024;
  options.seed = 4;
  return options;
}

struct Trained {
  std::unique_ptr<OccupiedObject> object;
  bake::TrainingResult result;

  explicit Trained(const bake::TrainingOptions& options)
      : object(std::make_unique<OccupiedObject>(torus(60, 30), 24, CellOptions{.bare = true})) {
    const std::atomic<bool> cancel{false};
    result = bake::train(
        object->truth->source(), object->object, options, [](const auto&) {}, cancel);
  }
  double error(RaySet set) const { return error(set, result.network); }
  double best_constant_error(RaySet set) const {
    double best = 1;
    for (int32_t logit : {-1, 1}) {
      format::Mlp constant = result.network;
      constant.layers.back().weights.assign(constant.layers.back().weights.size(), 0);
      constant.layers.back().biases = {logit};
      best = std::min(best, error(set, constant));
    }
    return best;
  }

 private:
  double error(RaySet set, const format::Mlp& network) const {
    const kernels::SegmentField field = format::field_of(object->object, network);
    const bake::RaysWithTruth rays = bake::make_ray_set(object->truth->source(), set, 50'000, 77);
    return bake::evaluate(rays, bake::reference_answerer(field), object->truth->source().embree).error();
  }
};

TEST(Training, LearnsATorus) {
  const Trained trained(short_training());
  // Compared with a network that gives all open rays the same answer, the better one of the two.
  for (RaySet set : {RaySet::outer_lines, RaySet::inner_surface, RaySet::segments}) {
    EXPECT_LT(trained.error(set), 0.35 * trained.best_constant_error(set)) << bake::name_of(set);
  }
  EXPECT_EQ(trained.result.failure, "");
  EXPECT_EQ(trained.result.recoveries, 0u);
}

TEST(Training, GivesTheSameBytesForAnyNumberOfThreads) {
  bake::TrainingOptions options = short_training();
  options.rays = 200'000;
  struct Bytes {
    format::NetworkData data;
    format::Mlp network;
  };
  std::vector<Bytes> bakes;
  for (size_t threads : {1, 2, 3}) {
    tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    const Trained trained(options);
    bakes.push_back({*trained.object->object.network, trained.result.network});
  }
  for (const Bytes& bytes : bakes) {
    ASSERT_EQ(bytes.data.features, bakes[0].data.features);
    for (size_t l = 0; l < bytes.network.layers.size(); ++l) {
      ASSERT_EQ(bytes.network.layers[l].weights, bakes[0].network.layers[l].weights);
      ASSERT_EQ(bytes.network.layers[l].biases, bakes[0].network.layers[l].biases);
    }
  }
}

TEST(Training, GivesTheSameBytesWithNarrowerVectors) {
  bake::TrainingOptions options = short_training();
  options.rays = 200'000;
  const Trained widest(options);
  const std::string target = bake::trainer_target();
  if (!target.starts_with("AVX3")) GTEST_SKIP() << "the widest vectors here are " << target;
  hwy::DisableTargets(HWY_AVX3 | HWY_AVX3_DL);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
  const std::string narrower = bake::trainer_target();
  const Trained narrow(options);
  hwy::DisableTargets(0);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
  ASSERT_EQ(narrower, "AVX2");
  ASSERT_EQ(bake::trainer_target(), target);
  EXPECT_EQ(widest.object->object.network->features, narrow.object->object.network->features);
  for (size_t l = 0; l < widest.result.network.layers.size(); ++l) {
    EXPECT_EQ(widest.result.network.layers[l].weights, narrow.result.network.layers[l].weights);
    EXPECT_EQ(widest.result.network.layers[l].biases, narrow.result.network.layers[l].biases);
  }
}

TEST(Training, GoesBackIfTheLossIsNotFinite) {
  const TrainingFault fault(300);
  const Trained trained(short_training());
  EXPECT_EQ(trained.result.recoveries, 1u);
  EXPECT_LT(trained.error(RaySet::outer_lines), 0.35 * trained.best_constant_error(RaySet::outer_lines));
}

TEST(Training, GoesBackIfAllAnswersAreEqual) {
  bake::TrainingOptions options = short_training();
  options.rays = 4'000'000;
  const TrainingFault fault(300, 1, TrainingFault::Kind::collapse);
  const Trained trained(options);
  EXPECT_EQ(trained.result.failure, "");
  EXPECT_EQ(trained.result.recoveries, 1u);
  EXPECT_LT(trained.error(RaySet::outer_lines), 0.35 * trained.best_constant_error(RaySet::outer_lines));
}

TEST(Training, FailsIfAllAnswersStayEqual) {
  // There are 976 steps: enough to notice, but not to go back.
  const TrainingFault fault(500, 1, TrainingFault::Kind::collapse);
  const std::string failure = Trained(short_training()).result.failure;
  EXPECT_EQ(failure, "training of 'torus' failed: the network gives all rays the same answer");
}

TEST(Training, FailsIfTrainingDoesNotHelp) {
  bake::TrainingOptions options = short_training();
  options.network_rate = std::numeric_limits<float>::quiet_NaN();
  const std::string failure = Trained(options).result.failure;
  EXPECT_TRUE(failure.starts_with("training of 'torus' failed: the loss stayed non-finite")) << failure;
}

TEST(Training, FailsIfTheMixHasNoRays) {
  OccupiedObject o(cube(), 24);  // fills its box, so inner-volume has no rays
  bake::TrainingOptions options = short_training();
  options.mix = {0, 0, 1, 0, 0};
  const std::atomic<bool> cancel{false};
  const std::string failure = bake::train(
                                  o.truth->source(), o.object, options, [](const auto&) {}, cancel)
                                  .failure;
  EXPECT_TRUE(failure.starts_with("training of 'cube' failed: ") &&
              failure.ends_with("the ray sets of the mix have no rays"))
      << failure;
}

TEST(Training, CanBeCancelledWhileRaysAreDrawn) {
  OccupiedObject o(torus(60, 30), 24);
  std::atomic<bool> cancel{false};
  const auto at_once = [&](const bake::TrainingProgress& p) {
    EXPECT_EQ(p.rays_done, 0u);
    cancel = true;
  };
  try {
    bake::train(o.truth->source(), o.object, short_training(), at_once, cancel);
    FAIL() << "it went on";
  } catch (const Error& error) {
    EXPECT_EQ(error.status(), Status::interrupted);
  }
}

TEST(Training, CanBeCancelled) {
  OccupiedObject o(torus(60, 30), 24, CellOptions{.bare = true});
  std::atomic<bool> cancel{false};
  uint64_t seen = 0;
  try {
    bake::train(
        o.truth->source(), o.object, short_training(),
        [&](const bake::TrainingProgress& p) {
          seen = p.rays_done;
          cancel = seen > 0;
        },
        cancel);
    FAIL() << "it went on";
  } catch (const Error& error) {
    EXPECT_EQ(error.status(), Status::interrupted);
    EXPECT_GT(seen, 0u);
    EXPECT_LT(seen, 500'000u);
  }
}

TEST(TrainingRays, AreFoundAsTheReferenceFindsThem) {
  const OccupiedObject o(torus(60, 30), 24);
  const bake::OpenFilter filter(o.field);
  const auto rays = bake::make_ray_set(o.truth->source(), bake::RaySet::inner_surface, 5'000, 4).segments;
  std::vector<uint32_t> open, expected;
  filter.select(rays, open);
  kernels::FullTraversal traversal;
  for (uint32_t i = 0; i < rays.size(); ++i) {
    kernels::traverse_segment(o.field, rays[i], traversal);
    if (traversal.verdict == kernels::Verdict::open) expected.push_back(i);
  }
  EXPECT_EQ(open, expected);
  EXPECT_GT(open.size(), 100u);
  EXPECT_LT(open.size(), 4'900u);
}

TEST(TrainingRays, AreOpenAndAnsweredByEmbree) {
  // Coarse enough to find all requested rays.
  const OccupiedObject o(torus(60, 30), 12);
  const bake::SurfaceCells cells(o.field);
  EXPECT_EQ(cells.cells.size(), o.occupancy.surface_voxels);
  const bake::OpenFilter filter(o.field);
  const std::atomic<bool> cancel{false};
  const bake::TrainingRays rays = bake::draw_training_rays(o.truth->source(), o.field, cells, filter,
                                                           {0.25, 0.25, 0.25, 0.25, 0}, 3, 0, 20, cancel);
  ASSERT_EQ(rays.count(), 20 * bake::kTrainingChunk);
  size_t visible = 0, of_set[5] = {};
  for (size_t i = 0; i < rays.count(); ++i) {
    visible += rays.visible[i];
    ++of_set[rays.set[i]];
    for (uint32_t j = 0; j < rays.samples; ++j)
      ASSERT_LT(rays.cells[i * rays.samples + j], cells.cells.size());
  }
  EXPECT_GT(visible, rays.count() / 10);
  EXPECT_LT(visible, rays.count() * 9 / 10);
  for (int s = 0; s < 4; ++s) EXPECT_NEAR(double(of_set[s]) / double(rays.count()), 0.25, 0.02);
}

}  // namespace
}  // namespace nif::test
