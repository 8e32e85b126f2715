// Answers of a `spherical` object whose networks are evaluated in half precision, as matrix units of GPUs do.
// An approximation of query(), which the runtime uses only on request.
//
// Which network a ray uses, and its latent vectors, are exactly as in query(), in single precision. Then the
// network's inputs, the weights of hidden layers, and the outputs of all hidden layers but the last are
// rounded to half precision; leaky ReLUs and the last layer use single precision.
//
// The sums of hidden layers are in single precision, in the hardware's own order and with its rounding of
// each step, and hardware may treat halves below 2^-14 (denormals) as 0. So other GPUs give other last bits.
// Here inputs are summed in order, rounded to nearest, and denormal halves are kept.
#pragma once

#include "kernels/reference/spherical/spherical_query.hpp"

namespace nif::kernels {

NIF_HOST_DEVICE constexpr float rounded_to_half(float x) { return from_half(to_half(x)); }

/// Products of the last hidden layer's neurons with the same i / 4 % 4 are summed in order; the four sums are
/// added last. This is what lanes do that hold four consecutive neurons each.
inline constexpr uint32_t kHalfParts = 4;
NIF_HOST_DEVICE constexpr uint32_t half_part(uint32_t neuron) { return neuron / 4 % kHalfParts; }
NIF_HOST_DEVICE inline float sum_half_parts(const float (&parts)[kHalfParts]) {
  return (parts[0] + parts[1]) + (parts[2] + parts[3]);
}

/// The network's single output for [network.inputs].
NIF_HOST_DEVICE inline float evaluate_spherical_half(const SphericalNetwork& network, float slope,
                                                     const float* inputs) {
  float x[kMaxSphericalWidth], y[kMaxSphericalWidth];
  uint32_t width = network.inputs;
  for (uint32_t i = 0; i < width; ++i) x[i] = rounded_to_half(inputs[i]);
  size_t at = 0;
  for (uint32_t l = 0; l < network.hidden_layers; ++l) {
    const uint32_t outputs = network.width;
    for (uint32_t o = 0; o < outputs; ++o) y[o] = 0;
    for (uint32_t i = 0; i < width; ++i, at += outputs)
      for (uint32_t o = 0; o < outputs; ++o)
        y[o] = y[o] + rounded_to_half(value_of(network.weights, at + o)) * x[i];
    for (uint32_t o = 0; o < outputs; ++o) {
      const float activation = max_of(y[o], slope * y[o]);
      x[o] = l + 1 < network.hidden_layers ? rounded_to_half(activation) : activation;
    }
    width = outputs;
  }
  float parts[kHalfParts] = {};
  for (uint32_t i = 0; i < width; ++i)
    parts[half_part(i)] = parts[half_part(i)] + value_of(network.weights, at + i) * x[i];
  return sum_half_parts(parts);
}

NIF_HOST_DEVICE inline Answer query_spherical_half(const SphericalField& field, const Segment& segment) {
  const SphericalRay ray = prepare_spherical(field, segment);
  if (ray.kind == SphericalKind::none) return {true, ray.certain, kCertainLogit};
  float inputs[kMaxSphericalInputs];
  look_up_inputs(field, ray, [&](uint32_t i, float value) { inputs[i] = value; });
  const SphericalNetwork& network = ray.kind == SphericalKind::outer ? field.outer : field.inner;
  const int32_t logit = spherical_logit(evaluate_spherical_half(network, field.slope, inputs));
  return {logit >= 0, false, logit};
}

}  // namespace nif::kernels
