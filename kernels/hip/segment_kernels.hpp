// The `segment` encoding on GPUs, to the bit as kernels/reference answers it, which has all of the maths.
//
// Two ways lead to the same answers (docs/gpu.md):
// - segment_whole(): a thread walks its ray and asks the network, all in one kernel. For small batches, and
//   for networks that the other way has no room for.
// - segment_walk(), then segment_network(): walks are answered or leave an item of work in a list without
//   gaps; then waves take items from there, gather features and run the network for all their rays at once
//   by matrix instructions. Rays of very many runs go to a list of their own, for segment_whole().
// The order of items is left to chance. Each names its ray, and nothing of it depends on its neighbours, so
// answers do not depend on that order.
#pragma once

#include "kernels/hip/matrices.hpp"
#include "kernels/hip/rays.hpp"

namespace nif::kernels::hip {

/// Runs of a walk that are kept, in shared memory and in items. Rays of more are walked again.
inline constexpr uint32_t kKeptRuns = 8;

/// Hidden layers of wider networks are left to segment_whole(): outputs of one layer wait in registers until
/// all its inputs are used up.
inline constexpr uint32_t kMaxTiles = 3;
inline constexpr uint32_t kMaxTiledWidth = kMaxTiles * kTileNeurons;

/// How shared memory is laid out for a field's network; made on the host.
struct SegmentLayout {
  // Of segment_whole(), a row for each thread: inputs, then outputs of every other hidden layer.
  uint32_t whole_row;     ///< bytes; an odd number of words, so that rows lie in different banks
  uint32_t whole_hidden;  ///< bytes of one hidden layer
  uint32_t whole_bytes;   ///< of shared memory, kept runs included

  // Of segment_network(): biases, weights row by row with whole tiles of rows, inputs row by row.
  bool tiled;            ///< whether segment_network() can be used
  uint32_t stride;       ///< bytes of a row of weights or of a ray's inputs
  uint32_t rows;         ///< of weights, of all layers
  uint32_t tiled_bytes;  ///< of shared memory
};

/// Threads of segment_whole()'s blocks: so few that shared memory has room for the inputs and outputs of the
/// largest networks there are, and that small batches spread over the device.
inline constexpr uint32_t kWholeThreads = 64;

NIF_HOST_DEVICE constexpr uint32_t kept_bytes(uint32_t threads) {
  return 2 * kKeptRuns * threads * uint32_t(sizeof(float));
}
inline constexpr uint32_t kWalkSharedBytes = kept_bytes(kBlockThreads);

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
  layout.whole_hidden = widest;
  const uint32_t words = (network.layers[0].inputs + 2 * widest) / 4;
  layout.whole_row = 4 * (words | 1);
  layout.whole_bytes = kept_bytes(kWholeThreads) + layout.whole_row * kWholeThreads;
  // 16 more than whole tiles: rows then start in different banks, and stay aligned for the widest loads.
  layout.stride = round_up(longest, kTileInputs) + 16;
  layout.tiled_bytes = round_up(4 * layout.rows, 16) + (layout.rows + kBlockThreads) * layout.stride;
  layout.tiled = widest <= kMaxTiledWidth && layout.tiled_bytes <= kSharedLimit;
  return layout;
}

/// A list of rays that the walk has left open, and one of those with more than kKeptRuns runs. Device memory;
/// the counts are 0 before the walk. No entry is written beyond `capacity`, which is RayArrays::count.
struct OpenItems {
  uint32_t* open_count;
  uint32_t* hard_count;
  uint32_t* hard;   ///< [capacity]: rays
  uint32_t* ray;    ///< [capacity]
  uint32_t* about;  ///< [capacity]: runs, and flags from bit kItemFlags on
  float* begin;     ///< [kKeptRuns][capacity]: the runs
  float* end;
  uint32_t capacity;
};
inline constexpr uint32_t kItemFlags = 8;

/// The runs of a thread's walk in shared memory, in words kStride apart: a column of as many threads, or 1.
template <uint32_t kStride>
class KeptRuns {
 public:
  NIF_HOST_DEVICE explicit KeptRuns(float* column) : column_(column) {}
  NIF_HOST_DEVICE void keep(uint32_t i, const Run& run) const {
    if (i >= kKeptRuns) return;
    column_[2 * i * kStride] = run.begin;
    column_[(2 * i + 1) * kStride] = run.end;
  }
  NIF_HOST_DEVICE Run at(uint32_t i) const {
    return {column_[2 * i * kStride], column_[(2 * i + 1) * kStride]};
  }

 private:
  float* column_;
};
/// The thread's column at the start of shared memory.
template <uint32_t kThreads, class Thread>
NIF_HOST_DEVICE KeptRuns<kThreads> runs_of(const Thread& thread) {
  return KeptRuns<kThreads>(reinterpret_cast<float*>(thread.shared()) + thread.index());
}

/// Writes a point's inputs to where they stand among those of the ray. kFeatures: of a corner, or 0 for any
/// number, a feature at a time.
template <uint32_t kFeatures>
NIF_HOST_DEVICE void put_features(const SegmentField& field, uint32_t number, const SamplePoint& point,
                                  unsigned char* inputs) {
  if constexpr (kFeatures == 2) {
    int32_t first = 0, second = 0;
    for_each_corner(field, point, [&](uint32_t corner, int32_t weight) {
      const uint32_t pair = reinterpret_cast<const HalfWord*>(field.features)[corner];
      first += weight * int8_t(pair);
      second += weight * int8_t(pair >> 8);
    });
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

NIF_HOST_DEVICE inline void put_globals(const SegmentField& field, const WalkResult& walk,
                                        unsigned char* inputs) {
  uint8_t globals[kGlobalInputs];
  place_globals(field, walk, globals);
  unsigned char* to = inputs + field.samples * field.features_per_corner;
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

/// A thread alone with its ray: walk, sample points, features, network. `widest` and `row` as for
/// evaluate_row().
template <uint32_t kFeatures, class Thread, class Kept>
NIF_HOST_DEVICE ObjectAnswer answer_segment_ray(const Thread& thread, const SegmentField& field,
                                                const Segment& segment, const Kept& kept, uint32_t widest,
                                                unsigned char* row) {
  WalkResult walk;
  follow_segment(
      field, segment, walk, [&](uint32_t i, const Run& run) { kept.keep(i, run); }, NoVisit());
  if (walk.verdict != Verdict::ambiguous) return answer_of(walk);
  SamplePlacer placer(field, walk);
  const auto add = [&](uint32_t i, const Run& run) {
    placer.add(run, i + 1 == walk.run_count, [&](uint32_t number, const SamplePoint& point) {
      put_features<kFeatures>(field, number, point, row);
    });
  };
  if (walk.run_count <= kKeptRuns) {
    for (uint32_t i = 0; i < walk.run_count; ++i) add(i, kept.at(i));
  } else {
    WalkResult again;
    follow_segment(field, segment, again, add, NoVisit());
  }
  put_globals(field, walk, row);
  return {evaluate_row(thread, field.network, widest, row), false};
}

/// Answers all rays, or those of a list. Blocks of kWholeThreads, any number of them; layout.whole_bytes.
template <uint32_t kFeatures, class Thread>
NIF_HOST_DEVICE void segment_whole(const Thread& thread, const SegmentField& field,
                                   const SegmentLayout& layout, const RayArrays& rays, const RayList& list,
                                   const AnswerArrays& answers) {
  const auto kept = runs_of<kWholeThreads>(thread);
  unsigned char* const row = thread.shared() + kept_bytes(kWholeThreads) + thread.index() * layout.whole_row;
  for_each_ray<kWholeThreads>(thread, rays, list, [&](uint32_t ray) {
    store_answer(
        answers, ray,
        answer_segment_ray<kFeatures>(thread, field, load_ray(rays, ray), kept, layout.whole_hidden, row));
  });
}

/// Answers what the walk alone can answer, and lists the rest. Blocks of kBlockThreads, one thread a ray;
/// kWalkSharedBytes.
template <class Thread>
NIF_HOST_DEVICE void segment_walk(const Thread& thread, const SegmentField& field, const RayArrays& rays,
                                  const OpenItems& items, const AnswerArrays& answers) {
  const auto kept = runs_of<kBlockThreads>(thread);
  const uint32_t ray = thread.block() * kBlockThreads + thread.index();
  WalkResult walk;
  if (ray < rays.count) {
    follow_segment(
        field, load_ray(rays, ray), walk, [&](uint32_t i, const Run& run) { kept.keep(i, run); }, NoVisit());
    if (walk.verdict != Verdict::ambiguous) store_answer(answers, ray, answer_of(walk));
  }
  const bool ambiguous = walk.verdict == Verdict::ambiguous;
  const bool open = ambiguous && walk.run_count <= kKeptRuns, hard = ambiguous && !open;
  const uint32_t item = append(thread, open, items.open_count);
  if (open) {
    items.ray[item] = ray;
    items.about[item] =
        walk.run_count | (uint32_t(walk.saw_outside) | uint32_t(walk.saw_inside) << 1 |
                          uint32_t(walk.starts_in_surface) << 2 | uint32_t(walk.ends_in_surface) << 3)
                             << kItemFlags;
    for (uint32_t i = 0; i < walk.run_count; ++i) {
      const Run run = kept.at(i);
      items.begin[size_t(i) * items.capacity + item] = run.begin;
      items.end[size_t(i) * items.capacity + item] = run.end;
    }
  }
  const uint32_t hard_item = append(thread, hard, items.hard_count);
  if (hard) items.hard[hard_item] = ray;
}

/// Writes the inputs of one item; returns its ray.
template <uint32_t kFeatures>
NIF_HOST_DEVICE uint32_t gather_item(const SegmentField& field, const RayArrays& rays, const OpenItems& items,
                                     uint32_t item, unsigned char* inputs) {
  const uint32_t ray = items.ray[item], about = items.about[item];
  WalkResult walk;
  float reach;
  to_grid_space(field, load_ray(rays, ray), walk, reach);
  walk.run_count = about & ((1u << kItemFlags) - 1);
  walk.saw_outside = about >> kItemFlags & 1;
  walk.saw_inside = about >> (kItemFlags + 1) & 1;
  walk.starts_in_surface = about >> (kItemFlags + 2) & 1;
  walk.ends_in_surface = about >> (kItemFlags + 3) & 1;
  const auto run = [&](uint32_t i) {
    const size_t at = size_t(i) * items.capacity + item;
    return Run{items.begin[at], items.end[at]};
  };
  // In the walk's own order, so with its bits.
  walk.surface_t = 0;
  for (uint32_t i = 0; i < walk.run_count; ++i) walk.surface_t += run(i).end - run(i).begin;
  SamplePlacer placer(field, walk);
  for (uint32_t i = 0; i < walk.run_count; ++i)
    placer.add(run(i), i + 1 == walk.run_count, [&](uint32_t number, const SamplePoint& point) {
      put_features<kFeatures>(field, number, point, inputs);
    });
  put_globals(field, walk, inputs);
  return ray;
}

/// Copies the network to shared memory, in whole tiles: what is beyond it is 0. For all threads of a block.
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

/// One hidden layer for the rays of a wave, whose inputs become its outputs.
template <class Matrix, class Thread>
NIF_HOST_DEVICE void apply_layer(const Thread& thread, const Network::Layer& layer, uint32_t stride,
                                 const unsigned char* biases, const unsigned char* weights,
                                 unsigned char* inputs) {
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

/// Answers the items of the list. Blocks of kBlockThreads, any number of them; layout.tiled_bytes.
template <class Matrix, uint32_t kFeatures, class Thread>
NIF_HOST_DEVICE void segment_network(const Thread& thread, const SegmentField& field,
                                     const SegmentLayout& layout, const RayArrays& rays,
                                     const OpenItems& items, const AnswerArrays& answers) {
  unsigned char* const biases = thread.shared();
  unsigned char* const weights = biases + round_up(4 * layout.rows, 16);
  const uint32_t wave = thread.wave_size(), stride = layout.stride;
  unsigned char* const inputs = weights + (layout.rows + thread.wave() * wave) * stride;
  unsigned char* const own = inputs + thread.lane() * stride;
  const Network& network = field.network;
  load_network(thread, network, layout, biases, weights);
  thread.sync();

  // All lanes of a wave go round together; a lane without an item works on what there is in its row.
  const uint32_t count = *items.open_count, step = thread.blocks() * kBlockThreads;
  for (uint32_t first = thread.block() * kBlockThreads + thread.wave() * wave; first < count;) {
    const bool present = thread.lane() < count - first;
    uint32_t ray = 0;
    if (present) ray = gather_item<kFeatures>(field, rays, items, first + thread.lane(), own);
    thread.wave_sync();
    uint32_t row = 0;
    for (uint32_t l = 0; l + 1 < network.layer_count; ++l) {
      const Network::Layer& layer = network.layers[l];
      apply_layer<Matrix>(thread, layer, stride, biases + 4 * row, weights + row * stride, inputs);
      row += round_up(layer.outputs, kTileNeurons);
    }
    if (present) {
      int32_t logit = int32_t(load_word(biases + 4 * row));
      for (uint32_t k = 0; k < network.layers[network.layer_count - 1].inputs; k += 4)
        logit = thread.dot4(logit, load_word(weights + row * stride + k), load_word(own + k));
      store_answer(answers, ray, {logit, false});
    }
    // No wave_sync(): from the last one on each lane reads and writes its own row only.
    if (count - first <= step) return;
    first += step;
  }
}

}  // namespace nif::kernels::hip
