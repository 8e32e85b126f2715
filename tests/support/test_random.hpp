// Random numbers that are the same with every standard library (the distributions of these differ).
#pragma once

#include <cstdint>
#include <random>

namespace nif::test {

class Random {
 public:
  explicit Random(uint64_t seed) : engine_(seed) {}
  uint32_t below(uint32_t n) { return uint32_t((engine_() >> 32) * n >> 32); }
  int32_t between(int32_t low, int32_t high) { return low + int32_t(below(uint32_t(high - low) + 1)); }
  /// 0 <= x < 1
  float unit() { return static_cast<float>(engine_() >> 40) * 0x1p-24f; }
  float between(float low, float high) { return low + (high - low) * unit(); }

 private:
  std::mt19937_64 engine_;
};

}  // namespace nif::test
