// Combines the answers of several instances into one, independent of their order.
#pragma once

#include <cmath>

#include "kernels/reference/host_device.hpp"
#include "kernels/reference/ray.hpp"

namespace nif::kernels {

/// The maths library that probabilities use: the host's. GPUs have their own (kernels/gpu/maths.hpp), whose
/// last bits may differ.
struct HostMaths {
  static float exp(float x) { return std::exp(x); }
  static double exp(double x) { return std::exp(x); }
  static double log1p(double x) { return std::log1p(x); }
};

/// For logits of a network: no sum overflows, see formats/nif/network/read_network.cpp.
NIF_HOST_DEVICE inline float log_odds(int32_t logit, const Calibration& calibration) {
  return static_cast<float>(logit + calibration.threshold) * calibration.scale;
}

/// The probability of being visible: exactly 1 or 0 if no network was evaluated.
template <class Maths = HostMaths>
NIF_HOST_DEVICE inline float visible_probability(int32_t logit, const Calibration& calibration) {
  if (logit == kCertainLogit) return 1;
  if (logit == -kCertainLogit) return 0;
  return 1.0f / (1.0f + Maths::exp(-log_odds(logit, calibration)));
}

/// One ray's answers so far. Once it is certainly blocked, the other instances can be skipped. Probabilities
/// are multiplied as a sum of logarithms in fixed point, because a product of floats depends on the order of
/// its factors.
template <class Maths>
class CombinedAnswerBy {
 public:
  NIF_HOST_DEVICE void add(int32_t logit, bool certain, const Calibration& calibration,
                           bool with_probability) {
    if (logit < logit_) logit_ = logit;
    all_certain_ = all_certain_ && certain;
    blocked_for_certain_ = blocked_for_certain_ || (certain && logit < 0);
    if (!with_probability || logit == kCertainLogit || logit == -kCertainLogit) return;
    const double odds = double(log_odds(logit, calibration));
    const double nats = odds < -kMostNats ? kMostNats : Maths::log1p(Maths::exp(-odds));
    sum_ += static_cast<int64_t>(nats * kFixedOne + 0.5);
    single_ = visible_probability<Maths>(logit, calibration);
    learned_ = learned_ == 0 ? 1 : 2;
  }

  NIF_HOST_DEVICE bool blocked_for_certain() const { return blocked_for_certain_; }
  /// The smallest logit; below 0: occluded.
  NIF_HOST_DEVICE int32_t logit() const { return logit_; }
  NIF_HOST_DEVICE bool certain() const { return logit_ < 0 ? blocked_for_certain_ : all_certain_; }
  NIF_HOST_DEVICE float probability() const {
    if (logit_ == -kCertainLogit) return 0;
    if (learned_ < 2) return single_;
    return static_cast<float>(Maths::exp(-static_cast<double>(sum_) / kFixedOne));
  }

 private:
  static constexpr double kFixedOne = 1 << 28;
  static constexpr double kMostNats = 128;  ///< exp(-128) is 0 in single precision

  int64_t sum_ = 0;  ///< of -log(probability), times kFixedOne
  float single_ = 1;
  int32_t logit_ = kCertainLogit;
  uint8_t learned_ = 0;  ///< answers by networks: 0, 1, or 2 for more
  bool all_certain_ = true, blocked_for_certain_ = false;
};
using CombinedAnswer = CombinedAnswerBy<HostMaths>;

}  // namespace nif::kernels
