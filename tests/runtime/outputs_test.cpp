// With one object the runtime gives the reference's answers, for every layout of rays and every set of
// outputs.
#include <algorithm>
#include <cfenv>
#include <cmath>
#include <cstring>
#if defined(__SSE__)
#include <xmmintrin.h>
#endif

#include "tests/runtime/runtime_fixture.hpp"

namespace nif::test {
namespace {

class Outputs : public RuntimeTest {};

TEST_F(Outputs, EqualTheReference) {
  uint64_t learned = 0, occluded = 0, shifted = 0;
  for (uint64_t seed = 0; seed < 12; ++seed) {
    const format::AssetView& view = make(seed);
    const NifAsset asset = load();
    Random random(seed);
    for (uint32_t object = 0; object < view.objects.size(); ++object) {
      const kernels::SegmentField& field = view.objects[object].as<kernels::SegmentField>();
      const auto rays = random_rays(random, field, 1003);
      const Answers answers = query_all(scene_of(asset, object), rays);
      for (size_t i = 0; i < rays.size(); ++i) {
        const kernels::Answer expected = kernels::query(field, to_segment(rays[i]));
        ASSERT_EQ(answers.visible[i], expected.visible);
        ASSERT_EQ(answers.bits[i / 8] >> (i % 8) & 1, expected.visible);
        ASSERT_EQ(answers.certain[i], expected.certain);
        ASSERT_EQ(answers.logit[i], expected.logit);
        if (expected.certain) {
          ASSERT_EQ(answers.probability[i], expected.visible ? 1.0f : 0.0f);
        } else if (std::abs(expected.logit) != kernels::kCertainLogit) {
          const auto [scale, threshold] = field.network.calibration;
          const double p = 1 / (1 + std::exp(-double(expected.logit + threshold) * double(scale)));
          ASSERT_NEAR(answers.probability[i], p, 1e-5);
          ASSERT_EQ(expected.logit >= 0, expected.visible);
          ASSERT_EQ(answers.probability[i] >= 0.5f, expected.logit + threshold >= 0);
          shifted += (answers.probability[i] >= 0.5f) != expected.visible;
          ++learned;
        }
        occluded += !expected.visible;
      }
      ASSERT_EQ(answers.bits.back() >> (rays.size() % 8), 0) << "unused bits";
    }
  }
  EXPECT_GT(learned, 1000u);
  EXPECT_GT(shifted, 50u);
  EXPECT_GT(occluded, 1000u);
}

TEST_F(Outputs, DoNotDependOnEachOther) {
  const format::AssetView& view = make(20);
  const NifScene scene = new_scene();
  ASSERT_EQ(nifAddAsset(scene, load(), nullptr, nullptr, nullptr), NIF_OK);
  ASSERT_EQ(nifCommitScene(scene), NIF_OK);
  Random random(20);
  const auto rays = random_rays(random, view.objects[0].as<kernels::SegmentField>(), 777);
  const Answers all = query_all(scene, rays);
  for (int alone = 0; alone < 5; ++alone) {
    Answers answers(rays.size());
    const NifRays query = nifMakeRays(rays.data(), rays.size());
    auto outputs = nifkit::sized<NifAnswers>();
    if (alone == 0) outputs.visible = answers.visible.data();
    if (alone == 1) outputs.visible_bits = answers.bits.data();
    if (alone == 2) outputs.certain = answers.certain.data();
    if (alone == 3) outputs.probability = answers.probability.data();
    if (alone == 4) outputs.logit = answers.logit.data();
    ASSERT_EQ(nifQuery(scene, &query, &outputs), NIF_OK);
    if (alone == 0) {
      EXPECT_EQ(answers.visible, all.visible);
    }
    if (alone == 1) {
      EXPECT_EQ(answers.bits, all.bits);
    }
    if (alone == 2) {
      EXPECT_EQ(answers.certain, all.certain);
    }
    if (alone == 3) {
      EXPECT_EQ(answers.probability, all.probability);
    }
    if (alone == 4) {
      EXPECT_EQ(answers.logit, all.logit);
    }
  }
  for (size_t i = 0; i < rays.size(); ++i) {
    uint8_t visible = 9;
    const NifAnswers one = only_visible(&visible);
    ASSERT_EQ(nifQueryRay(scene, &rays[i], &one), NIF_OK);
    ASSERT_EQ(visible, all.visible[i]);
  }
}

TEST_F(Outputs, EveryLayout) {
  const format::AssetView& view = make(21);
  const NifScene scene = scene_of(load(), 0);
  Random random(21);
  const auto rays = random_rays(random, view.objects[0].as<kernels::SegmentField>(), 301);
  const Answers expected = query_all(scene, rays);
  const auto check = [&](NifRays query) {
    Answers answers(rays.size());
    const NifAnswers outputs = answers.outputs();
    ASSERT_EQ(nifQuery(scene, &query, &outputs), NIF_OK);
    EXPECT_EQ(answers, expected);
  };

  // Structure of arrays.
  std::vector<float> columns[8];
  for (const NifRay& ray : rays) {
    for (size_t a = 0; a < 3; ++a) {
      columns[a].push_back(ray.origin[a]);
      columns[3 + a].push_back(ray.direction[a]);
    }
    columns[6].push_back(ray.tmin);
    columns[7].push_back(ray.tmax);
  }
  auto soa = nifkit::sized<NifRays>();
  soa.count = rays.size();
  for (int a = 0; a < 3; ++a) {
    soa.origin[a] = columns[a].data();
    soa.direction[a] = columns[3 + a].data();
  }
  soa.tmin = columns[6].data();
  soa.tmax = columns[7].data();
  soa.origin_stride = soa.direction_stride = soa.tmin_stride = soa.tmax_stride = sizeof(float);
  check(soa);

  // Columns that are read backwards.
  auto backwards = soa;
  for (auto& column : columns) std::reverse(column.begin(), column.end());
  for (int a = 0; a < 3; ++a) {
    backwards.origin[a] += rays.size() - 1;
    backwards.direction[a] += rays.size() - 1;
  }
  backwards.tmin += rays.size() - 1;
  backwards.tmax += rays.size() - 1;
  backwards.origin_stride = backwards.direction_stride = uint64_t(0) - sizeof(float);
  backwards.tmin_stride = backwards.tmax_stride = uint64_t(0) - sizeof(float);
  check(backwards);

  // Packed structures of 33 bytes at an odd address, in a block that ends with the last ray.
  std::vector<char> packed(1 + rays.size() * 33);
  for (size_t i = 0; i < rays.size(); ++i) std::memcpy(packed.data() + 1 + i * 33, &rays[i], sizeof(NifRay));
  const auto at = [&](size_t offset) { return reinterpret_cast<const float*>(packed.data() + 1 + offset); };
  auto odd = nifkit::sized<NifRays>();
  odd.count = rays.size();
  for (size_t a = 0; a < 3; ++a) {
    odd.origin[a] = at(offsetof(NifRay, origin) + 4 * a);
    odd.direction[a] = at(offsetof(NifRay, direction) + 4 * a);
  }
  odd.tmin = at(offsetof(NifRay, tmin));
  odd.tmax = at(offsetof(NifRay, tmax));
  odd.origin_stride = odd.direction_stride = odd.tmin_stride = odd.tmax_stride = 33;
  check(odd);
}

TEST_F(Outputs, SharedValuesAndDefaults) {
  const format::AssetView& view = make(22);
  const NifScene scene = scene_of(load(), 0);
  Random random(22);
  auto rays = random_rays(random, view.objects[0].as<kernels::SegmentField>(), 200);
  const NifRay first = rays[0];
  for (NifRay& ray : rays) {
    std::copy_n(first.direction, 3, ray.direction);
    ray.tmin = 0;
    ray.tmax = std::numeric_limits<float>::infinity();
  }
  const Answers expected = query_all(scene, rays);
  NifRays query = nifMakeRays(rays.data(), rays.size());
  for (int a = 0; a < 3; ++a) query.direction[a] = &first.direction[a];
  query.direction_stride = 0;
  query.tmin = query.tmax = nullptr;
  Answers answers(rays.size());
  const NifAnswers outputs = answers.outputs();
  ASSERT_EQ(nifQuery(scene, &query, &outputs), NIF_OK);
  EXPECT_EQ(answers, expected);
}

TEST_F(Outputs, UnalignedOutputs) {
  const format::AssetView& view = make(23);
  const NifScene scene = scene_of(load(), 0);
  Random random(23);
  const auto rays = random_rays(random, view.objects[0].as<kernels::SegmentField>(), 50);
  const Answers expected = query_all(scene, rays);
  std::vector<char> memory(1 + 4 * rays.size());
  NifRays query = nifMakeRays(rays.data(), rays.size());
  auto outputs = nifkit::sized<NifAnswers>();
  outputs.logit = reinterpret_cast<int32_t*>(memory.data() + 1);
  ASSERT_EQ(nifQuery(scene, &query, &outputs), NIF_OK);
  EXPECT_EQ(std::memcmp(memory.data() + 1, expected.logit.data(), 4 * rays.size()), 0);
  outputs.logit = nullptr;
  outputs.probability = reinterpret_cast<float*>(memory.data() + 1);
  ASSERT_EQ(nifQuery(scene, &query, &outputs), NIF_OK);
  EXPECT_EQ(std::memcmp(memory.data() + 1, expected.probability.data(), 4 * rays.size()), 0);
}

TEST_F(Outputs, FloatingPointEnvironment) {
  const format::AssetView& view = make(24);
  const NifAsset asset = load();
  const std::array<float, 12> transform{0.3f, 0.1f, 0, 7, -0.2f, 1.7f, 0.1f, 0, 0, 0.4f, 0.9f, 1};
  Random random(24);
  const auto rays = random_rays(random, view.objects[0].as<kernels::SegmentField>(), 2000);
  const NifScene before = scene_of(asset, 0, transform.data());
  const Answers expected = query_all(before, rays);
  for (const int rounding : {FE_UPWARD, FE_DOWNWARD, FE_TOWARDZERO}) {
    ASSERT_EQ(std::fesetround(rounding), 0);
#if defined(__SSE__)
    // Flush denormals to zero, in and out; trap on everything that can be trapped.
    const unsigned wanted = (_mm_getcsr() | 0x8040) & ~0x1fbfu;
    _mm_setcsr(wanted);
#endif
    const NifScene scene = scene_of(asset, 0, transform.data());
    const Answers answers = query_all(scene, rays);
    uint8_t visible;
    const NifAnswers one = only_visible(&visible);
    EXPECT_EQ(nifQueryRay(scene, &rays[0], &one), NIF_OK);
    EXPECT_EQ(nifQueryRay(scene, nullptr, &one), NIF_ERROR_INVALID_ARGUMENT);
    EXPECT_EQ(std::fegetround(), rounding);
#if defined(__SSE__)
    EXPECT_EQ(_mm_getcsr(), wanted);
    _mm_setcsr(0x1f80);
#endif
    std::fesetround(FE_TONEAREST);
    EXPECT_EQ(answers, expected);
  }
}

}  // namespace
}  // namespace nif::test
