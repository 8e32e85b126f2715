// Converts between half (IEEE 754 binary16) and single precision exactly as hardware does.
#pragma once

#include <cstdint>

#include "kernels/reference/arithmetic.hpp"

namespace nif::kernels {

inline constexpr uint16_t kHalfExponent = 0x7c00;  ///< all ones: infinite or NaN
inline constexpr float kMaxHalf = 65504;           ///< the largest finite number

// Devices have instructions for exactly this, but compilers cannot use them on constants.

/// Exact. The number must be finite.
NIF_HOST_DEVICE constexpr float from_half(uint16_t half) {
#if defined(__CUDA_ARCH__)
  if (!__builtin_is_constant_evaluated()) {
    float single = 0;
    asm("cvt.f32.f16 %0, %1;" : "=f"(single) : "h"(half));
    return single;
  }
#elif defined(NIF_ON_DEVICE)
  if (!__builtin_is_constant_evaluated()) return static_cast<float>(bits_as<_Float16>(half));
#endif
  const uint32_t sign = uint32_t(half & 0x8000u) << 16, magnitude = half & 0x7fffu;
  if (magnitude >= 0x400u) return bits_as<float>(sign | ((magnitude << 13) + (112u << 23)));
  const float value = static_cast<float>(magnitude) * 0x1p-24f;  // denormal as half, but not as float
  return sign != 0 ? -value : value;
}

/// Rounds to nearest, ties to even; beyond the range gives +-65504. The number must not be NaN.
NIF_HOST_DEVICE constexpr uint16_t to_half(float value) {
#if defined(__CUDA_ARCH__)
  if (!__builtin_is_constant_evaluated()) {
    uint16_t half = 0;
    asm("cvt.rn.f16.f32 %0, %1;" : "=h"(half) : "f"(fminf(fmaxf(value, -kMaxHalf), kMaxHalf)));
    return half;
  }
#elif defined(NIF_ON_DEVICE)
  if (!__builtin_is_constant_evaluated())
    return bits_as<uint16_t>(static_cast<_Float16>(__builtin_amdgcn_fmed3f(value, -kMaxHalf, kMaxHalf)));
#endif
  const uint32_t bits = bits_as<uint32_t>(value), sign = bits >> 16 & 0x8000u;
  const float magnitude = value < 0 ? -value : value;
  if (magnitude >= kMaxHalf) return uint16_t(sign | 0x7bffu);
  if (magnitude <
      0x1p-14f) {  // denormal as half: a multiple of 2^-24, rounded where the last bit is that unit
    const float shifted = magnitude + 0.5f;
    return uint16_t(sign | (bits_as<uint32_t>(shifted) - bits_as<uint32_t>(0.5f)));
  }
  const uint32_t whole = (bits & 0x7fffffffu) - (112u << 23);
  return uint16_t(sign | (whole + 0xfffu + (whole >> 13 & 1)) >> 13);
}

/// Packs two of them into a word, `low` in the lower half.
NIF_HOST_DEVICE constexpr uint32_t to_halves(float low, float high) {
  return to_half(low) | uint32_t(to_half(high)) << 16;
}

}  // namespace nif::kernels
