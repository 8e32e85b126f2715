// What rounding takes from numbers side by side is not 0 (GCC 12 vectorizes them).
#include "formats/base/rounding.hpp"

#include <gtest/gtest.h>

#include <array>

namespace nif {
namespace {

[[gnu::noinline]] std::array<double, 3> lost_by(const std::array<double, 3>& x) {
  std::array<double, 3> lost;
  for (size_t a = 0; a < 3; ++a) lost[a] = lost_to_float(x[a]);
  return lost;
}

TEST(Rounding, IsLostNumberByNumber) {
  EXPECT_EQ(lost_by({0x1p25 + 1, -(0x1p25 + 1), 0x1p30 + 3}), (std::array{1.0, -1.0, 3.0}));
  EXPECT_EQ(lost_by({0.5, 0, -7}), (std::array{0.0, 0.0, 0.0}));
}

}  // namespace
}  // namespace nif
