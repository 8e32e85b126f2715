// What gpu_proof compares: the outputs of one call, whether they differ for a ray, and a text for those that do.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <nif/nif.hpp>
#include <string>
#include <vector>

#include "tests/support/test_first_hits.hpp"

namespace nif::test {

/// All outputs.
struct Outputs {
  std::vector<uint8_t> visible, bits, certain;
  std::vector<float> probability;
  std::vector<int32_t> logit;

  explicit Outputs(size_t count)
      : visible(count), bits((count + 7) / 8), certain(count), probability(count), logit(count) {}
  nifkit::Answers answers() {
    return nifkit::Answers()
        .visible(visible)
        .visible_bits(bits)
        .probability(probability)
        .certain(certain)
        .logit(logit);
  }
};

/// Does any output of a ray differ: in any bit, or for probabilities in more than their last bits?
inline bool differ(const Outputs& a, const Outputs& b, size_t i) {
  const float p = a.probability[i], q = b.probability[i];
  const bool near = q == 0 ? p == 0 : std::fabs(p / q - 1) < 1e-6f;
  return a.visible[i] != b.visible[i] || a.certain[i] != b.certain[i] || a.logit[i] != b.logit[i] ||
         (a.bits[i / 8] >> i % 8 & 1) != b.visible[i] || !near;
}
/// The same where only visibility was asked for.
inline bool differ_visibly(const Outputs& a, const Outputs& b, size_t i) {
  return a.visible[i] != b.visible[i] || (a.bits[i / 8] >> i % 8 & 1) != b.visible[i];
}

/// The result of nifQueryOpen, with its lists sorted by ray, so that their order does not matter.
struct OpenOutputs : Outputs {
  using Outputs::Outputs;
  uint32_t count = 0;
  std::vector<uint32_t> listed;    ///< of each ray: how often the list has it
  std::vector<float> tmin, tmax;   ///< of each ray, 0 where it is not in the list
  std::vector<uint32_t> instance;  ///< likewise

  void take(const std::vector<uint32_t>& rays, const std::vector<float>& from, const std::vector<float>& to,
            const std::vector<uint32_t>& instances) {
    for (auto* each : {&listed, &instance}) each->assign(visible.size(), 0);
    for (auto* each : {&tmin, &tmax}) each->assign(visible.size(), 0);
    for (size_t k = 0; k < std::min<size_t>(count, rays.size()); ++k) {
      if (rays[k] >= visible.size()) continue;  // then the counts of the others tell
      ++listed[rays[k]];
      tmin[rays[k]] = from[k];
      tmax[rays[k]] = to[k];
      instance[rays[k]] = instances[k];
    }
  }
};

inline bool differ(const OpenOutputs& a, const OpenOutputs& b, size_t i) {
  return differ(static_cast<const Outputs&>(a), static_cast<const Outputs&>(b), i) ||
         a.listed[i] != b.listed[i] || a.instance[i] != b.instance[i] ||
         std::memcmp(&a.tmin[i], &b.tmin[i], sizeof(float)) != 0 ||
         std::memcmp(&a.tmax[i], &b.tmax[i], sizeof(float)) != 0;
}

inline bool differ(const FirstHits& a, const FirstHits& b, size_t i) {
  bool differs = false;
  a.visit_with(b, [&](const auto& mine, const auto& theirs) {
    const size_t each = mine.size() / a.hit.size();
    differs |= std::memcmp(&mine[each * i], &theirs[each * i], each * sizeof(mine[0])) != 0;
  });
  return differs;
}

/// Texts for standard error.
inline std::string describe(const Outputs& of, size_t i) {
  char text[160];
  std::snprintf(text, sizeof(text), "visible %d, bit %d, certain %d, logit %d, probability %.9g",
                of.visible[i], of.bits[i / 8] >> i % 8 & 1, of.certain[i], of.logit[i],
                double(of.probability[i]));
  return text;
}
inline std::string describe(const OpenOutputs& of, size_t i) {
  char text[160];
  std::snprintf(text, sizeof(text), ", listed %u times, from %.9g to %.9g, instance %u", of.listed[i],
                double(of.tmin[i]), double(of.tmax[i]), of.instance[i]);
  return describe(static_cast<const Outputs&>(of), i) + text;
}
inline std::string describe(const FirstHits& of, size_t i) {
  char text[320];
  std::snprintf(
      text, sizeof(text),
      "hit %d, certain %d, t %.9g in %.9g .. %.9g, normal %.9g %.9g %.9g, u %.9g, v %.9g, instance %u, "
      "object %u, triangle %u, user %llx",
      of.hit[i], of.certain[i], double(of.t[i]), double(of.low[i]), double(of.high[i]),
      double(of.normal[3 * i]), double(of.normal[3 * i + 1]), double(of.normal[3 * i + 2]), double(of.u[i]),
      double(of.v[i]), of.instance[i], of.object[i], of.triangle[i],
      static_cast<unsigned long long>(of.user[i]));
  return text;
}

}  // namespace nif::test
