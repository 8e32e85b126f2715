// What is asked of one object, and what it answers, in any encoding.
#pragma once

#include <cstdint>

namespace nif::kernels {

/// A query in object space: the points origin + t direction with tmin <= t <= tmax.
struct Segment {
  float origin[3];
  float direction[3];  ///< any length but zero
  float tmin;
  float tmax;
};

struct Answer {
  bool visible;
  bool certain;
  int32_t logit;  ///< the network's output, less its threshold, where it was asked; else +-kCertainLogit
};

/// The logit where no network was asked; farther from 0 than any network can get.
inline constexpr int32_t kCertainLogit = 0x7fffffff;

/// What a logit says of an object's probability: 1 / (1 + exp(-(logit + threshold) * scale)). The threshold
/// is what a logit already lacks, so that answers lean to one side and probabilities do not (docs/model.md).
struct Calibration {
  float scale = 1;
  int32_t threshold = 0;
};

/// Directions are accepted where their largest component, as the object sees it, lies in this range.
inline constexpr float kMinDirection = 0x1p-60f, kMaxDirection = 0x1p+60f;

/// Farther than this from an object no answer is called certain: rounding may move the ray by more than the
/// object's proofs allow. In the object's own unit of length, whose inverse is reach_scale(): finest
/// cells for `segment`. docs/encodings/segment.md derives it.
inline constexpr float kCertainReach = 16384.0f;

/// The box in object space outside of which an object blocks nothing, margin included.
struct ObjectBox {
  double low[3], high[3];
};

}  // namespace nif::kernels
