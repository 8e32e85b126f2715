// The answer to one query of one `segment` object: walk, then, where that leaves it open, the network.
#pragma once

#include "kernels/reference/segment/samples.hpp"

namespace nif::kernels {

/// A hidden neuron's output from its sum.
NIF_HOST_DEVICE constexpr int32_t activation(int32_t sum, uint32_t shift) {
  const int32_t scaled = (sum + ((1 << shift) >> 1)) >> shift;
  return scaled < 0 ? 0 : scaled > 127 ? 127 : scaled;
}

/// The network's single output for the given inputs. Sums are 32-bit and, for networks that the asset reader
/// accepts, cannot overflow.
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

// What query_as() does with runs: structures, because GPU compilers want to know of a lambda that a device
// could call it.
struct KeepRuns {
  Run* kept;
  uint32_t room;
  NIF_HOST_DEVICE void operator()(uint32_t i, const Run& run) const {
    if (i < room) kept[i] = run;
  }
};
struct PlaceRuns {
  SamplePlacer& placer;
  Placement& placement;
  uint32_t count;
  NIF_HOST_DEVICE void operator()(uint32_t i, const Run& run) const {
    placer.add(run, i + 1 == count, placement);
  }
};

/// As query(), of a field in another form that has its own voxel_word() and interpolate_features().
template <class Field>
Answer query_as(const Field& field, const Segment& segment) {
  // More runs are rare, and threads may have little stack.
  constexpr uint32_t kKeptRuns = 64;
  Run kept[kKeptRuns];
  WalkResult walk;
  follow_segment(field, segment, walk, KeepRuns{kept, kKeptRuns}, NoVisit());
  if (walk.verdict != Verdict::ambiguous) {
    const bool visible = walk.verdict == Verdict::visible;
    return {visible, walk.certain, visible ? kCertainLogit : -kCertainLogit};
  }
  Placement placement;
  SamplePlacer placer(field, walk);
  const PlaceRuns add{placer, placement, walk.run_count};
  if (walk.run_count <= kKeptRuns) {
    for (uint32_t i = 0; i < walk.run_count; ++i) add(i, kept[i]);
  } else {
    WalkResult again;
    follow_segment(field, segment, again, add, NoVisit());
  }
  place_globals(field, walk, placement.globals);
  uint8_t inputs[kMaxInputs];
  gather_inputs(field, placement, inputs);
  const int32_t logit = evaluate_network(field.network, inputs);
  return {logit >= 0, false, logit};
}
inline Answer query(const SegmentField& field, const Segment& segment) { return query_as(field, segment); }

}  // namespace nif::kernels
