// Exponentials and logarithms in plain arithmetic, because GPU code links no device library (docs/gpu.md).
// Only probabilities use them, whose last bits may differ between machines; everything else is exact.
#pragma once

#include "kernels/reference/arithmetic.hpp"

namespace nif::kernels::gpu {

/// Like kernels::HostMaths, with an error below 2^-50 of the result.
struct DeviceMaths {
  /// Returns 0 if the result is below the smallest normal number, and for NaN.
  NIF_HOST_DEVICE static double exp(double x) {
    constexpr double kPerLn2 = 1.4426950408889634, kLn2High = 0x1.62e42fee00000p-1,
                     kLn2Low = 0x1.a39ef35793c76p-33;
    if (!(x > -708)) return 0;
    if (x > 709) return bits_as<double>(uint64_t{0x7ff} << 52);
    const auto power = static_cast<int32_t>(x * kPerLn2 + (x < 0 ? -0.5 : 0.5));
    const double rest = (x - power * kLn2High) - power * kLn2Low;  // at most ln 2 / 2
    double sum = 1;
    NIF_NO_UNROLL
    for (int32_t n = 14; n > 0; --n) sum = 1 + sum * rest / n;
    return sum * bits_as<double>(uint64_t(power + 1023) << 52);
  }

  NIF_HOST_DEVICE static float exp(float x) { return static_cast<float>(exp(static_cast<double>(x))); }

  /// x must not be negative.
  NIF_HOST_DEVICE static double log1p(double x) {
    constexpr double kLn2 = 0.69314718055994531, kRoot2 = 1.4142135623730951;
    const double y = 1 + x;
    const double lost = x < 1 ? x - (y - 1) : 1 - (y - x);  // rounding error of the sum
    const uint64_t bits = bits_as<uint64_t>(y);
    int32_t power = static_cast<int32_t>(bits >> 52) - 1023;
    double m = bits_as<double>((bits & ((uint64_t{1} << 52) - 1)) | uint64_t{1023} << 52);
    if (m > kRoot2) m = m / 2, ++power;
    // log m = 2 atanh s, by its series; s is at most 0.172.
    const double s = (m - 1) / (m + 1), square = s * s;
    double sum = 0;
    NIF_NO_UNROLL
    for (int32_t n = 23; n > 0; n -= 2) sum = sum * square + 1.0 / n;
    return power * kLn2 + (2 * s * sum + lost / y);
  }
};

}  // namespace nif::kernels::gpu
