// Bounds how much an answer in half precision may differ from the reference's: the bound follows from the
// arithmetic alone, for any order in which hardware sums.
#pragma once

#include <cmath>
#include <limits>
#include <vector>

#include "kernels/reference/spherical/half_query.hpp"

namespace nif::test {

/// What rounding a number of at most this size to half precision can change: half a unit of its last bit, or
/// all of it where it is denormal and the hardware takes it as 0.
inline double half_rounding(double size) { return std::max(0x1p-11 * size, std::min(size, 0x1p-14)); }

/// Of a network's output, for inputs as the reference looks them up.
///
/// With x the reference's value of an input or activation, in exact arithmetic, and e what the other's value
/// is off by: rounding adds half_rounding(|x| + e), and a product with a weight w is off by what both factors
/// are. n sums add, in whichever order, n times the unit of the last bit of what is summed at most: 2^-23 for
/// hardware that cuts off, and for the reference 2^-24 for each sum and 2^-24 for each product. A leaky ReLU
/// with a slope of at most 1 makes no difference larger, and rounds once on both sides. The last layer is in
/// single precision on both sides. Infinite where a value may be too large for half precision.
inline double half_bound(const kernels::SphericalNetwork& network, float slope, const float* inputs) {
  constexpr double kSums = 0x1p-22, kOnce = 0x1p-23;
  std::vector<double> x(inputs, inputs + network.inputs), e(network.inputs, 0.0);
  size_t at = 0;
  for (uint32_t l = 0; l <= network.hidden_layers; ++l) {
    const bool last = l == network.hidden_layers;
    const uint32_t outputs = last ? 1 : network.width;
    std::vector<double> sums(outputs, 0.0), errors(outputs, 0.0), sizes(outputs, 0.0);
    for (size_t i = 0; i < x.size(); ++i) {
      const double size = std::fabs(x[i]), input = e[i] + (last ? 0 : half_rounding(size + e[i]));
      if (size + input >= double(kernels::kMaxHalf)) return std::numeric_limits<double>::infinity();
      for (uint32_t o = 0; o < outputs; ++o, ++at) {
        const double weight = double(kernels::value_of(network.weights, at)), large = std::fabs(weight);
        const double rounding = last ? 0 : half_rounding(large);
        sums[o] += weight * x[i];
        errors[o] += (large + rounding) * input + rounding * size;
        sizes[o] += (large + rounding) * (size + input);
      }
    }
    for (uint32_t o = 0; o < outputs; ++o) {
      errors[o] += double(x.size() + 1) * kSums * sizes[o];
      if (last) return errors[o];
      errors[o] += kOnce * (std::fabs(sums[o]) + errors[o]);
      sums[o] = std::max(sums[o], double(slope) * sums[o]);
    }
    x = std::move(sums);
    e = std::move(errors);
  }
  return 0;
}

/// The bound of a logit, over kSphericalLogitUnit; 0 if no network is evaluated.
inline double half_bound(const kernels::SphericalField& field, const kernels::Segment& segment) {
  const kernels::SphericalRay ray = kernels::prepare_spherical(field, segment);
  if (ray.kind == kernels::SphericalKind::none) return 0;
  float inputs[kernels::kMaxSphericalInputs];
  kernels::look_up_inputs(field, ray, [&](uint32_t i, float value) { inputs[i] = value; });
  const bool outer = ray.kind == kernels::SphericalKind::outer;
  return half_bound(outer ? field.outer : field.inner, field.slope, inputs) +
         double(kernels::kSphericalLogitScale);
}

/// The probability of being visible that a logit stands for.
inline double probability_of(int32_t logit) {
  return 1 / (1 + std::exp(-double(logit) * double(kernels::kSphericalLogitScale)));
}

}  // namespace nif::test
