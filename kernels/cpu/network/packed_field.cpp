// Packs a `segment` field. Afterwards, pointers into the asset become null, so that the asset's arrays can be
// freed. The exception are fields whose corners do not all fit the packed layout: they keep reading the
// asset.
#include "kernels/cpu/network/packed_field.hpp"

#include <algorithm>
#include <cstring>

namespace nif::kernels::cpu {
namespace {

/// Points a network to a copy of its biases and weights.
void use_copy(Network& network, SharedCopies& copies) {
  size_t words = 0;  // weights fill them, because a layer's inputs are a multiple of 4
  for (uint32_t l = 0; l < network.layer_count; ++l)
    words += network.layers[l].outputs * (1 + network.layers[l].inputs / 4);
  const uint32_t* at = copies.get(Shared::network, network.layers[0].biases, words, [&](uint32_t* to) {
    for (uint32_t l = 0; l < network.layer_count; ++l) {
      const Network::Layer& layer = network.layers[l];
      const size_t weights = size_t(layer.outputs) * layer.inputs;
      std::memcpy(to, layer.biases, layer.outputs * sizeof(int32_t));
      std::memcpy(to + layer.outputs, layer.weights, weights);
      to += layer.outputs + weights / 4;
    }
  });
  for (uint32_t l = 0; l < network.layer_count; ++l) {
    Network::Layer& layer = network.layers[l];
    layer.biases = reinterpret_cast<const int32_t*>(at);
    layer.weights = reinterpret_cast<const int8_t*>(at + layer.outputs);
    at += layer.outputs * (1 + layer.inputs / 4);
  }
}

}  // namespace

PackedField::PackedField(const SegmentField& field, const KernelOptions& options)
    : SegmentField(field),
      corners_by_brick(field, options.memory),
      grid(field, options.memory, options.most_without_bricks),
      reads_field(!corners_by_brick.complete) {
  use_copy(network, options.copies);
  children = grid.children.data();
  voxel_base = nullptr;
  voxel_records = nullptr;
  if (reads_field) return;
  brick_table = nullptr;
  brick_states = nullptr;
  brick_corners = nullptr;
  corner_base = nullptr;
  features = nullptr;
}

uint16_t corner_pair(const PackedField& field, uint32_t x, uint32_t y, uint32_t z) {
  if (!field.reads_field) return field.corners_by_brick.pair_at(x, y, z);
  uint16_t pair = 0;
  const uint32_t corner = corner_index(field, x, y, z);
  if (corner != kNoCorner) std::memcpy(&pair, field.features + 2 * size_t(corner), sizeof(pair));
  return pair;
}

uint32_t voxel_word(const PackedField& field, const int32_t voxel[3]) {
  return field.grid.word_at({voxel[0], voxel[1], voxel[2]});
}

void interpolate_features(const PackedField& field, const SamplePoint& point, uint8_t* inputs) {
  if (field.reads_field) {
    interpolate_features(static_cast<const SegmentField&>(field), point, inputs);
    return;
  }
  int32_t sums[2] = {};
  for (int c = 0; c < 8; ++c) {
    const uint16_t pair = field.corners_by_brick.pair_at(
        point.voxel[0] + (c & 1), point.voxel[1] + ((c >> 1) & 1), point.voxel[2] + (c >> 2));
    int8_t two[2];
    std::memcpy(two, &pair, sizeof(two));
    const int32_t weight = corner_weight(point.fraction, c);
    for (int f = 0; f < 2; ++f) sums[f] += weight * two[f];
  }
  for (int f = 0; f < 2; ++f) inputs[f] = feature_input(sums[f]);
}

}  // namespace nif::kernels::cpu
