// The `spherical` encoding on GPUs in half precision (kernels/reference/spherical/half_query.hpp defines what
// that means): a wave evaluates a network for all its rays at once, by matrix instructions. Other kernels
// have found where rays meet the AABB (pipeline_kernels.hpp). Networks too large for a block's memory are
// left to answer_spherical_ray(), in single precision.
//
// An instruction sums a ray's products alike in every row or column, so answers do not depend on which rays
// share a wave.
#pragma once

#include <initializer_list>

#include "kernels/gpu/object.hpp"
#include "kernels/gpu/spherical/half_matrices.hpp"
#include "kernels/reference/spherical/half_query.hpp"

namespace nif::kernels::gpu {

/// Maximum number of tiles of 16 neurons in a hidden layer; its inputs and outputs are in registers. There
/// are kernels for networks as wide as the paper's, and for wider ones.
inline constexpr uint32_t kHalfTiles = 4, kMostHalfTiles = 6;

/// Block size in half precision: larger than elsewhere, because all threads share one network's weights, and
/// if waves are wide the weights take most of the shared memory.
inline constexpr uint32_t kHalfThreads = 256;

/// Layout of one network and its rays in shared memory: the last layer's weights in single precision; the
/// hidden layers' weights, one row per neuron, in whole tiles; then a row of inputs for each thread.
struct HalfNetworkLayout {
  uint32_t neurons;         ///< of a hidden layer, in whole tiles
  uint32_t first_stride;    ///< bytes of a row of inputs, or of the first layer's weights
  uint32_t stride;          ///< bytes of a row of another hidden layer's weights
  uint32_t weights_offset;  ///< bytes, from the start of shared memory
  uint32_t inputs_offset;
};

struct SphericalHalfLayout {
  bool fits;       ///< false if answer_spherical_ray() must answer all of the object's rays
  uint32_t tiles;  ///< which kernels it needs: those for kHalfTiles or for kMostHalfTiles
  uint32_t bytes;  ///< of shared memory, for either network
  HalfNetworkLayout outer, inner;
};

NIF_HOST_DEVICE constexpr uint32_t half_tiled(uint32_t n) {
  return (n + kTileNeurons - 1) / kTileNeurons * kTileNeurons;
}

inline HalfNetworkLayout make_half_layout(const SphericalNetwork& network) {
  static_assert(kHalfTileInputs == kTileNeurons);
  // 16 bytes more than whole tiles: rows then start in different banks and stay aligned for wide loads.
  const auto row = [](uint32_t halves) { return 2 * half_tiled(halves) + 16; };
  HalfNetworkLayout layout{};
  layout.neurons = half_tiled(network.width);
  layout.first_stride = row(network.inputs);
  layout.stride = row(network.width);
  layout.weights_offset = layout.neurons * uint32_t(sizeof(float));
  layout.inputs_offset = layout.weights_offset +
                         layout.neurons * (layout.first_stride + (network.hidden_layers - 1) * layout.stride);
  return layout;
}

inline SphericalHalfLayout make_half_layout(const SphericalField& field) {
  SphericalHalfLayout layout{false, kHalfTiles, 0, make_half_layout(field.outer),
                             make_half_layout(field.inner)};
  uint32_t widest = 0;
  for (const HalfNetworkLayout& of : {layout.outer, layout.inner}) {
    const uint32_t bytes = of.inputs_offset + kHalfThreads * of.first_stride;
    if (bytes > layout.bytes) layout.bytes = bytes;
    if (of.neurons > widest) widest = of.neurons;
  }
  if (widest > kHalfTiles * kTileNeurons) layout.tiles = kMostHalfTiles;
  layout.fits = layout.bytes <= kSharedLimit && widest <= layout.tiles * kTileNeurons;
  return layout;
}

/// Copies a network to shared memory as halves, in whole tiles padded with 0. All threads of a block must
/// call this.
template <class Thread>
NIF_HOST_DEVICE void load_half_network(const Thread& thread, const SphericalNetwork& network,
                                       const HalfNetworkLayout& layout) {
  unsigned char* to = thread.shared() + layout.weights_offset;
  uint32_t depth = network.inputs, stride = layout.first_stride, at = 0;
  for (uint32_t l = 0; l < network.hidden_layers; ++l) {
    const uint32_t words = half_tiled(depth) / 2;
    NIF_NO_UNROLL
    for (uint32_t i = thread.index(); i < layout.neurons * words; i += kHalfThreads) {
      // Neighbouring threads take neighbouring neurons, whose weights for an input are adjacent.
      const uint32_t neuron = i % layout.neurons, input = 2 * (i / layout.neurons);
      const auto weight = [&](uint32_t k) {
        return neuron < network.width && k < depth
                   ? value_of(network.weights, at + k * network.width + neuron)
                   : 0.0f;
      };
      store_word(to + neuron * stride + 2 * input, to_halves(weight(input), weight(input + 1)));
    }
    to += layout.neurons * stride;
    at += depth * network.width;
    depth = network.width;
    stride = layout.stride;
  }
  for (uint32_t i = thread.index(); i < layout.neurons; i += kHalfThreads)
    store_word(thread.shared() + 4 * i,
               bits_as<uint32_t>(i < network.width ? value_of(network.weights, at + i) : 0.0f));
}

/// Writes a ray's inputs, and zeros up to a whole tile.
NIF_HOST_DEVICE inline void put_half_inputs(const SphericalField& field, const SphericalRay& ray,
                                            uint32_t inputs, unsigned char* row) {
  for (uint32_t i = inputs / 2; i < half_tiled(inputs) / 2; ++i) store_word(row + 4 * i, 0);
  look_up_inputs(field, ray,
                 [&](uint32_t i, float value) { reinterpret_cast<HalfWord*>(row)[i] = to_half(value); });
}

/// The sums of 16 neurons, for `depth` tiles of inputs.
template <class Matrix, uint32_t kTiles, class Thread>
NIF_HOST_DEVICE void sum_half_tile(const Thread& thread, const unsigned char* weights, uint32_t stride,
                                   const typename Matrix::Inputs (&inputs)[kTiles], uint32_t depth,
                                   HalfTileSums& sums) {
  for (uint32_t g = 0; g < kTileGroups; ++g)
    for (uint32_t k = 0; k < 4; ++k) sums[g][k] = 0;
  NIF_UNROLL
  for (uint32_t tile = 0; tile < kTiles; ++tile) {
    if (tile >= depth) continue;
    Matrix::multiply(thread, weights + 2 * kHalfTileInputs * tile, stride, inputs[tile], sums);
  }
}

/// One hidden layer for the rays of a wave, whose inputs become its outputs.
template <class Matrix, uint32_t kTiles, class Thread>
NIF_HOST_DEVICE NIF_INLINE void apply_half_layer(const Thread& thread, const unsigned char* weights,
                                                 uint32_t stride, uint32_t neurons, uint32_t depth,
                                                 float slope, typename Matrix::Inputs (&inputs)[kTiles]) {
  HalfTileOutputs outputs[kTiles];
  NIF_UNROLL
  for (uint32_t tile = 0; tile < kTiles; ++tile) {
    if (tile * kTileNeurons >= neurons) continue;
    HalfTileSums sums;
    sum_half_tile<Matrix>(thread, weights + tile * kTileNeurons * stride, stride, inputs, depth, sums);
    for (uint32_t g = 0; g < kTileGroups; ++g) {
      for (float& sum : sums[g]) sum = max_of(sum, slope * sum);
      outputs[tile][g][0] = to_halves(sums[g][0], sums[g][1]);
      outputs[tile][g][1] = to_halves(sums[g][2], sums[g][3]);
    }
  }
  NIF_UNROLL
  for (uint32_t tile = 0; tile < kTiles; ++tile) {
    if (tile * kTileNeurons >= neurons) continue;
    Matrix::pass_on(thread, outputs[tile], inputs[tile]);
  }
}

/// The last hidden layer and the output: the lane's part of the output for each group's ray.
template <class Matrix, uint32_t kTiles, class Thread>
NIF_HOST_DEVICE void finish_half_network(const Thread& thread, const unsigned char* weights, uint32_t stride,
                                         uint32_t neurons, uint32_t depth, float slope,
                                         const unsigned char* last,
                                         const typename Matrix::Inputs (&inputs)[kTiles],
                                         float (&parts)[kTileGroups]) {
  for (float& part : parts) part = 0;
  NIF_NO_UNROLL
  for (uint32_t neuron = 0; neuron < neurons; neuron += kTileNeurons) {
    HalfTileSums sums;
    sum_half_tile<Matrix>(thread, weights + neuron * stride, stride, inputs, depth, sums);
    for (uint32_t g = 0; g < kTileGroups; ++g)
      for (uint32_t k = 0; k < 4; ++k) {
        const uint32_t at = neuron + 4 * Matrix::quad(thread.lane(), g) + k;
        parts[g] =
            parts[g] + bits_as<float>(load_word(last + 4 * at)) * max_of(sums[g][k], slope * sums[g][k]);
      }
  }
}

/// The network's output for the lane's row of inputs; those of the wave start at `rows`. All lanes of a wave
/// must call this: a lane without a ray works on whatever its row contains. At the end a lane reads only
/// its own row.
template <class Matrix, uint32_t kTiles, class Thread>
NIF_HOST_DEVICE NIF_INLINE float evaluate_half_wave(const Thread& thread, const SphericalNetwork& network,
                                                    const HalfNetworkLayout& layout, float slope,
                                                    unsigned char* rows) {
  static_assert(kTiles * kHalfTileInputs >= kMaxSphericalInputs);
  const uint32_t neurons = layout.neurons, row = layout.first_stride;
  thread.wave_sync();
  typename Matrix::Inputs inputs[kTiles];
  uint32_t depth = half_tiled(network.inputs) / kHalfTileInputs, stride = row;
  NIF_UNROLL
  for (uint32_t tile = 0; tile < kTiles; ++tile) {
    if (tile >= depth) continue;
    Matrix::load(thread, rows + 2 * kHalfTileInputs * tile, row, inputs[tile]);
  }
  const unsigned char* weights = thread.shared() + layout.weights_offset;
  NIF_NO_UNROLL
  for (uint32_t l = 1; l < network.hidden_layers; ++l) {
    apply_half_layer<Matrix>(thread, weights, stride, neurons, depth, slope, inputs);
    weights += neurons * stride;
    stride = layout.stride;
    depth = neurons / kHalfTileInputs;
  }
  float parts[kTileGroups];
  finish_half_network<Matrix>(thread, weights, stride, neurons, depth, slope, thread.shared(), inputs, parts);
  // The memory of the inputs now holds the parts of each ray's output.
  thread.wave_sync();
  for (uint32_t g = 0; g < kTileGroups; ++g)
    store_word(rows + Matrix::ray(thread.lane(), g) * row + 4 * Matrix::quad(thread.lane(), g),
               bits_as<uint32_t>(parts[g]));
  thread.wave_sync();
  const unsigned char* const own = rows + thread.lane() * row;
  float all[kHalfParts];
  for (uint32_t q = 0; q < kHalfParts; ++q) all[q] = bits_as<float>(load_word(own + 4 * q));
  return sum_half_parts(all);
}

}  // namespace nif::kernels::gpu
