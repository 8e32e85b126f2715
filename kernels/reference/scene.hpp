// How the answers of several instances become one, whatever the order in which they come.
#pragma once

#include <cmath>

#include "kernels/reference/segment.hpp"

namespace nif::kernels {

/// The odds of being visible as a probability: exactly 1 or 0 where no network was asked.
inline float visible_probability(int32_t logit, float logit_scale) {
  if (logit == kCertainLogit) return 1;
  if (logit == -kCertainLogit) return 0;
  return 1.0f / (1.0f + std::exp(-static_cast<float>(logit) * logit_scale));
}

/// One ray's answers so far. Blocked for certain: the rest need not be asked. Probabilities are multiplied as
/// a sum of logarithms in fixed point, because a product of floats depends on the order of its factors.
class CombinedAnswer {
 public:
  void add(int32_t logit, bool certain, float logit_scale, bool with_probability) {
    if (logit < logit_) logit_ = logit;
    all_certain_ = all_certain_ && certain;
    blocked_for_certain_ = blocked_for_certain_ || (certain && logit < 0);
    if (!with_probability || logit == kCertainLogit || logit == -kCertainLogit) return;
    const double odds = double(static_cast<float>(logit) * logit_scale);
    const double nats = odds < -kMostNats ? kMostNats : std::log1p(std::exp(-odds));
    sum_ += static_cast<int64_t>(nats * kFixedOne + 0.5);
    single_ = visible_probability(logit, logit_scale);
    learned_ = learned_ == 0 ? 1 : 2;
  }

  bool blocked_for_certain() const { return blocked_for_certain_; }
  /// The smallest one; below 0: occluded.
  int32_t logit() const { return logit_; }
  bool certain() const { return logit_ < 0 ? blocked_for_certain_ : all_certain_; }
  float probability() const {
    if (logit_ == -kCertainLogit) return 0;
    if (learned_ < 2) return single_;
    return static_cast<float>(std::exp(-static_cast<double>(sum_) / kFixedOne));
  }

 private:
  static constexpr double kFixedOne = 1 << 28;
  static constexpr double kMostNats = 128;  ///< exp(-128) is 0 in single precision

  int64_t sum_ = 0;  ///< of -log(probability), times kFixedOne
  float single_ = 1;
  int32_t logit_ = kCertainLogit;
  uint8_t learned_ = 0;  ///< answers of networks: 0, 1, or 2 for more
  bool all_certain_ = true, blocked_for_certain_ = false;
};

}  // namespace nif::kernels
