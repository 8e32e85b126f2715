// Defines the few float operations whose result C++ or the hardware leaves open.
//
// Every kernel must give the same bit for the same ray (docs/model.md, "The same bits everywhere"), so the
// order of NaNs, ties and out-of-range conversions is fixed here and nowhere else.
#pragma once

#include <cmath>
#include <cstdint>

#include "kernels/reference/host_device.hpp"

#if defined(__FAST_MATH__)
#error "nifkit's kernels define their answer in IEEE arithmetic: compile them without -ffast-math"
#endif

namespace nif::kernels {

/// The smaller one; b if either is NaN. (x86's minps, and `a < b ? a : b` on every target.)
NIF_HOST_DEVICE constexpr float min_of(float a, float b) { return a < b ? a : b; }
/// The larger one; b if either is NaN.
NIF_HOST_DEVICE constexpr float max_of(float a, float b) { return a > b ? a : b; }
NIF_HOST_DEVICE constexpr float magnitude(float a) { return a < 0 ? -a : a; }

/// Truncates x to an integer in [0, top]; 0 if x is NaN.
NIF_HOST_DEVICE constexpr int32_t to_index(float x, int32_t top) {
  if (!(x > 0)) return 0;
  if (!(x < static_cast<float>(top))) return top;
  return static_cast<int32_t>(x);
}

NIF_HOST_DEVICE constexpr bool is_finite(float x) { return x - x == 0; }

/// Reinterprets the bits of one type as another type of the same size.
template <class To, class From>
NIF_HOST_DEVICE constexpr To bits_as(From from) {
  return __builtin_bit_cast(To, from);
}

NIF_HOST_DEVICE constexpr uint32_t count_bits(uint64_t bits) {
#if defined(__CUDA_ARCH__)
  return uint32_t(__popcll(bits));
#else
  return uint32_t(__builtin_popcountll(bits));
#endif
}

/// Index of the lowest set bit; bits must not be 0.
NIF_HOST_DEVICE constexpr uint32_t lowest_bit(uint64_t bits) {
#if defined(__CUDA_ARCH__)
  return uint32_t(__ffsll(static_cast<long long>(bits)) - 1);
#else
  return uint32_t(__builtin_ctzll(bits));
#endif
}

/// Returns the correctly rounded square root of x, given an approximation that is off by at most one unit in
/// the last place. Of the three possible numbers it picks the one whose square is nearest to x. x must be
/// finite and at least 0x1p-96, so that no residual is lost to underflow. The fused operations here are exact
/// tests, not rounding.
NIF_HOST_DEVICE inline float refine_square_root(float x, float near) {
  const float below = bits_as<float>(bits_as<uint32_t>(near) - 1),
              above = bits_as<float>(bits_as<uint32_t>(near) + 1);
  float root = near;
  if (__builtin_fmaf(-below, near, x) <= 0) root = below;
  if (__builtin_fmaf(-above, near, x) > 0) root = above;
  return root;
}

/// Correctly rounded.
NIF_HOST_DEVICE inline float square_root(float x) {
#if defined(__CUDA_ARCH__)
  return __fsqrt_rn(x);
#elif defined(NIF_ON_DEVICE)
  // v_sqrt_f32 is off by up to one unit, and some compilers do not correct that.
  if (!(x > 0) || !is_finite(x)) return __builtin_amdgcn_sqrtf(x);
  const bool small = x < 0x1p-96f;
  const float scaled = small ? x * 0x1p32f : x;
  const float root = refine_square_root(scaled, __builtin_amdgcn_sqrtf(scaled));
  return small ? root * 0x1p-16f : root;
#else
  return std::sqrt(x);
#endif
}

/// Correctly rounded without a hardware instruction, for 1 <= x < 4.
NIF_HOST_DEVICE inline double square_root_of_mantissa(double x) {
  // Newton's method: the relative error is 2^-22, then 2^-45, then the rounding of two operations.
  double root = static_cast<double>(square_root(static_cast<float>(x)));
  root = 0.5 * (root + x / root);
  root = 0.5 * (root + x / root);
  // As in refine_square_root(): the nearest of the three candidates.
  const double below = bits_as<double>(bits_as<uint64_t>(root) - 1),
               above = bits_as<double>(bits_as<uint64_t>(root) + 1);
  if (__builtin_fma(-below, root, x) <= 0) return below;
  if (__builtin_fma(-above, root, x) > 0) return above;
  return root;
}

/// For any normal number above 0: scales it by an even power of two first.
NIF_HOST_DEVICE inline double square_root_by_steps(double x) {
  const uint64_t bits = bits_as<uint64_t>(x);
  const int32_t half = (int32_t(bits >> 52) - 1023) >> 1;
  return square_root_of_mantissa(bits_as<double>(bits - (uint64_t(int64_t{half}) << 53))) *
         bits_as<double>(uint64_t(1023 + half) << 52);
}

/// Correctly rounded. x must be a normal number above 0.
NIF_HOST_DEVICE inline double square_root(double x) {
#if defined(__CUDA_ARCH__)
  return __dsqrt_rn(x);
#elif defined(NIF_ON_DEVICE)
  // v_sqrt_f64 only has single precision, and some compilers do not correct that.
  return square_root_by_steps(x);
#else
  return std::sqrt(x);
#endif
}

/// The largest integer that is at most x.
NIF_HOST_DEVICE inline float round_down(float x) { return __builtin_floorf(x); }

}  // namespace nif::kernels
