// A query about one object and its answer, in any encoding.
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
  int32_t logit;  ///< the network's output minus its threshold, if it was evaluated; else +-kCertainLogit
};

/// The logit if no network was evaluated; farther from 0 than any network can get.
inline constexpr int32_t kCertainLogit = 0x7fffffff;

/// Turns a logit into an object's probability: 1 / (1 + exp(-(logit + threshold) * scale)). The logit already
/// has the threshold subtracted, so that a decision threshold shifts answers but not probabilities
/// (docs/model.md).
struct Calibration {
  float scale = 1;
  int32_t threshold = 0;
};

/// A direction is accepted if its largest component in object space lies in this range.
inline constexpr float kMinDirection = 0x1p-60f, kMaxDirection = 0x1p+60f;

/// No answer is called certain for rays from farther away than this: rounding may move them by more than the
/// object's proofs allow. In the object's own unit of length, whose inverse is reach_scale(): finest cells
/// for `segment`. docs/encodings/segment.md derives it.
inline constexpr float kCertainReach = 16384.0f;

/// The box in object space outside of which an object blocks nothing, margin included.
struct ObjectBox {
  double low[3], high[3];
};

}  // namespace nif::kernels
