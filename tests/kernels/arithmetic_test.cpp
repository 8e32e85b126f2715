// The arithmetic that all kernels share, where it is more than one operation.
#include "kernels/reference/arithmetic.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace nif::kernels {
namespace {

/// Whatever a GPU's approximation is within one unit of, the square root comes out as IEEE has it.
TEST(Arithmetic, SquareRootsAreRefinedToTheNearest) {
  for (const uint32_t exponent : {127u, 128u, 32u, 33u, 253u, 254u})
    for (uint32_t mantissa = 0; mantissa < 1u << 23; mantissa += exponent < 130 && exponent > 126 ? 3 : 257) {
      const float x = bits_as<float>(exponent << 23 | mantissa), root = std::sqrt(x);
      for (const uint32_t off : {uint32_t(-1), 0u, 1u})
        ASSERT_EQ(refine_square_root(x, bits_as<float>(bits_as<uint32_t>(root) + off)), root) << x;
    }
}

TEST(Arithmetic, BitsAreCounted) {
  EXPECT_EQ(count_bits(0), 0u);
  EXPECT_EQ(count_bits(~uint64_t{0}), 64u);
  EXPECT_EQ(count_bits(uint64_t{1} << 63 | 5), 3u);
}

}  // namespace
}  // namespace nif::kernels
