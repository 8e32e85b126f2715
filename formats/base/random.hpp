// Random numbers that are the same on every machine: PCG32 (O'Neill 2014), one stream per chunk of work.
#pragma once

#include <cmath>
#include <cstdint>

#include "formats/base/vector.hpp"

namespace nif {

/// PCG-XSH-RR 64/32. Streams keyed by (seed, purpose, chunk) are independent enough for our needs, so that
/// work can be split into chunks and done by any number of threads with the same result.
class Random {
 public:
  Random(uint64_t seed, uint64_t purpose, uint64_t chunk) {
    state_ = mix(seed ^ mix(purpose ^ mix(chunk)));
    increment_ = mix(state_ ^ purpose) | 1;
  }
  uint32_t bits() {
    const uint64_t old = state_;
    state_ = old * 6364136223846793005ull + increment_;
    const uint32_t shifted = uint32_t(((old >> 18) ^ old) >> 27), turn = uint32_t(old >> 59);
    return (shifted >> turn) | (shifted << ((32 - turn) & 31));
  }
  /// Uniform in [0, 1), a multiple of 2^-32.
  double uniform() { return bits() * 0x1p-32; }
  /// Uniform in [low, high).
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  /// Uniform in 0..count-1 (count > 0); the bias of at most count / 2^32 does not matter here.
  uint32_t below(uint32_t count) { return uint32_t((uint64_t{bits()} * count) >> 32); }

  /// Uniform on the unit sphere, by rejection: it uses only correctly rounded operations, so it is the same
  /// everywhere.
  Double3 direction() {
    for (;;) {
      const double x = uniform(-1, 1), y = uniform(-1, 1), z = uniform(-1, 1);
      const double square = x * x + y * y + z * z;
      if (square > 1 || square < 1e-6) continue;
      const double scale = 1 / std::sqrt(square);
      return {x * scale, y * scale, z * scale};
    }
  }

 private:
  static uint64_t mix(uint64_t x) {  // SplitMix64's finaliser
    x += 0x9e3779b97f4a7c15ull;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
    return x ^ (x >> 31);
  }
  uint64_t state_, increment_;
};

}  // namespace nif
