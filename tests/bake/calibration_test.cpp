// The expected calibration error is what docs/ray-sets.md says, on answers that are made up.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "bake/ground_truth/evaluate.hpp"
#include "bake/report.hpp"
#include "tests/support/occupied_object.hpp"
#include "tests/support/test_shapes.hpp"

namespace nif::test {
namespace {

struct MadeUp {
  float probability;
  bool truth;
  bool certain = false;
};

/// The accuracy of these answers, each given `times` times.
bake::Accuracy accuracy_of(const std::vector<MadeUp>& answers, size_t times = 1) {
  static const OccupiedObject sphere{icosphere(1), 8};
  bake::RaysWithTruth rays;
  for (size_t n = 0; n < times; ++n)
    for (size_t i = 0; i < answers.size(); ++i) {
      kernels::Segment ray{{0, 0, 5}, {0, 0, 1}, float(i), 10'000};  // tmin says which answer is meant
      rays.segments.push_back(ray);
      rays.visible.push_back(answers[i].truth);
    }
  rays.group_ends = {rays.segments.size()};
  const auto answer = [&](std::span<const kernels::Segment> segments, const bake::Answers& out) {
    for (size_t i = 0; i < segments.size(); ++i) {
      const MadeUp& made_up = answers[size_t(segments[i].tmin)];
      out.visible[i] = made_up.probability >= 0.5f;
      out.certain[i] = made_up.certain;
      out.probability[i] = made_up.probability;
    }
  };
  return bake::evaluate(rays, answer, sphere.truth->source().embree);
}

TEST(Calibration, IsTheMeanDistanceOfProbabilityAndShareOverBins) {
  // 0.2 to 0.3: mean 0.25, a quarter visible: right. 0.5 to 0.6: mean 0.5, all visible. 0.9 to 1: mean 0.95,
  // half visible. So (4 x 0 + 2 x 0.5 + 2 x 0.45) / 8.
  const std::vector<MadeUp> answers{{0.25f, true}, {0.25f, false}, {0.25f, false}, {0.25f, false},
                                    {0.5f, true},  {0.5f, true},   {0.9f, false},  {1.0f, true}};
  for (const size_t times : {1, 3000}) {
    const bake::Accuracy accuracy = accuracy_of(answers, times);
    EXPECT_NEAR(accuracy.calibration_error(), (2 * 0.5 + 2 * 0.45) / 8, 1e-6);
    EXPECT_EQ(accuracy.uncertain(), 8 * times);
    EXPECT_EQ(accuracy.bins[2].rays, 4 * times);
    EXPECT_EQ(accuracy.bins[2].visible, times);
    EXPECT_NEAR(accuracy.bins[2].mean(), 0.25, 1e-6);
    EXPECT_DOUBLE_EQ(accuracy.bins[2].share(), 0.25);
    EXPECT_EQ(accuracy.bins[5].rays, 2 * times);
    EXPECT_EQ(accuracy.bins[9].rays, 2 * times);
    EXPECT_EQ(accuracy.bins[0].rays, 0u);
  }
}

TEST(Calibration, LeavesCertainAnswersOut) {
  const std::vector<MadeUp> learned{{0.75f, true}, {0.75f, false}};
  std::vector<MadeUp> all = learned;
  for (int i = 0; i < 10; ++i) all.push_back({1, true, true}), all.push_back({0, false, true});
  EXPECT_NEAR(accuracy_of(learned).calibration_error(), 0.25, 1e-6);
  EXPECT_DOUBLE_EQ(accuracy_of(all).calibration_error(), accuracy_of(learned).calibration_error());
  EXPECT_EQ(accuracy_of(all).bins[9].rays, 0u);
  const bake::Accuracy proven = accuracy_of({{1, true, true}});
  EXPECT_EQ(proven.calibration_error(), 0);
  EXPECT_EQ(proven.uncertain(), 0u);
}

TEST(Calibration, TakesProbabilitiesAtAndBeyondTheEnds) {
  const bake::Accuracy accuracy =
      accuracy_of({{0, false}, {1, true}, {std::nanf(""), false}, {-1, false}, {2, true}, {0.0999f, false}});
  EXPECT_EQ(accuracy.bins[0].rays, 4u);
  EXPECT_EQ(accuracy.bins[9].rays, 2u);
}

TEST(Calibration, AddsUpOverObjects) {
  bake::Accuracy sum = accuracy_of({{0.75f, true}, {0.75f, true}});  // off by +0.25
  sum += accuracy_of({{0.75f, false}, {0.75f, true}});               // together they are right
  EXPECT_NEAR(sum.calibration_error(), 0, 1e-6);
  EXPECT_EQ(sum.bins[7].rays, 4u);
  EXPECT_EQ(sum.bins[7].visible, 3u);
}

TEST(Calibration, IsInTheJsonOfSetsWithUncertainAnswers) {
  bake::SetAccuracies sets{};
  sets[size_t(bake::RaySet::outer_lines)] = accuracy_of({{0.75f, true}, {0.75f, false}});
  sets[size_t(bake::RaySet::segments)] = accuracy_of({{1, true, true}});
  nlohmann::ordered_json json = bake::to_json(sets);
  EXPECT_FALSE(json["outer-lines"].contains("calibration_error")) << "metadata is kept short";
  bake::add_calibration(sets, false, json);
  EXPECT_NEAR(json["outer-lines"]["calibration_error"].get<double>(), 0.25, 1e-6);
  EXPECT_FALSE(json["outer-lines"].contains("calibration"));
  EXPECT_FALSE(json["segments"].contains("calibration_error"));
  bake::add_calibration(sets, true, json);
  const nlohmann::ordered_json& bins = json["outer-lines"]["calibration"];
  ASSERT_EQ(bins.size(), 10u);
  EXPECT_EQ(bins[0], (nlohmann::ordered_json{{"rays", 0}}));
  EXPECT_EQ(bins[7], (nlohmann::ordered_json{{"rays", 2}, {"probability", 0.75}, {"visible", 0.5}}));
  EXPECT_FALSE(json["segments"].contains("calibration"));
}

}  // namespace
}  // namespace nif::test
