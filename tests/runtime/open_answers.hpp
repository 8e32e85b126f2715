// Calls nifQueryOpen for tests, and holds its answers.
#pragma once

#include <algorithm>
#include <cmath>

#include "tests/runtime/runtime_fixture.hpp"
#include "tests/support/query_object.hpp"

namespace nif::test {

struct OpenRay {
  uint32_t ray;
  float tmin, tmax;
  auto operator<=>(const OpenRay&) const = default;
};

struct OpenAnswers : Answers {
  using Answers::Answers;
  uint32_t count = 0xcccccccc;
  std::vector<OpenRay> open;  ///< by ray
};

inline OpenAnswers query_open(NifScene scene, const std::vector<NifRay>& rays, size_t capacity) {
  OpenAnswers answers(rays.size());
  NifRays query = nifMakeRays(rays.data(), rays.size());
  const NifAnswers outputs = answers.outputs();
  std::vector<uint32_t> numbers(capacity);
  std::vector<float> tmin(capacity), tmax(capacity);
  NifOpenRays open{};
  open.struct_size = sizeof(open);
  open.capacity = capacity;
  open.rays = numbers.data();
  open.tmin = tmin.data();
  open.tmax = tmax.data();
  open.count = &answers.count;
  EXPECT_EQ(nifQueryOpen(scene, &query, &outputs, &open), NIF_OK) << nifGetErrorMessage();
  for (size_t k = 0; k < std::min<size_t>(capacity, answers.count); ++k)
    answers.open.push_back({numbers[k], tmin[k], tmax[k]});
  std::sort(answers.open.begin(), answers.open.end());
  return answers;
}

/// Rays near the objects of an asset, and some invalid ones.
inline std::vector<NifRay> rays_near(const format::AssetView& view, uint64_t seed, size_t count) {
  Random random(seed);
  std::vector<NifRay> rays;
  while (rays.size() < count) {
    const auto object = random.below(uint32_t(view.objects.size()));
    rays.push_back(to_ray(random_segment(random, view.objects[object])));
    if (random.below(50) == 0) rays.back().direction[random.below(3)] = std::nanf("");
    if (random.below(50) == 0) rays.back().tmax = -1;
    if (random.below(50) == 0) rays.back().tmax = std::nanf("");
    if (random.below(50) == 0) rays.back().origin[random.below(3)] *= 1e6f;
  }
  return rays;
}

}  // namespace nif::test
