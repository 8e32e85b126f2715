// Some random scenes by every instruction set (tests/nightly.sh compares more), and what the comparison must find.
#include <gtest/gtest.h>

#include "tests/exact/compare_scene.hpp"

namespace nif::test {
namespace {

TEST(SceneRays, HaveTheSameBitsByEveryKernel) {
  const std::vector<std::vector<Way>> ways = make_scene_ways();
  SceneTally all;
  uint64_t most = 0, least = UINT64_MAX;
  for (uint64_t number = 0; all.rays < 12'000; ++number) {
    const RandomScene scene(2, number);
    if (scene.rays().size() > 1000 || scene.instances() > 1000) continue;  // rather more scenes
    most = std::max<uint64_t>(most, scene.instances());
    least = std::min<uint64_t>(least, scene.instances());
    const SceneTally tally = compare(scene, ways, number);
    for (const std::string& finding : tally.findings) ADD_FAILURE() << finding;
    all += tally;
  }
  EXPECT_EQ(all.differing, 0u);
  // Scenes that nothing can happen in would show nothing.
  EXPECT_GT(most, 300u);
  EXPECT_LT(least, 10u);
  EXPECT_GT(all.certain, all.rays / 4);
  EXPECT_GT(all.hit, all.rays / 4);
  EXPECT_GT(all.open, all.rays / 50);
}

TEST(SceneRays, OfVeryManyInstancesHaveTheSameBits) {
  const std::vector<std::vector<Way>> ways = make_scene_ways();
  SceneTally all;
  for (uint64_t number = 0; all.rays < 3'000; ++number) {
    const RandomScene scene(4, number);
    if (scene.rays().size() != 1000 || scene.instances() < 3000) continue;
    const SceneTally tally = compare(scene, ways, number);
    for (const std::string& finding : tally.findings) ADD_FAILURE() << finding;
    all += tally;
  }
  EXPECT_EQ(all.differing, 0u);
  EXPECT_GT(all.hit, all.rays / 4);
}

TEST(SceneRays, OneBitIsEnoughToDiffer) {
  const std::vector<std::vector<Way>> ways = make_scene_ways();
  uint64_t number = 0;
  while (RandomScene(3, number).rays().size() != 100) ++number;
  const RandomScene scene(3, number);
  const Said right = scene.expected();
  ASSERT_EQ(compare_with(right, scene, ways, number).differing, 0u);
  const auto differing = [&](const auto& change) {
    Said wrong = right;
    change(wrong);
    const SceneTally tally = compare_with(wrong, scene, ways, number);
    EXPECT_GE(tally.findings.size(), ways.size() - 1);
    return tally.differing;
  };
  EXPECT_EQ(differing([](Said& said) { said.visible[3] ^= 1; }), 1u);
  EXPECT_EQ(differing([](Said& said) { said.certain[99] ^= 1; }), 1u);
  EXPECT_EQ(differing([](Said& said) { said.logit[7] += 1; }), 1u);
  EXPECT_EQ(differing([](Said& said) { said.open[0] -= 1; }), 1u);
  EXPECT_EQ(differing([](Said& said) { said.hits.t[5] = -said.hits.t[5]; }), 1u);
  EXPECT_EQ(differing([](Said& said) { said.hits.normal[6 * 3 + 2] -= 0.25f; }), 1u);
  EXPECT_EQ(differing([](Said& said) { said.hits.low[8] = 2, said.hits.instance[9] ^= 1; }), 2u);
}

}  // namespace
}  // namespace nif::test
