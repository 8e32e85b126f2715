// Loads assets for tests of kernels, makes rays, and has the reference's answers to compare with.
#pragma once

#include <gtest/gtest.h>

#include <cmath>

#include "formats/nif/writer.hpp"
#include "tests/gpu/object_on_gpu.hpp"
#include "tests/support/query_object.hpp"

namespace nif::test {

/// An asset whose memory stays.
struct Loaded {
  std::vector<std::byte> file;
  format::AssetView view;

  explicit Loaded(const format::Asset& asset)
      : file(format::encode(asset)), view(format::read_asset(file, "test")) {}
  Loaded(uint64_t seed, const RandomAssetOptions& options)
      : file(format::encode(random_asset(seed, options))), view(format::read_asset(file, "test")) {}
};

inline std::vector<kernels::Segment> random_segments(const format::ObjectView& object, uint64_t seed,
                                                     uint32_t count) {
  Random random(seed);
  std::vector<kernels::Segment> segments;
  for (uint32_t i = 0; i < count; ++i) segments.push_back(random_segment(random, object));
  return segments;
}

/// Includes NaN and numbers that are too large.
inline void spoil(std::vector<kernels::Segment>& segments, uint64_t seed) {
  const float odd[] = {NAN,    INFINITY, -INFINITY, 0.0f,  -0.0f, 1e-45f,
                       1e-30f, 3e38f,    -3e38f,    1e20f, 1.0f,  0.5f};
  Random random(seed);
  for (kernels::Segment& s : segments) {
    float* members[] = {&s.origin[0],    &s.origin[1],    &s.origin[2],    &s.tmin,
                        &s.direction[0], &s.direction[1], &s.direction[2], &s.tmax};
    for (uint32_t k = random.below(4); k > 0; --k)
      *members[random.below(8)] = odd[random.below(std::size(odd))];
  }
}

inline void expect_reference(const format::ObjectView& object, const std::vector<kernels::Segment>& segments,
                             const ObjectAnswers& answers) {
  for (size_t i = 0; i < segments.size(); ++i) {
    const kernels::Answer expected = query_object(object, segments[i]);
    ASSERT_EQ(answers.logit[i], expected.logit) << "ray " << i;
    ASSERT_EQ(answers.certain[i], uint8_t(expected.certain)) << "ray " << i;
    ASSERT_EQ(answers.logit[i] >= 0, expected.visible) << "ray " << i;
  }
}

/// The same of an object that is put on a GPU for it.
inline void expect_reference(const format::ObjectView& object, const std::vector<kernels::Segment>& segments,
                             const EmulatedWay& way) {
  expect_reference(object, segments, ObjectOnGpu(format::field_of(object), way).ask(segments));
}

/// Tests that are made for each way.
class GpuWayTest : public testing::TestWithParam<EmulatedWay> {
 protected:
  void SetUp() override {
    machine().order = 0;
    machine().processors = 3;
  }
  static EmulatedMachine& machine() { return emulated_machine(NIF_EMULATED_MODULE); }
};
inline std::string name_of_way(const testing::TestParamInfo<EmulatedWay>& info) { return info.param.name(); }

}  // namespace nif::test
