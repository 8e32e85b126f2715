// Decision thresholds: how a bake finds one, and how it changes a field's answers.
#include "bake/network/error_limit.hpp"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cstring>
#include <nlohmann/json.hpp>

#include "bake/ground_truth/prepare.hpp"
#include "bake/reference_answers.hpp"
#include "bake/steps.hpp"
#include "formats/nif/reader.hpp"
#include "formats/nif/writer.hpp"
#include "kernels/reference/scene_query.hpp"
#include "tests/bake/quiet_bake.hpp"
#include "tests/support/random_asset.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

using bake::HeldOut;
using bake::least_move;
using bake::Mistake;
using bake::RaySet;

/// `count` values from 0 up, `step` apart, in shuffled order.
std::vector<uint32_t> ladder(uint32_t count, uint32_t step) {
  std::vector<uint32_t> values;
  for (uint32_t i = 0; i < count; ++i) values.push_back((i * 7919 % count) * step);
  return values;
}

TEST(LeastMove, IsTheSmallestThatShowsTheRate) {
  for (const double rate : {0.0005, 0.001, 0.0099, 0.02}) {
    SCOPED_TRACE(rate);
    HeldOut set{100'000, ladder(1009, 3)};
    const std::optional<uint32_t> move = least_move(std::span(&set, 1), rate);
    ASSERT_TRUE(move);
    const auto bound = [&](uint32_t moved) {
      return bake::rate_bound(set.rays, uint64_t(std::ranges::count_if(
                                            set.excess, [&](uint32_t excess) { return excess >= moved; })));
    };
    EXPECT_LE(bound(*move), rate);
    if (*move > 0) {
      EXPECT_GT(bound(*move - 1), rate);
    }
    EXPECT_EQ(*move == 0, rate > 0.01) << "1009 of 100,000 rays";
  }
}

TEST(LeastMove, IsThatOfTheWorstSet) {
  const auto move = [](std::vector<HeldOut> sets) { return least_move(sets, 0.001); };
  const HeldOut good{1'000'000, ladder(500, 1)}, bad{1'000'000, ladder(5003, 2)}, none{};
  EXPECT_EQ(move({good}), 0u);
  const std::optional<uint32_t> worst = move({bad});
  ASSERT_TRUE(worst);
  EXPECT_GT(*worst, 0u);
  EXPECT_EQ(move({good, bad}), worst);
  EXPECT_EQ(move({bad, none, good}), worst);
  EXPECT_EQ(move({none}), 0u);
}

TEST(LeastMove, MovesPastAllThatAreAlike) {
  HeldOut set{100'000, std::vector<uint32_t>(1000, 77)};
  EXPECT_EQ(least_move(std::span(&set, 1), 0.001), 78u);
  EXPECT_EQ(least_move(std::span(&set, 1), 0.02), 0u);
}

TEST(LeastMove, NeedsEnoughRays) {
  // With no mistake among n rays, the bound is 1 - 0.01^(1/n).
  HeldOut few{9208, {}}, enough{9209, {}};
  EXPECT_EQ(least_move(std::span(&few, 1), 0.0005), std::nullopt);
  EXPECT_EQ(least_move(std::span(&enough, 1), 0.0005), 0u);
  enough.excess = {40, 10};
  EXPECT_EQ(least_move(std::span(&enough, 1), 0.0005), 41u);
  EXPECT_EQ(least_move(std::span(&enough, 1), 1), 0u);
}

TEST(Threshold, LowersOutputsAndLeavesProbabilities) {
  Random random(5);
  for (int i = 0; i < 20; ++i) {
    const format::Mlp network = random_network(random, 24);
    format::Mlp limited = network;
    const int32_t by = random.between(-50'000, 50'000);
    format::move_threshold(limited, by);
    const format::OutputRange range = format::output_range(network);
    const kernels::NetworkField before = format::field_of(format::NetworkData(), network, {}),
                                after = format::field_of(format::NetworkData(), limited, {});
    for (int k = 0; k < 200; ++k) {
      uint8_t inputs[24];
      for (uint8_t& input : inputs) input = uint8_t(random.below(128));
      const int32_t output = kernels::evaluate_network(before.network, inputs),
                    shifted = kernels::evaluate_network(after.network, inputs);
      EXPECT_GE(output, range.least);
      EXPECT_LE(output, range.largest);
      EXPECT_EQ(shifted, output - by);
      EXPECT_EQ(kernels::visible_probability(output, before.network.calibration),
                kernels::visible_probability(shifted, after.network.calibration));
    }
  }
}

bake::BakeOptions briefly_trained() { return small_field(0.02); }

/// A field's answers to rays that no bake has drawn.
struct FreshAnswers {
  std::vector<uint8_t> truth, visible, certain;
  std::vector<float> probability;

  FreshAnswers(const bake::RaySource& source, RaySet set, const format::Asset& asset) {
    const bake::RaysWithTruth rays = bake::make_ray_set(source, set, 200'000, 12345);
    truth = rays.visible;
    const size_t count = rays.segments.size();
    visible.resize(count), certain.resize(count), probability.resize(count);
    bake::reference_answerer(format::field_of(asset, asset.objects[0]))(
        rays.segments, {visible.data(), certain.data(), probability.data()});
  }
  double rate(Mistake mistake) const {
    size_t wrong = 0;
    for (size_t i = 0; i < truth.size(); ++i)
      wrong += truth[i] != visible[i] && (truth[i] != 0) == (mistake == Mistake::spurious);
    return double(wrong) / double(truth.size());
  }
};

class ErrorLimits : public testing::TestWithParam<Mistake> {
 protected:
  const Mistake mistake_ = GetParam(), other_ = mistake_ == Mistake::leak ? Mistake::spurious : Mistake::leak;
  const mesh::Scene scene_ = scene_of({torus(80, 40)});
  const bake::Prepared prepared_ = bake::prepare(scene_.meshes[0]);
  const bake::GroundTruth truth_{prepared_};
};

const bake::ErrorLimitReport& error_limit_of(const bake::BakeResult& result, size_t object = 0) {
  return std::get<bake::SegmentBaking::Report>(result.objects[object].own).error_limit.value();
}

TEST_P(ErrorLimits, KeepsTheRateOnFreshRaysAndTheProbabilities) {
  constexpr double kRate = 0.002;
  bake::BakeOptions options = briefly_trained();
  const bake::BakeResult unlimited = bake_quietly(scene_, options);
  EXPECT_FALSE(std::get<bake::SegmentBaking::Report>(unlimited.objects[0].own).error_limit);
  EXPECT_EQ(unlimited.asset.mlps[0].threshold, 0);
  options.error_limit = {mistake_, kRate};
  const bake::BakeResult limited = bake_quietly(scene_, options);

  // The same field except for the threshold.
  const int32_t threshold = limited.asset.mlps[0].threshold;
  EXPECT_EQ(threshold > 0, mistake_ == Mistake::leak);
  EXPECT_EQ(threshold < 0, mistake_ == Mistake::spurious);
  format::Asset moved = unlimited.asset;
  format::move_threshold(moved.mlps[0], threshold);
  moved.metadata = limited.asset.metadata;
  EXPECT_TRUE(format::encode(moved) == format::encode(limited.asset));

  double before = 0, after = 0, price = 0;
  for (const RaySet set : bake::kRaySets) {
    SCOPED_TRACE(bake::name_of(set));
    const FreshAnswers plain(truth_.source(), set, unlimited.asset),
        shifted(truth_.source(), set, limited.asset);
    EXPECT_LE(shifted.rate(mistake_), kRate);
    EXPECT_GE(shifted.rate(other_), plain.rate(other_));
    price += shifted.rate(other_) - plain.rate(other_);
    EXPECT_EQ(plain.certain, shifted.certain);
    EXPECT_EQ(std::memcmp(plain.probability.data(), shifted.probability.data(),
                          plain.probability.size() * sizeof(float)),
              0);
    before = std::max(before, plain.rate(mistake_));
    after = std::max(after, shifted.rate(mistake_));
  }
  EXPECT_GT(price, 0);
  EXPECT_GT(before, kRate) << "the threshold had nothing to do";
  EXPECT_GT(after, kRate / 2) << "the threshold moved farther than necessary";

  // The bake's report.
  const bake::ErrorLimitReport& report = error_limit_of(limited);
  EXPECT_EQ(report.threshold, threshold);
  EXPECT_FALSE(report.proven);
  for (const RaySet set : bake::kRaySets) {
    const bake::ErrorLimitReport::Set& reached = report.sets[size_t(set)];
    EXPECT_GE(reached.rays, 200'000u) << bake::name_of(set);
    EXPECT_EQ(reached.bound, bake::rate_bound(reached.rays, reached.wrong));
    EXPECT_LE(reached.bound, kRate);
  }
  EXPECT_GT(report.sets[size_t(report.worst())].bound, 0.9 * kRate);
  const auto metadata = nlohmann::json::parse(limited.asset.metadata);
  const std::string option = "max_" + std::string(bake::name_of(mistake_));
  EXPECT_EQ(metadata["options"][option], kRate);
  const auto& stated = metadata["objects"][0]["error_limit"];
  EXPECT_EQ(stated["threshold"], threshold);
  EXPECT_LE(stated["sets"]["segments"]["bound"].get<double>(), kRate);
  EXPECT_LE(stated["sets"]["segments"][bake::name_of(mistake_)].get<double>(), kRate);
  EXPECT_FALSE(nlohmann::json::parse(unlimited.asset.metadata)["options"].contains(option));
  EXPECT_FALSE(nlohmann::json::parse(unlimited.asset.metadata)["objects"][0].contains("error_limit"));
}

TEST_P(ErrorLimits, AtARateOfZeroGivesAllOpenRaysOneAnswer) {
  bake::BakeOptions options = briefly_trained();
  options.error_limit = {mistake_, 0};
  const bake::BakeResult result = bake_quietly(scene_, options);
  EXPECT_TRUE(error_limit_of(result).proven);
  // A rate that is too low to be proven by any number of rays.
  options.error_limit->rate = 1e-9;
  const bake::BakeResult low = bake_quietly(scene_, options);
  EXPECT_TRUE(error_limit_of(low).proven);
  EXPECT_EQ(error_limit_of(low).threshold, error_limit_of(result).threshold);
  uint64_t open = 0;
  for (const RaySet set : bake::kRaySets) {
    const FreshAnswers answers(truth_.source(), set, result.asset);
    EXPECT_EQ(answers.rate(mistake_), 0) << bake::name_of(set);
    for (size_t i = 0; i < answers.truth.size(); ++i) {
      if (answers.certain[i]) continue;
      ++open;
      ASSERT_EQ(answers.visible[i] != 0, mistake_ == Mistake::spurious);
    }
  }
  EXPECT_GT(open, 10'000u);
}

INSTANTIATE_TEST_SUITE_P(Both, ErrorLimits, testing::Values(Mistake::leak, Mistake::spurious),
                         [](const auto& test) { return std::string(bake::name_of(test.param)); });

TEST(ErrorLimit, IsOfEachObjectAndTheSameForAnyNumberOfThreads) {
  const mesh::Scene scene = scene_of({torus(40, 20), icosphere(3)});
  bake::BakeOptions options = briefly_trained();
  options.error_limit = {Mistake::leak, 0.002};
  const auto baked = [&](size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    return bake_quietly(scene, options);
  };
  const bake::BakeResult one = baked(1);
  EXPECT_TRUE(format::encode(one.asset) == format::encode(baked(2).asset));
  for (size_t i = 0; i < 2; ++i) EXPECT_EQ(one.asset.mlps[i].threshold, error_limit_of(one, i).threshold);
  EXPECT_NE(one.asset.mlps[0].threshold, one.asset.mlps[1].threshold);
}

TEST(ErrorLimit, CountsForMaxError) {
  const mesh::Scene scene = scene_of({torus(80, 40)});
  bake::BakeOptions options = briefly_trained();
  const double unlimited = bake::error_bound(bake_quietly(scene, options).sets).bound;
  options.error_limit = {Mistake::leak, 0.002};
  options.max_error = 0.03;
  const bake::BakeResult limited = bake_quietly(scene, options);
  // The first bake equals the one without a limit, but its threshold makes more answers wrong.
  ASSERT_GT(limited.objects[0].bakes.size(), 1u);
  EXPECT_GT(limited.objects[0].bakes[0].second, 1.1 * unlimited);
  EXPECT_LE(bake::error_bound(limited.sets).bound, *options.max_error);
  // The report is about the field that was kept.
  const bake::ErrorLimitReport& report = error_limit_of(limited);
  EXPECT_EQ(report.threshold, limited.asset.mlps[0].threshold);
  EXPECT_LE(report.sets[size_t(report.worst())].bound, 0.002);
}

TEST(ErrorLimit, IsMetByExactObjectsAsTheyAre) {
  const mesh::Scene scene = scene_of({torus(150, 60)});
  bake::BakeOptions options = briefly_trained();
  options.resolution.reset();
  options.encoding = bake::kAutomatic;
  options.error_limit = {Mistake::leak, 0};
  const bake::BakeResult limited = bake_quietly(scene, options);
  EXPECT_EQ(limited.objects[0].encoding, "exact") << limited.objects[0].reason;
  EXPECT_EQ(nlohmann::json::parse(limited.asset.metadata)["options"]["max_leak"], 0);
  options.encoding = "bvh";
  EXPECT_EQ(bake_quietly(scene, options).objects[0].encoding, "bvh");
}

TEST(ErrorLimit, IsRefusedWhereItMeansNothing) {
  const mesh::Scene scene = scene_of({icosphere(1)});
  bake::BakeOptions options = briefly_trained();
  for (const double rate : {-0.1, 1.1, std::numeric_limits<double>::quiet_NaN()}) {
    options.error_limit = {Mistake::leak, rate};
    EXPECT_EQ(status_of(scene, options), Status::usage);
  }
  options = bake::BakeOptions();
  options.encoding = "spherical";
  options.preset = bake::Preset::paper;
  options.error_limit = {Mistake::leak, 0.1};
  EXPECT_EQ(status_of(scene, options), Status::usage);
}

}  // namespace
}  // namespace nif::test
