// The `segment` encoding on GPUs, with exactly the bits of kernels/reference, which has all of the maths.
//
// There are two ways to the same answers: a thread traverses its own ray and evaluates the network for it
// (answer_segment_ray()); or a wave evaluates the network for all its rays at once, by matrix instructions
// (evaluate_wave()), after other threads have traversed them (pipeline_kernels.hpp).
#pragma once

#include "kernels/gpu/network/matrices.hpp"
#include "kernels/gpu/network/network_device_field.hpp"
#include "kernels/gpu/object.hpp"
#include "kernels/gpu/planes/skipping_traversal.hpp"
#include "kernels/reference/network/evaluate_network.hpp"
#include "kernels/reference/network/samples.hpp"

namespace nif::kernels::gpu {

/// Intervals of a traversal that are kept, in shared memory and in items. Rays with more are traversed again.
inline constexpr uint32_t kKeptIntervals = 5, kIntervalWords = 3,
                          kKeptWords = kKeptIntervals * kIntervalWords;
/// Points of such a ray that are kept in the same memory.
inline constexpr uint32_t kPointWords = 2, kKeptPoints = kKeptWords / kPointWords;

/// Wider networks are left to single threads: the outputs of a hidden layer wait in registers until all its
/// inputs are used up.
inline constexpr uint32_t kMaxTiles = 3;
inline constexpr uint32_t kMaxTiledWidth = kMaxTiles * kTileNeurons;

/// Layout of a field's network in shared memory for evaluate_wave(): biases, weights row by row with whole
/// tiles of rows, inputs row by row. Made on the host.
struct SegmentLayout {
  uint32_t widest;  ///< neurons of the widest hidden layer
  bool tiled;       ///< whether evaluate_wave() can be used
  uint32_t stride;  ///< bytes of a row of weights or of a ray's inputs
  uint32_t rows;    ///< of weights, in all layers
  uint32_t bytes;   ///< of shared memory
};

NIF_HOST_DEVICE constexpr uint32_t round_up(uint32_t n, uint32_t to) { return (n + to - 1) / to * to; }

inline SegmentLayout make_layout(const SegmentField& field) {
  const Network& network = field.network;
  SegmentLayout layout{};
  uint32_t widest = 0, longest = 0;
  for (uint32_t l = 0; l < network.layer_count; ++l) {
    const Network::Layer& layer = network.layers[l];
    const bool last = l + 1 == network.layer_count;
    if (!last && layer.outputs > widest) widest = layer.outputs;
    if (layer.inputs > longest) longest = layer.inputs;
    layout.rows += last ? 1 : round_up(layer.outputs, kTileNeurons);
  }
  layout.widest = widest;
  // 16 more than whole tiles: rows then start in different banks and stay aligned for the widest loads.
  layout.stride = round_up(longest, kTileInputs) + 16;
  layout.bytes = round_up(4 * layout.rows, 16) + (layout.rows + kBlockThreads) * layout.stride;
  layout.tiled = widest <= kMaxTiledWidth && layout.bytes <= kSharedLimit;
  return layout;
}

/// The answer of a traversal that needs no network.
NIF_HOST_DEVICE inline ObjectAnswer answer_of(const TraversalResult& traversal) {
  return {traversal.verdict == Verdict::visible ? kCertainLogit : -kCertainLogit, traversal.certain};
}

/// What a thread keeps of its traversal in shared memory, in words that are kStride apart: a column among as
/// many threads, or 1.
template <uint32_t kStride>
class KeptIntervals {
 public:
  NIF_HOST_DEVICE explicit KeptIntervals(uint32_t* column) : column_(column) {}
  NIF_HOST_DEVICE void keep(uint32_t i, const Interval& interval) const {
    if (i >= kKeptIntervals) return;
    put(kIntervalWords * i, bits_as<uint32_t>(interval.begin));
    put(kIntervalWords * i + 1, bits_as<uint32_t>(interval.end));
    put(kIntervalWords * i + 2, interval.heights);
  }
  NIF_HOST_DEVICE Interval at(uint32_t i) const {
    return {get<float>(kIntervalWords * i), get<float>(kIntervalWords * i + 1),
            get<uint32_t>(kIntervalWords * i + 2)};
  }
  // Or points, as their t and height.
  NIF_HOST_DEVICE void keep_point(uint32_t i, float t, uint8_t height) const {
    if (i >= kKeptPoints) return;
    put(kPointWords * i, bits_as<uint32_t>(t));
    put(kPointWords * i + 1, height);
  }
  NIF_HOST_DEVICE float point_t(uint32_t i) const { return get<float>(kPointWords * i); }
  NIF_HOST_DEVICE uint8_t point_height(uint32_t i) const {
    return uint8_t(get<uint32_t>(kPointWords * i + 1));
  }

 private:
  NIF_HOST_DEVICE void put(uint32_t word, uint32_t value) const { column_[word * kStride] = value; }
  template <class T>
  NIF_HOST_DEVICE T get(uint32_t word) const {
    return bits_as<T>(column_[word * kStride]);
  }

  uint32_t* column_;
};

/// Writes a point's inputs to their places among those of the ray. kFeatures: features per corner; 2 reads
/// corner bricks, and 0 means any number, one feature at a time.
template <uint32_t kFeatures>
NIF_HOST_DEVICE void put_point(const DeviceSegmentField& field, uint32_t number, const SamplePoint& point,
                               unsigned char* inputs) {
  inputs[field.samples * field.features_per_corner + number] = point.height;
  if constexpr (kFeatures == 2) {
    int32_t first, second;
    sum_pairs(field, point, first, second);
    reinterpret_cast<HalfWord*>(inputs)[number] =
        HalfWord(feature_input(first) | uint32_t(feature_input(second)) << 8);
  } else {
    const uint32_t features = field.features_per_corner;
    for (uint32_t f = 0; f < features; ++f) {
      int32_t sum = 0;
      for_each_corner(field, point, [&](uint32_t corner, int32_t weight) {
        sum += weight * field.features[corner * features + f];
      });
      inputs[number * features + f] = feature_input(sum);
    }
  }
}

NIF_HOST_DEVICE inline void put_globals(const SegmentField& field, const TraversalResult& traversal,
                                        unsigned char* inputs) {
  uint8_t globals[kGlobalInputs];
  place_globals(field, traversal, globals);
  unsigned char* to = inputs + field.samples * (field.features_per_corner + 1);
  for (uint32_t i = 0; i < kGlobalInputs; i += 4)
    store_word(to + i, globals[i] | uint32_t(globals[i + 1]) << 8 | uint32_t(globals[i + 2]) << 16 |
                           uint32_t(globals[i + 3]) << 24);
}

/// Four neurons' outputs as a word.
NIF_HOST_DEVICE inline uint32_t pack_activations(const int32_t (&sums)[4], uint32_t shift) {
  return uint32_t(activation(sums[0], shift)) | uint32_t(activation(sums[1], shift)) << 8 |
         uint32_t(activation(sums[2], shift)) << 16 | uint32_t(activation(sums[3], shift)) << 24;
}

/// The network's output for the inputs in a row, which has room for them and for two hidden layers of
/// `widest` bytes.
template <class Thread>
NIF_HOST_DEVICE int32_t evaluate_row(const Thread& thread, const Network& network, uint32_t widest,
                                     unsigned char* row) {
  unsigned char* x = row;
  unsigned char* y = row + network.layers[0].inputs;
  for (uint32_t l = 0;; ++l) {
    const Network::Layer& layer = network.layers[l];
    const uint32_t words = layer.inputs / 4;
    const int8_t* weights = layer.weights;
    if (l + 1 == network.layer_count) {
      int32_t sum = layer.biases[0];
      for (uint32_t i = 0; i < words; ++i)
        sum = thread.dot4(sum, load_word(weights + 4 * i), load_word(x + 4 * i));
      return sum;
    }
    for (uint32_t neuron = 0; neuron < layer.outputs; neuron += 4, weights += 4 * layer.inputs) {
      int32_t sums[4];
      for (uint32_t k = 0; k < 4; ++k) sums[k] = layer.biases[neuron + k];
      for (uint32_t i = 0; i < words; ++i) {
        const uint32_t input = load_word(x + 4 * i);
        for (uint32_t k = 0; k < 4; ++k)
          sums[k] = thread.dot4(sums[k], load_word(weights + k * layer.inputs + 4 * i), input);
      }
      store_word(y + neuron, pack_activations(sums, layer.shift));
    }
    x = y;
    y = row + network.layers[0].inputs + (l % 2 == 0 ? widest : 0);
  }
}

/// One thread answers its ray: traversal, sample points, features, network. `widest` and `row`: as for
/// evaluate_row().
template <uint32_t kFeatures, class Thread, class Kept>
NIF_HOST_DEVICE ObjectAnswer answer_segment_ray(const Thread& thread, const DeviceSegmentField& field,
                                                const Segment& segment, const Kept& kept, uint32_t widest,
                                                unsigned char* row) {
  TraversalResult traversal;
  traverse_object(field, field.words, segment, traversal,
                  [&](uint32_t i, const Interval& interval) { kept.keep(i, interval); });
  if (traversal.verdict != Verdict::open) return answer_of(traversal);
  SamplePlacer placer(field, traversal);
  if (traversal.interval_count <= kKeptIntervals) {
    for (uint32_t i = 0; i < traversal.interval_count; ++i)
      placer.add(kept.at(i), i + 1 == traversal.interval_count,
                 [&](uint32_t number, const SamplePoint& point) {
                   put_point<kFeatures>(field, number, point, row);
                 });
  } else {
    // The traversal only records where points lie, because traversal and feature look-up take many registers
    // each.
    for (uint32_t first = 0; first < field.samples; first += kKeptPoints) {
      SamplePlacer again(field, traversal);
      TraversalResult same;
      traverse_object(field, field.words, segment, same, [&](uint32_t i, const Interval& interval) {
        again.place(
            interval, i + 1 == traversal.interval_count,
            [&](uint32_t number, float t, uint8_t height) { kept.keep_point(number - first, t, height); });
      });
      for (uint32_t k = 0; k < kKeptPoints && first + k < field.samples; ++k)
        put_point<kFeatures>(field, first + k, placer.point_at(kept.point_t(k), kept.point_height(k)), row);
    }
  }
  put_globals(field, traversal, row);
  return {evaluate_row(thread, field.network, widest, row), false};
}

/// Copies the network to shared memory, in whole tiles padded with 0. All threads of a block must call this.
template <class Thread>
NIF_HOST_DEVICE void load_network(const Thread& thread, const Network& network, const SegmentLayout& layout,
                                  unsigned char* biases, unsigned char* weights) {
  const uint32_t words = layout.stride / 4;
  for (uint32_t i = thread.index(); i < layout.rows * words; i += kBlockThreads) {
    uint32_t row = i / words;
    const uint32_t column = i % words;
    uint32_t l = 0;
    for (; l + 1 < network.layer_count; ++l) {
      const uint32_t rows = round_up(network.layers[l].outputs, kTileNeurons);
      if (row < rows) break;
      row -= rows;
    }
    const Network::Layer& layer = network.layers[l];
    const bool real = row < layer.outputs;
    store_word(weights + 4 * i, real && column < layer.inputs / 4
                                    ? load_word(layer.weights + row * layer.inputs + 4 * column)
                                    : 0);
    if (column == 0) store_word(biases + 4 * (i / words), real ? uint32_t(layer.biases[row]) : 0);
  }
}

/// One hidden layer for the rays of a wave; its outputs overwrite its inputs.
template <class Matrix, class Thread>
NIF_HOST_DEVICE NIF_INLINE void apply_layer(const Thread& thread, const Network::Layer& layer,
                                            uint32_t stride, const unsigned char* biases,
                                            const unsigned char* weights, unsigned char* inputs) {
  const uint32_t lane = thread.lane();
  uint32_t outputs[kMaxTiles][kTileGroups];
  NIF_UNROLL
  for (uint32_t tile = 0; tile < kMaxTiles; ++tile) {
    if (tile * kTileNeurons >= layer.outputs) continue;  // `break` costs registers
    TileSums sums;
    for (uint32_t g = 0; g < kTileGroups; ++g)
      for (uint32_t k = 0; k < 4; ++k)
        sums[g][k] = int32_t(load_word(biases + 4 * (tile * kTileNeurons + 4 * Matrix::quad(lane, g) + k)));
    for (uint32_t k = 0; k < layer.inputs; k += kTileInputs)
      Matrix::multiply(thread, weights + tile * kTileNeurons * stride + k, inputs + k, stride, sums);
    for (uint32_t g = 0; g < kTileGroups; ++g) outputs[tile][g] = pack_activations(sums[g], layer.shift);
  }
  thread.wave_sync();
  NIF_UNROLL
  for (uint32_t tile = 0; tile < kMaxTiles; ++tile) {
    if (tile * kTileNeurons >= layer.outputs) continue;  // `break` costs registers
    for (uint32_t g = 0; g < kTileGroups; ++g)
      store_word(inputs + Matrix::ray(lane, g) * stride + tile * kTileNeurons + 4 * Matrix::quad(lane, g),
                 outputs[tile][g]);
  }
  thread.wave_sync();
}

/// The network's output for the lane's row of inputs; those of the wave start at `inputs`. All lanes of a
/// wave must call this: a lane without a ray works on whatever its row contains. At the end a lane
/// reads only its own row.
template <class Matrix, class Thread>
NIF_HOST_DEVICE NIF_INLINE int32_t evaluate_wave(const Thread& thread, const Network& network,
                                                 uint32_t stride, const unsigned char* biases,
                                                 const unsigned char* weights, unsigned char* inputs) {
  thread.wave_sync();
  uint32_t row = 0;
  for (uint32_t l = 0; l + 1 < network.layer_count; ++l) {
    const Network::Layer& layer = network.layers[l];
    apply_layer<Matrix>(thread, layer, stride, biases + 4 * row, weights + row * stride, inputs);
    row += round_up(layer.outputs, kTileNeurons);
  }
  const unsigned char* const own = inputs + thread.lane() * stride;
  int32_t logit = int32_t(load_word(biases + 4 * row));
  for (uint32_t k = 0; k < network.layers[network.layer_count - 1].inputs; k += 4)
    logit = thread.dot4(logit, load_word(weights + row * stride + k), load_word(own + k));
  return logit;
}

}  // namespace nif::kernels::gpu
