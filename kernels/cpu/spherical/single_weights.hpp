// Weights as SIMD kernels read them.
#pragma once

#include "kernels/reference/spherical/field.hpp"
#include "kernels/reference/spherical/query.hpp"

namespace nif::kernels::cpu {

/// The field with single weights in place of those in half precision, which are then in `memory`, a vector of
/// floats that is empty before.
template <class Floats>
SphericalField with_single_weights(SphericalField field, Floats& memory) {
  const auto size = [](const SphericalNetwork& network) { return spherical_weights(network); };
  SphericalNetwork* const networks[] = {&field.outer, &field.inner};
  size_t halves = 0;
  for (const SphericalNetwork* network : networks) halves += network->weights.half ? size(*network) : 0;
  memory.reserve(halves);  // so that they stay where they are
  for (SphericalNetwork* network : networks) {
    if (!network->weights.half) continue;
    const float* first = memory.data() + memory.size();
    for (size_t i = 0; i < size(*network); ++i) memory.push_back(value_of(network->weights, i));
    network->weights = {first, false};
  }
  return field;
}

}  // namespace nif::kernels::cpu
