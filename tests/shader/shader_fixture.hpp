// What the tests of shaders share: compiled shaders, and rays answered by them.
#pragma once

#include <gtest/gtest.h>
#include <nif/nif.hpp>

#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "kernels/reference/encodings/reference_segment.hpp"
#include "kernels/reference/instance.hpp"
#include "kernels/reference/scene_query.hpp"
#include "tests/shader/vulkan_compute.hpp"

namespace nif::test {

/// The code of a shader that tests/shader/CMakeLists.txt compiles.
inline std::vector<uint32_t> shader_code(const std::string& name) {
  std::ifstream file(std::string(NIF_SHADER_FOLDER) + "/" + name + ".spv", std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(file), {}};
  if (bytes.empty()) throw std::runtime_error("there is no shader " + name);
  std::vector<uint32_t> words(bytes.size() / 4);
  std::memcpy(words.data(), bytes.data(), 4 * words.size());
  return words;
}

struct ShaderAnswer {
  uint32_t visible, certain;
  int32_t logit;
  float probability, open_begin, open_end;
  uint32_t instance;
};

/// What first_hits.comp writes.
struct ShaderHit {
  uint32_t hit, certain, triangle, instance;
  float t, u, v, unused, normal[3], unused_2, color[3], unused_3;
};
constexpr size_t kHitWords = sizeof(ShaderHit) / 4;

/// Runs a shader for rays by tables that begin at word `object` of `words`; returns what it writes, `each` words a ray.
inline std::vector<uint32_t> run_for_rays(VulkanCompute& vulkan, const std::vector<uint32_t>& code,
                                          const std::vector<uint32_t>& words, uint32_t object,
                                          const std::vector<kernels::Segment>& rays, uint32_t mask,
                                          size_t each) {
  std::vector<uint32_t> input = {object, mask, uint32_t(rays.size()), 0};
  for (const kernels::Segment& ray : rays) {
    for (const float value : ray.origin) input.push_back(std::bit_cast<uint32_t>(value));
    input.push_back(std::bit_cast<uint32_t>(ray.tmin));
    for (const float value : ray.direction) input.push_back(std::bit_cast<uint32_t>(value));
    input.push_back(std::bit_cast<uint32_t>(ray.tmax));
  }
  return vulkan.run(code, words, input, each * rays.size(), uint32_t(rays.size() + 63) / 64);
}

inline std::vector<ShaderAnswer> ask_shader(VulkanCompute& vulkan, const std::vector<uint32_t>& code,
                                            const std::vector<uint32_t>& words, uint32_t object,
                                            const std::vector<kernels::Segment>& rays,
                                            uint32_t mask = 0xffffffffu) {
  const auto output = run_for_rays(vulkan, code, words, object, rays, mask, 8);
  std::vector<ShaderAnswer> answers(rays.size());
  for (size_t i = 0; i < rays.size(); ++i) {
    const uint32_t* at = &output[8 * i];
    answers[i] = {at[0],
                  at[1],
                  int32_t(at[2]),
                  std::bit_cast<float>(at[3]),
                  std::bit_cast<float>(at[4]),
                  std::bit_cast<float>(at[5]),
                  at[6]};
  }
  return answers;
}

inline std::vector<ShaderHit> hits_of_shader(VulkanCompute& vulkan, const std::vector<uint32_t>& code,
                                             const std::vector<uint32_t>& words,
                                             const std::vector<kernels::Segment>& rays,
                                             uint32_t mask = 0xffffffffu) {
  const auto output = run_for_rays(vulkan, code, words, 0, rays, mask, kHitWords);
  std::vector<ShaderHit> hits(rays.size());
  if (!hits.empty()) std::memcpy(hits.data(), output.data(), sizeof(ShaderHit) * hits.size());
  return hits;
}

/// Differences from the CPU's answers, counted for each output.
struct Differences {
  size_t visible = 0, certain = 0, logit = 0, open = 0, probability = 0;
  size_t uncertain = 0;  ///< rays that nothing proves, of the CPU
  size_t all() const { return visible + certain + logit + open; }
};
inline std::ostream& operator<<(std::ostream& out, const Differences& found) {
  return out << found.visible << " visible, " << found.certain << " certain, " << found.logit << " logits, "
             << found.open << " intervals, " << found.probability << " probabilities; " << found.uncertain
             << " rays are uncertain";
}

/// Fixture of tests that run shaders; skips them where Vulkan has no device.
class ShaderTest : public testing::Test {
 protected:
  void SetUp() override {
    try {
      vulkan_ = std::make_unique<VulkanCompute>();
    } catch (const std::runtime_error& error) {
      GTEST_SKIP() << error.what() << " (tools/setup.sh shader installs one that runs on the CPU)";
    }
  }
  /// The validation layer must have nothing to say.
  void TearDown() override {
    if (!vulkan_) return;
    for (const std::string& message : vulkan_->messages()) ADD_FAILURE() << message;
  }

  /// Compares a shader with the reference. `field`: of the object whose tables begin at `object`.
  template <class Field>
  Differences compare(const Field& field, const std::vector<uint32_t>& words, uint32_t object,
                      const std::vector<kernels::Segment>& rays, const std::string& query = "query",
                      const std::string& prove = "prove") {
    Differences found;
    const auto asked = ask_shader(*vulkan_, shader_code(query), words, object, rays);
    const auto proven = ask_shader(*vulkan_, shader_code(prove), words, object, rays);
    const kernels::Calibration calibration = kernels::calibration(field);
    for (size_t i = 0; i < rays.size(); ++i) {
      const kernels::Answer answer = kernels::query(field, rays[i]);
      kernels::OpenInterval open;
      const kernels::PlanesField& planes = field;
      kernels::Answer proof = kernels::prove(planes, rays[i], open);
      kernels::BoxRay prepared;
      // As nifQueryOpen lists rays.
      if (!proof.certain && !(proof.visible && !kernels::prepare_box_ray(rays[i], prepared)))
        proof = {false, false, kernels::kOpenLogit};
      found.visible += asked[i].visible != answer.visible || proven[i].visible != proof.visible;
      found.certain += asked[i].certain != answer.certain || proven[i].certain != proof.certain;
      found.logit += asked[i].logit != answer.logit || proven[i].logit != proof.logit;
      found.uncertain += !answer.certain;
      if (proof.logit == kernels::kOpenLogit)
        for (const ShaderAnswer* each : {&asked[i], &proven[i]})
          found.open += each->open_begin != open.begin || each->open_end != open.end;
      const float probability = kernels::visible_probability(answer.logit, calibration);
      found.probability += !(std::abs(asked[i].probability - probability) <= 1e-5f);
    }
    return found;
  }

  std::unique_ptr<VulkanCompute> vulkan_;
};

}  // namespace nif::test
