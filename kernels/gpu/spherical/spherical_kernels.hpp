// The `spherical` encoding on GPUs, in single precision, with exactly the bits of kernels/reference: one
// thread per ray, and a layer's sums in the reference's order.
#pragma once

#include "kernels/gpu/object.hpp"
#include "kernels/gpu/shim.hpp"
#include "kernels/reference/spherical/spherical_query.hpp"

namespace nif::kernels::gpu {

/// The network's single output. `x` is the thread's column of inputs and `y` one for outputs, both of floats
/// that are kStride words apart.
template <bool kHalf, uint32_t kStride>
NIF_HOST_DEVICE float evaluate_columns(const SphericalNetwork& network, float slope, float* x, float* y) {
  const SphericalValues weights{network.weights.data, kHalf};
  uint32_t width = network.inputs;
  size_t at = 0;
  for (uint32_t l = 0; l < network.hidden_layers; ++l) {
    const uint32_t outputs = network.width;
    for (uint32_t o = 0; o < outputs; o += 4) {
      float sums[4] = {};
      for (uint32_t i = 0; i < width; ++i) {
        const float input = x[i * kStride];
        NIF_UNROLL
        for (uint32_t k = 0; k < 4; ++k)
          sums[k] = sums[k] + value_of(weights, at + size_t(i) * outputs + o + k) * input;
      }
      NIF_UNROLL
      for (uint32_t k = 0; k < 4; ++k) y[(o + k) * kStride] = max_of(sums[k], slope * sums[k]);
    }
    at += size_t(width) * outputs;
    width = outputs;
    float* const inputs = x;
    x = y;
    y = inputs;
  }
  float output = 0;
  for (uint32_t i = 0; i < width; ++i) output = output + value_of(weights, at + i) * x[i * kStride];
  return output;
}

/// `x` and `y`: as for evaluate_columns(), each with as many floats as the widest layer has neurons.
template <uint32_t kStride>
NIF_HOST_DEVICE ObjectAnswer answer_spherical_ray(const SphericalField& field, const Segment& segment,
                                                  float* x, float* y) {
  const SphericalRay ray = prepare_spherical(field, segment);
  if (ray.kind == SphericalKind::none) return {kCertainLogit, ray.certain};
  look_up_inputs(field, ray, [&](uint32_t k, float value) { x[k * kStride] = value; });
  const auto evaluate = [&](const SphericalNetwork& network) {
    return network.weights.half ? evaluate_columns<true, kStride>(network, field.slope, x, y)
                                : evaluate_columns<false, kStride>(network, field.slope, x, y);
  };
  const float output = ray.kind == SphericalKind::outer ? evaluate(field.outer) : evaluate(field.inner);
  return {spherical_logit(output), false};
}

}  // namespace nif::kernels::gpu
