// What rounding to single precision takes from a number.
#pragma once

namespace nif {

/// x - double(float(x)). GCC 12 takes that for 0 where it vectorizes several side by side, so it must not see that the
/// rounded number is used.
inline double lost_to_float(double x) {
  const volatile float rounded = static_cast<float>(x);
  return x - double{rounded};
}

}  // namespace nif
