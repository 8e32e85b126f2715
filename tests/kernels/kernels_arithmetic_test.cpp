// The arithmetic that all kernels share, where it is more than one operation.
#include "kernels/reference/arithmetic.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace nif::kernels {
namespace {

/// The square root is rounded as IEEE requires, if the GPU's approximation is within one unit in the last
/// place.
TEST(Arithmetic, SquareRootsAreRefinedToTheNearest) {
  for (const uint32_t exponent : {127u, 128u, 32u, 33u, 253u, 254u})
    for (uint32_t mantissa = 0; mantissa < 1u << 23; mantissa += exponent < 130 && exponent > 126 ? 3 : 257) {
      const float x = bits_as<float>(exponent << 23 | mantissa), root = std::sqrt(x);
      for (const uint32_t off : {uint32_t(-1), 0u, 1u})
        ASSERT_EQ(refine_square_root(x, bits_as<float>(bits_as<uint32_t>(root) + off)), root) << x;
    }
}

/// The double-precision code of GPUs without such an instruction.
TEST(Arithmetic, SquareRootsOfDoublesAreRoundedToTheNearest) {
  const auto expect_root = [](double x) { ASSERT_EQ(square_root_by_steps(x), std::sqrt(x)) << x; };
  uint64_t bits = 0x9e3779b97f4a7c15u;
  for (uint32_t i = 0; i < 1'000'000; ++i) {
    bits ^= bits << 13, bits ^= bits >> 7, bits ^= bits << 17;
    const uint64_t mantissa = bits & ((uint64_t{1} << 52) - 1);
    expect_root(bits_as<double>(mantissa | (1 + (bits >> 52) % 2046) << 52));
    // Around squares, and around squares of midpoints between doubles, the hardest cases.
    const double root = bits_as<double>(mantissa | uint64_t{1023} << 52), square = root * root;
    const double between = root + root * 0x1p-53;
    for (const double near : {square, root * between, square + 0x1p-51})
      for (const int64_t off : {-1, 0, 1})
        expect_root(bits_as<double>(bits_as<uint64_t>(near) + uint64_t(off)));
  }
  for (const double x : {0x1p-1022, 0x1.fffffffffffffp1023, 1.0, 2.0, 4.0, 0x1.fffffffffffffp1, 0x1p-1021})
    expect_root(x);
}

TEST(Arithmetic, BitsAreCounted) {
  EXPECT_EQ(count_bits(0), 0u);
  EXPECT_EQ(count_bits(~uint64_t{0}), 64u);
  EXPECT_EQ(count_bits(uint64_t{1} << 63 | 5), 3u);
}

}  // namespace
}  // namespace nif::kernels
