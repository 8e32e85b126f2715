// The `spherical` encoding on GPUs in half precision (kernels/reference/spherical_half.hpp says what that
// means): the paper's pipeline.
//
// spherical_cast() finds where rays meet the AABB, answers those that miss it, and lists the others as items
// for the outer or the inner field. Then spherical_half() for the outer items, and for the inner ones: waves
// take items, gather latent vectors and run the network for all their rays at once by matrix instructions.
// Networks too large for a block's memory are left to spherical_answer(), in single precision.
//
// The order of items is left to chance, and answers do not depend on it: an instruction sums a ray's products
// alike in whichever row or column the ray stands.
#pragma once

#include "kernels/hip/half_matrices.hpp"
#include "kernels/hip/rays.hpp"
#include "kernels/reference/spherical_half.hpp"

namespace nif::kernels::hip {

/// Hidden layers of wider networks are left to spherical_answer(): outputs of one layer wait in registers
/// until all its inputs are used up.
inline constexpr uint32_t kMaxHalfTiles = 6;

/// How one network and its rays lie in shared memory: the last layer's weights, single precision; the hidden
/// layers', a row for each neuron, in whole tiles; then a row of inputs for each thread.
struct HalfNetworkLayout {
  uint32_t neurons;         ///< of a hidden layer, whole tiles of them
  uint32_t first_stride;    ///< bytes of a row of the first layer's weights
  uint32_t stride;          ///< bytes of any other row
  uint32_t weights_offset;  ///< bytes, from the start of shared memory
  uint32_t inputs_offset;
};

struct SphericalHalfLayout {
  bool fits;         ///< false where spherical_answer() is for all of the object's rays
  uint32_t threads;  ///< of spherical_half()'s blocks: kBlockThreads, or half of it for large networks
  uint32_t bytes;    ///< of shared memory, for either network
  HalfNetworkLayout outer, inner;
};

NIF_HOST_DEVICE constexpr uint32_t half_tiled(uint32_t n) {
  return (n + kTileNeurons - 1) / kTileNeurons * kTileNeurons;
}

inline HalfNetworkLayout make_half_layout(const SphericalNetwork& network) {
  static_assert(kHalfTileInputs == kTileNeurons);
  // 16 bytes more than whole tiles: rows then start in different banks, and stay aligned for wide loads.
  const auto row = [](uint32_t halves) { return 2 * half_tiled(halves) + 16; };
  HalfNetworkLayout layout{};
  layout.neurons = half_tiled(network.width);
  layout.first_stride = row(network.inputs);
  layout.stride = row(network.width > network.inputs ? network.width : network.inputs);
  layout.weights_offset = layout.neurons * uint32_t(sizeof(float));
  layout.inputs_offset = layout.weights_offset +
                         layout.neurons * (layout.first_stride + (network.hidden_layers - 1) * layout.stride);
  return layout;
}

inline SphericalHalfLayout make_half_layout(const SphericalField& field) {
  SphericalHalfLayout layout{};
  layout.outer = make_half_layout(field.outer);
  layout.inner = make_half_layout(field.inner);
  const auto bytes = [&](const HalfNetworkLayout& of) {
    return of.inputs_offset + layout.threads * of.stride;
  };
  for (layout.threads = kBlockThreads; layout.threads >= kBlockThreads / 2; layout.threads /= 2) {
    const uint32_t outer = bytes(layout.outer), inner = bytes(layout.inner);
    layout.bytes = outer > inner ? outer : inner;
    layout.fits = layout.bytes <= kSharedLimit;
    if (layout.fits) break;
  }
  const uint32_t most = kMaxHalfTiles * kTileNeurons;
  layout.fits = layout.fits && layout.outer.neurons <= most && layout.inner.neurons <= most;
  return layout;
}

/// Coordinates that an item has: those of SphericalCoordinates.
inline constexpr uint32_t kItemCoordinates = 5;

/// Rays to ask a network about, each in one of two lists: outer ones from the first entry on, inner ones from
/// the last one backwards. Device memory; the counts are 0 before spherical_cast(), and `capacity` is
/// RayArrays::count, so that the lists do not meet.
struct SphericalItems {
  uint32_t* outer_count;
  uint32_t* inner_count;
  uint32_t* ray;       ///< [capacity]
  float* coordinates;  ///< [kItemCoordinates][capacity]; the last, distances, of inner items only
  uint32_t capacity;

  template <SphericalKind kKind>
  NIF_HOST_DEVICE uint32_t count() const {
    return kKind == SphericalKind::outer ? *outer_count : *inner_count;
  }
  template <SphericalKind kKind>
  NIF_HOST_DEVICE uint32_t entry(uint32_t item) const {
    return kKind == SphericalKind::outer ? item : capacity - 1 - item;
  }
};

/// Answers what misses the AABB, and lists the rest. Blocks of kBlockThreads, one thread a ray; no shared
/// memory.
template <class Thread>
NIF_HOST_DEVICE void spherical_cast(const Thread& thread, const SphericalBounds& bounds,
                                    const RayArrays& rays, const SphericalItems& items,
                                    const AnswerArrays& answers) {
  const uint32_t number = thread.block() * kBlockThreads + thread.index();
  SphericalRay ray{SphericalKind::none, false, 0, {}};
  if (number < rays.count) {
    ray = prepare_spherical(bounds, load_ray(rays, number));
    if (ray.kind == SphericalKind::none) store_answer(answers, number, kCertainLogit, ray.certain);
  }
  const bool outer = ray.kind == SphericalKind::outer, inner = ray.kind == SphericalKind::inner;
  const uint32_t outer_item = append(thread, outer, items.outer_count);
  const uint32_t inner_item = append(thread, inner, items.inner_count);
  if (!outer && !inner) return;
  const uint32_t entry =
      outer ? items.entry<SphericalKind::outer>(outer_item) : items.entry<SphericalKind::inner>(inner_item);
  items.ray[entry] = number;
  float* to = items.coordinates + entry;
  const size_t next = items.capacity;
  to[0] = ray.at.position_theta;
  to[next] = ray.at.position_phi;
  to[2 * next] = ray.at.direction_theta;
  to[3 * next] = ray.at.direction_phi;
  if (inner) to[4 * next] = ray.at.distance;
}

/// Copies a network to shared memory, as halves, in whole tiles: what is beyond it is 0. For all threads of a
/// block.
template <class Thread>
NIF_HOST_DEVICE void load_half_network(const Thread& thread, const SphericalNetwork& network,
                                       const HalfNetworkLayout& layout) {
  const uint32_t threads = thread.threads();
  unsigned char* to = thread.shared() + layout.weights_offset;
  uint32_t depth = network.inputs, stride = layout.first_stride, at = 0;
  for (uint32_t l = 0; l < network.hidden_layers; ++l) {
    const uint32_t words = half_tiled(depth) / 2;
    NIF_NO_UNROLL
    for (uint32_t i = thread.index(); i < layout.neurons * words; i += threads) {
      // Neighbours take neighbouring neurons, whose weights for an input lie together.
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
  for (uint32_t i = thread.index(); i < layout.neurons; i += threads)
    store_word(thread.shared() + 4 * i,
               bits_as<uint32_t>(i < network.width ? value_of(network.weights, at + i) : 0.0f));
}

/// Writes the inputs of one item, and zeros up to a whole tile.
template <SphericalKind kKind>
NIF_HOST_DEVICE void gather_spherical(const SphericalField& field, const SphericalItems& items,
                                      uint32_t entry, uint32_t inputs, unsigned char* row) {
  const float* from = items.coordinates + entry;
  const size_t next = items.capacity;
  const float distance = kKind == SphericalKind::inner ? from[4 * next] : 0.0f;
  const SphericalRay ray{kKind, false, 0, {from[0], from[next], from[2 * next], from[3 * next], distance}};
  for (uint32_t i = inputs / 2; i < half_tiled(inputs) / 2; ++i) store_word(row + 4 * i, 0);
  look_up_inputs(field, ray,
                 [&](uint32_t i, float value) { reinterpret_cast<HalfWord*>(row)[i] = to_half(value); });
}

/// The sums of 16 neurons, for inputs of `depth` in whole tiles.
template <class Matrix, class Thread>
NIF_HOST_DEVICE void sum_half_tile(const Thread& thread, const unsigned char* weights, uint32_t weight_stride,
                                   const unsigned char* inputs, uint32_t stride, uint32_t depth,
                                   HalfTileSums& sums) {
  for (uint32_t g = 0; g < kTileGroups; ++g)
    for (uint32_t k = 0; k < 4; ++k) sums[g][k] = 0;
  NIF_NO_UNROLL
  for (uint32_t k = 0; k < depth; k += kHalfTileInputs)
    Matrix::multiply(thread, weights + 2 * k, weight_stride, inputs + 2 * k, stride, sums);
}

/// One hidden layer for the rays of a wave, whose inputs become its outputs.
template <class Matrix, class Thread>
NIF_HOST_DEVICE void apply_half_layer(const Thread& thread, const unsigned char* weights,
                                      uint32_t weight_stride, uint32_t neurons, uint32_t depth, float slope,
                                      unsigned char* inputs, uint32_t stride) {
  const uint32_t lane = thread.lane();
  uint32_t outputs[kMaxHalfTiles][kTileGroups][2];
  NIF_UNROLL
  for (uint32_t tile = 0; tile < kMaxHalfTiles; ++tile) {
    if (tile * kTileNeurons >= neurons) continue;
    HalfTileSums sums;
    sum_half_tile<Matrix>(thread, weights + tile * kTileNeurons * weight_stride, weight_stride, inputs,
                          stride, depth, sums);
    for (uint32_t g = 0; g < kTileGroups; ++g) {
      for (float& sum : sums[g]) sum = max_of(sum, slope * sum);
      outputs[tile][g][0] = to_halves(sums[g][0], sums[g][1]);
      outputs[tile][g][1] = to_halves(sums[g][2], sums[g][3]);
    }
  }
  thread.wave_sync();
  NIF_UNROLL
  for (uint32_t tile = 0; tile < kMaxHalfTiles; ++tile) {
    if (tile * kTileNeurons >= neurons) continue;
    for (uint32_t g = 0; g < kTileGroups; ++g) {
      unsigned char* const to =
          inputs + Matrix::ray(lane, g) * stride + 2 * (tile * kTileNeurons + 4 * Matrix::quad(lane, g));
      store_word(to, outputs[tile][g][0]);
      store_word(to + 4, outputs[tile][g][1]);
    }
  }
  thread.wave_sync();
}

/// The last hidden layer and the output, whose parts take the place of the inputs: kHalfParts floats in each
/// ray's row.
template <class Matrix, class Thread>
NIF_HOST_DEVICE void finish_half_network(const Thread& thread, const unsigned char* weights,
                                         uint32_t weight_stride, uint32_t neurons, uint32_t depth,
                                         float slope, const unsigned char* last, unsigned char* inputs,
                                         uint32_t stride) {
  const uint32_t lane = thread.lane();
  float parts[kTileGroups] = {};
  NIF_NO_UNROLL
  for (uint32_t neuron = 0; neuron < neurons; neuron += kTileNeurons) {
    HalfTileSums sums;
    sum_half_tile<Matrix>(thread, weights + neuron * weight_stride, weight_stride, inputs, stride, depth,
                          sums);
    for (uint32_t g = 0; g < kTileGroups; ++g)
      for (uint32_t k = 0; k < 4; ++k)
        parts[g] = parts[g] + bits_as<float>(load_word(last + 4 * (neuron + 4 * Matrix::quad(lane, g) + k))) *
                                  max_of(sums[g][k], slope * sums[g][k]);
  }
  thread.wave_sync();
  for (uint32_t g = 0; g < kTileGroups; ++g)
    store_word(inputs + Matrix::ray(lane, g) * stride + 4 * Matrix::quad(lane, g),
               bits_as<uint32_t>(parts[g]));
  thread.wave_sync();
}

/// Answers the items of one field. Blocks of layout.threads, any number of them; layout.bytes.
template <class Matrix, SphericalKind kKind, class Thread>
NIF_HOST_DEVICE void spherical_half(const Thread& thread, const SphericalField& field,
                                    const SphericalHalfLayout& layout, const SphericalItems& items,
                                    const AnswerArrays& answers) {
  const SphericalNetwork& network = kKind == SphericalKind::outer ? field.outer : field.inner;
  const HalfNetworkLayout& own_layout = kKind == SphericalKind::outer ? layout.outer : layout.inner;
  const uint32_t neurons = own_layout.neurons, stride = own_layout.stride, wave = thread.wave_size();
  const unsigned char* const last = thread.shared();
  unsigned char* const inputs = thread.shared() + own_layout.inputs_offset + thread.wave() * wave * stride;
  unsigned char* const own = inputs + thread.lane() * stride;
  load_half_network(thread, network, own_layout);
  thread.sync();

  // All lanes of a wave go round together; a lane without an item works on what there is in its row.
  const uint32_t count = items.count<kKind>(), step = thread.blocks() * thread.threads();
  for (uint32_t first = thread.block() * thread.threads() + thread.wave() * wave; first < count;) {
    const bool present = thread.lane() < count - first;
    const uint32_t entry = items.entry<kKind>(first + thread.lane());
    if (present) gather_spherical<kKind>(field, items, entry, network.inputs, own);
    thread.wave_sync();
    const unsigned char* weights = thread.shared() + own_layout.weights_offset;
    uint32_t weight_stride = own_layout.first_stride, depth = network.inputs;
    for (uint32_t l = 1; l < network.hidden_layers; ++l) {
      apply_half_layer<Matrix>(thread, weights, weight_stride, neurons, depth, field.slope, inputs, stride);
      weights += neurons * weight_stride;
      weight_stride = stride;
      depth = neurons;
    }
    finish_half_network<Matrix>(thread, weights, weight_stride, neurons, depth, field.slope, last, inputs,
                                stride);
    if (present) {
      float parts[kHalfParts];
      for (uint32_t q = 0; q < kHalfParts; ++q) parts[q] = bits_as<float>(load_word(own + 4 * q));
      store_answer(answers, items.ray[entry], spherical_logit(sum_half_parts(parts)), false);
    }
    // No wave_sync(): from the last one on each lane reads and writes its own row only.
    if (count - first <= step) return;
    first += step;
  }
}

}  // namespace nif::kernels::hip
