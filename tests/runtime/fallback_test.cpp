// nifQueryWithFallback: which rays it passes on, each once, and which answer counts.
#include <algorithm>
#include <atomic>

#include "tests/runtime/runtime_fixture.hpp"

namespace nif::test {
namespace {

class ThreadFallback : public RuntimeTest, public testing::WithParamInterface<const char*> {
 protected:
  void SetUp() override { ASSERT_EQ(nifNewDevice(GetParam(), nullptr, &device_), NIF_OK); }
};

INSTANTIATE_TEST_SUITE_P(Each, ThreadFallback, testing::Values("threads=1", "threads=3"),
                         [](const auto& p) { return p.param[8] == '1' ? "Alone" : "Shared"; });

/// Answers the opposite of the network for even rays, and records the rays that it got.
struct Contrary {
  explicit Contrary(size_t count) : times(count) {}
  static void call(void* user, uint64_t count, const uint64_t* rays, uint8_t* visible) {
    auto& self = *static_cast<Contrary*>(user);
    EXPECT_TRUE(count >= 1 && count <= 1024);
    EXPECT_TRUE(std::is_sorted(rays, rays + count));
    for (uint64_t k = 0; k < count; ++k) {
      ++self.times[rays[k]];
      if (rays[k] % 2 == 0) visible[k] ^= 1;
    }
  }
  std::vector<std::atomic<int>> times;
};

TEST_P(ThreadFallback, ReplacesUncertainAnswers) {
  size_t most = 0;
  for (uint64_t seed = 0; seed < 6; ++seed) {
    const format::AssetView& view = make(seed);
    const NifScene scene = new_scene();
    ASSERT_EQ(nifAddAsset(scene, load(), nullptr, nullptr, nullptr), NIF_OK);
    ASSERT_EQ(nifCommitScene(scene), NIF_OK);
    Random random(seed);
    const auto rays = random_rays(random, view.objects[0].as<kernels::SegmentField>(), 7001);
    const Answers plain = query_all(scene, rays);
    size_t before = 0;
    for (const float confidence : {0.0f, 0.5f, 0.7f, 0.95f, 1.0f, 1.5f}) {
      SCOPED_TRACE(confidence);
      Contrary contrary(rays.size());
      Answers answers(rays.size());
      NifRays query = nifMakeRays(rays.data(), rays.size());
      NifAnswers outputs = answers.outputs();
      ASSERT_EQ(nifQueryWithFallback(scene, &query, &outputs, confidence, Contrary::call, &contrary), NIF_OK);
      size_t asked = 0;
      for (size_t i = 0; i < rays.size(); ++i) {
        const float p = plain.probability[i];
        const bool handed_over = !plain.certain[i] && std::max(p, 1 - p) < confidence;
        ASSERT_EQ(contrary.times[i], int(handed_over)) << i;
        asked += handed_over;
        const uint8_t visible = handed_over && i % 2 == 0 ? !plain.visible[i] : plain.visible[i];
        ASSERT_EQ(answers.visible[i], visible);
        ASSERT_EQ(answers.bits[i / 8] >> (i % 8) & 1, visible);
        if (handed_over) {
          ASSERT_EQ(answers.certain[i], 1);
          ASSERT_EQ(answers.probability[i], visible ? 1.0f : 0.0f);
          ASSERT_EQ(answers.logit[i], visible ? NIF_LOGIT_CERTAIN : -NIF_LOGIT_CERTAIN);
        } else {
          ASSERT_EQ(answers.certain[i], plain.certain[i]);
          ASSERT_EQ(answers.probability[i], plain.probability[i]);
          ASSERT_EQ(answers.logit[i], plain.logit[i]);
        }
      }
      EXPECT_GE(asked, before);
      if (confidence <= 0.5f) {
        EXPECT_EQ(asked, 0u);
      }
      before = asked;

      // A single output has the same values.
      Contrary again(rays.size());
      std::vector<uint8_t> bits((rays.size() + 7) / 8);
      outputs = nifkit::sized<NifAnswers>();
      outputs.visible_bits = bits.data();
      ASSERT_EQ(nifQueryWithFallback(scene, &query, &outputs, confidence, Contrary::call, &again), NIF_OK);
      EXPECT_EQ(bits, answers.bits);
    }
    most = std::max(most, before);
  }
  EXPECT_GT(most, 1000u);
}

}  // namespace
}  // namespace nif::test
