// The few float operations whose result C++ or the hardware leaves open, pinned down.
//
// Every kernel must give the same bit for the same ray (docs/model.md, "The same bits everywhere"), so order
// of NaNs, ties and conversions out of range are defined here and nowhere else.
#pragma once

#include <cstdint>

#if defined(__FAST_MATH__)
#error "nifkit's kernels define their answer in IEEE arithmetic: compile them without -ffast-math"
#endif

namespace nif::kernels {

/// Smaller of the two; b where either is NaN. (x86's minps, and `a < b ? a : b` on every target.)
constexpr float min_of(float a, float b) { return a < b ? a : b; }
/// Larger of the two; b where either is NaN.
constexpr float max_of(float a, float b) { return a > b ? a : b; }
constexpr float magnitude(float a) { return a < 0 ? -a : a; }

/// Truncates x to an integer in [0, top]; 0 where x is NaN.
constexpr int32_t to_index(float x, int32_t top) {
  if (!(x > 0)) return 0;
  if (!(x < static_cast<float>(top))) return top;
  return static_cast<int32_t>(x);
}

constexpr bool is_finite(float x) { return x - x == 0; }

}  // namespace nif::kernels
