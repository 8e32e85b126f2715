// Evaluates the network of an object: a few layers of small integers.
#pragma once

#include <cstddef>

#include "kernels/reference/host_device.hpp"
#include "kernels/reference/network/network_field.hpp"

namespace nif::kernels {

/// Turns a hidden neuron's sum into its output.
NIF_HOST_DEVICE constexpr int32_t activation(int32_t sum, uint32_t shift) {
  const int32_t scaled = (sum + ((1 << shift) >> 1)) >> shift;
  return scaled < 0 ? 0 : scaled > 127 ? 127 : scaled;
}

/// The network's single output for the given inputs. Sums are 32-bit and cannot overflow for networks that
/// the asset reader accepts.
inline int32_t evaluate_network(const Network& network, const uint8_t* inputs) {
  uint8_t buffers[2][kMaxWidth];
  const uint8_t* x = inputs;
  for (uint32_t l = 0;; ++l) {
    const Network::Layer& layer = network.layers[l];
    const bool last = l + 1 == network.layer_count;
    uint8_t* y = buffers[l & 1];
    for (uint32_t row = 0; row < layer.outputs; ++row) {
      const int8_t* weights = layer.weights + size_t(row) * layer.inputs;
      int32_t sum = layer.biases[row];
      for (uint32_t i = 0; i < layer.inputs; ++i) sum += int32_t(weights[i]) * int32_t(x[i]);
      if (last) return sum;
      y[row] = uint8_t(activation(sum, layer.shift));
    }
    x = y;
  }
}

}  // namespace nif::kernels
