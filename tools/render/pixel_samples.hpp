// Stratified random numbers for one pixel, which do not depend on the order of the calls.
#pragma once

#include "formats/base/random.hpp"
#include "tools/render/lighting.hpp"

namespace nif::render {

/// For each dimension, `samples` pairs, one in each cell of a grid, with an order of cells of its own.
class PixelSamples {
 public:
  PixelSamples(uint64_t seed, uint64_t pixel, uint32_t samples) : seed_(seed), pixel_(pixel) {
    while (columns_ * columns_ < samples) ++columns_;
    rows_ = (samples + columns_ - 1) / columns_;
    while ((uint32_t{1} << bits_) < columns_ * rows_) ++bits_;
  }

  Pair pair(uint32_t dimension, uint32_t sample) const {
    const uint32_t cell = shuffled(sample, dimension);
    Random random(seed_, pixel_, uint64_t{dimension} << 32 | sample);
    const double x = random.uniform(), y = random.uniform();
    return {(cell % columns_ + x) / columns_, (cell / columns_ + y) / rows_};
  }

 private:
  /// A permutation of 0 .. columns * rows - 1: invertible steps on a power of two, repeated until the number
  /// is within the range.
  uint32_t shuffled(uint32_t number, uint32_t dimension) const {
    Random random(seed_ ^ 0x73687566, pixel_, dimension);
    const uint32_t mask = (uint32_t{1} << bits_) - 1, half = bits_ / 2 + 1;
    const uint32_t a = random.bits() | 1, b = random.bits(), c = random.bits() | 1;
    do {
      number = (number * a + b) & mask;
      number ^= number >> half;
      number = (number * c) & mask;
      number ^= number >> half;
      number = (number * 0x2c1b3c6d + a) & mask;
    } while (number >= columns_ * rows_);
    return number;
  }

  uint64_t seed_, pixel_;
  uint32_t columns_ = 1, rows_ = 1, bits_ = 0;
};

}  // namespace nif::render
