// Computes with four floats at once: by vector instructions if the compiler has them, else with the same
// bits.
#pragma once

#include <cstdint>
#include <cstring>

#include "kernels/reference/arithmetic.hpp"

#if defined(__SSE__)
#include <xmmintrin.h>
#elif defined(__wasm_simd128__)
#include <wasm_simd128.h>
#endif

namespace nif::runtime {

#if defined(__GNUC__)

using Float4 = float __attribute__((vector_size(16)));

#if defined(__SSE__)  // GCC 12 makes four instructions of the comparison
inline Float4 min_of(Float4 a, Float4 b) { return _mm_min_ps(a, b); }
inline Float4 max_of(Float4 a, Float4 b) { return _mm_max_ps(a, b); }
#else
inline Float4 min_of(Float4 a, Float4 b) { return a < b ? a : b; }
inline Float4 max_of(Float4 a, Float4 b) { return a > b ? a : b; }
#endif

/// Bit i is set if a[i] <= b[i].
inline uint32_t at_most(Float4 a, Float4 b) {
  const auto less = a <= b;
#if defined(__SSE__)
  return uint32_t(_mm_movemask_ps(reinterpret_cast<__m128>(less)));
#elif defined(__wasm_simd128__)
  return uint32_t(wasm_i32x4_bitmask(reinterpret_cast<v128_t>(less)));
#else
  return uint32_t((less[0] & 1) | (less[1] & 2) | (less[2] & 4) | (less[3] & 8));
#endif
}

#else

struct Float4 {
  float lane[4];
};

template <class Operation>
Float4 each(Float4 a, Float4 b, Operation operation) {
  Float4 result;
  for (int i = 0; i < 4; ++i) result.lane[i] = operation(a.lane[i], b.lane[i]);
  return result;
}
inline Float4 operator+(Float4 a, Float4 b) {
  return each(a, b, [](float x, float y) { return x + y; });
}
inline Float4 operator-(Float4 a, Float4 b) {
  return each(a, b, [](float x, float y) { return x - y; });
}
inline Float4 operator*(Float4 a, Float4 b) {
  return each(a, b, [](float x, float y) { return x * y; });
}
inline Float4 min_of(Float4 a, Float4 b) { return each(a, b, kernels::min_of); }
inline Float4 max_of(Float4 a, Float4 b) { return each(a, b, kernels::max_of); }
inline uint32_t at_most(Float4 a, Float4 b) {
  uint32_t bits = 0;
  for (uint32_t i = 0; i < 4; ++i) bits |= uint32_t(a.lane[i] <= b.lane[i]) << i;
  return bits;
}

#endif

inline Float4 all_of(float x) { return Float4{x, x, x, x}; }

inline Float4 load4(const float* from) {
  Float4 result;
  std::memcpy(&result, from, sizeof(result));
  return result;
}

inline void store4(float* to, Float4 value) { std::memcpy(to, &value, sizeof(value)); }

}  // namespace nif::runtime
