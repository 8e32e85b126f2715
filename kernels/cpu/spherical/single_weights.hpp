// Converts weights to the single precision that SIMD kernels read.
#pragma once

#include <bit>

#include "kernels/cpu/shared_copies.hpp"
#include "kernels/reference/spherical/spherical_field.hpp"
#include "kernels/reference/spherical/spherical_query.hpp"

namespace nif::kernels::cpu {

/// The field with its half-precision weights replaced by single-precision ones, which are added to the
/// copies.
inline SphericalField with_single_weights(SphericalField field, SharedCopies& copies) {
  for (SphericalNetwork* network : {&field.outer, &field.inner}) {
    const SphericalValues halves = network->weights;
    if (!halves.half) continue;
    const size_t size = spherical_weights(*network);
    const uint32_t* words = copies.get(Shared::network, halves.data, size, [&](uint32_t* to) {
      for (size_t i = 0; i < size; ++i) to[i] = std::bit_cast<uint32_t>(value_of(halves, i));
    });
    network->weights = {words, false};
  }
  return field;
}

}  // namespace nif::kernels::cpu
