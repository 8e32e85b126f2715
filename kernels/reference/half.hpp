// Half precision (IEEE 754 binary16) to single and back, exactly as hardware does it.
#pragma once

#include <cstdint>

#include "kernels/reference/arithmetic.hpp"

namespace nif::kernels {

inline constexpr uint16_t kHalfExponent = 0x7c00;  ///< all ones: infinite or NaN

/// Exact. The number must be finite.
NIF_HOST_DEVICE constexpr float from_half(uint16_t half) {
  const uint32_t sign = uint32_t(half & 0x8000u) << 16, magnitude = half & 0x7fffu;
  if (magnitude >= 0x400u) return bits_as<float>(sign | ((magnitude << 13) + (112u << 23)));
  const float value = static_cast<float>(magnitude) * 0x1p-24f;  // denormal as half, not as float
  return sign != 0 ? -value : value;
}

/// To the nearest, ties to even; +-65504 beyond that. The number must not be NaN.
NIF_HOST_DEVICE constexpr uint16_t to_half(float value) {
  const uint32_t bits = bits_as<uint32_t>(value), sign = bits >> 16 & 0x8000u;
  const float magnitude = value < 0 ? -value : value;
  if (magnitude >= 65504.0f) return uint16_t(sign | 0x7bffu);
  if (magnitude <
      0x1p-14f) {  // denormal as half: a multiple of 2^-24, rounded where its last bit has that unit
    const float shifted = magnitude + 0.5f;
    return uint16_t(sign | (bits_as<uint32_t>(shifted) - bits_as<uint32_t>(0.5f)));
  }
  const uint32_t whole = (bits & 0x7fffffffu) - (112u << 23);
  return uint16_t(sign | (whole + 0xfffu + (whole >> 13 & 1)) >> 13);
}

}  // namespace nif::kernels
