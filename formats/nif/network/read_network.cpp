// Reads and checks networks and features.
//
// No accepted network can overflow the 32-bit sums of evaluate_network: a layer has at most max(kMaxInputs,
// kMaxWidth) = 296 inputs, each product is at most 127 * 127 in size, |bias| <= 2^26, and the rounding term
// is at most 2^23. 296 * 127 * 127 + 2^26 + 2^23 < 2^27. The last sum, the logit, plus the threshold is
// within 2^27 + 2^27. Features: the eight corner weights of a point sum to 2^21, so a sum is at most 127 *
// 2^21 < 2^28. Indices: there are at most 65533 * 64 corners, so corner * features_per_corner < 2^25.
#include <algorithm>
#include <bit>
#include <cmath>

#include "formats/nif/coded_payloads.hpp"
#include "formats/nif/network/coded_features.hpp"
#include "formats/nif/network/network_corners.hpp"
#include "formats/nif/network/network_part.hpp"
#include "formats/nif/reader.hpp"

namespace nif::format {
namespace {

using kernels::kMaxLayers;

static_assert(kernels::kMaxInputs * 127ll * 127 + kernels::kMaxBias + (1ll << kernels::kMaxShift) <
              1ll << 28);
static_assert(kMaxLayers == std::size(MlpRecord{}.layers));

/// No byte is -128: weights and features are symmetric, -127..127.
bool symmetric(const int8_t* values, uint64_t count) {
  uint32_t found = 0;
  for (uint64_t i = 0; i < count; ++i) found |= uint32_t(values[i] == -128);
  return found == 0;
}

/// Reads only corners and features_per_corner of the field.
bool decode_features(Bytes coded, const kernels::NetworkField& field, std::byte* to) {
  RangeDecoder decoder(coded);
  auto* const features = reinterpret_cast<int8_t*>(to);
  code_features(decoder, uint64_t{field.corners} * field.features_per_corner, field.features_per_corner,
                features, features);
  return decoder.complete();
}

/// Fills the arrays of a corners payload: the corners around surface voxels.
void fill_corners(const kernels::PlanesField& planes, std::byte* to) {
  auto* const corners = reinterpret_cast<uint64_t*>(to);
  auto* const base = reinterpret_cast<uint32_t*>(corners + planes.mixed_bricks);
  uint32_t count = 0;
  for_each_brick(planes, [&](uint16_t entry, const BrickAt& at) {
    if (entry < kernels::kFirstMixedBrick) return;
    const uint32_t i = entry - kernels::kFirstMixedBrick;
    corners[i] = corners_around(planes, at);
    base[i] = count;
    count += uint32_t(std::popcount(corners[i]));
  });
}

void check_corners(const kernels::NetworkField& field, uint32_t mixed_bricks, const Place& place) {
  uint32_t corners = 0;
  for (uint32_t i = 0; i < mixed_bricks; ++i) {
    place.require(field.corner_base[i] == corners, Rule::corner_base);
    corners += uint32_t(std::popcount(field.brick_corners[i]));
  }
  place.require(corners == field.corners, Rule::corners);
}

}  // namespace

MlpView read_record(const MlpRecord& record, const Reading& reading) {
  const Place& place = reading.place;
  MlpView view;
  kernels::Network& network = view.network;
  place.require(record.reserved == 0, Rule::reserved_not_zero);
  place.within(record.layer_count, 1, kMaxLayers, "layer_count", Rule::layer_count);
  place.require(std::isfinite(record.logit_scale) && record.logit_scale > 0, Rule::logit_scale);
  place.require(record.threshold >= -kernels::kMaxThreshold && record.threshold <= kernels::kMaxThreshold,
                Rule::threshold_range);
  network.layer_count = record.layer_count;
  network.calibration = {record.logit_scale, record.threshold};
  for (uint32_t l = 0; l < kMaxLayers; ++l) {
    const LayerRecord& layer = record.layers[l];
    if (l >= record.layer_count) {
      place.require(layer.inputs == 0 && layer.outputs == 0 && layer.shift == 0, Rule::unused_layer);
      continue;
    }
    if (l == 0)
      place.within(layer.inputs, 4, kernels::kMaxInputs, "inputs of the first layer", Rule::first_inputs);
    else
      place.require(layer.inputs == record.layers[l - 1].outputs, Rule::layers_join);
    place.require(layer.inputs % 4 == 0, Rule::inputs_multiple);
    if (l + 1 == record.layer_count)
      place.require(layer.outputs == 1, Rule::last_outputs);
    else
      place.within(layer.outputs, 4, kernels::kMaxWidth, "outputs of a hidden layer", Rule::outputs_range);
    place.within(layer.shift, 0, kernels::kMaxShift, "shift", Rule::shift_range);
    view.bytes += layer.outputs * (sizeof(int32_t) + layer.inputs);
    network.layers[l] = {layer.inputs, layer.outputs, layer.shift, nullptr, nullptr};
  }

  const std::byte* at = reading.payloads.next(record.weights, view.bytes, "weights", place).data();
  for (uint32_t l = 0; l < record.layer_count; ++l) {
    kernels::Network::Layer& layer = network.layers[l];
    layer.biases = reinterpret_cast<const int32_t*>(at);
    at += layer.outputs * sizeof(int32_t);
    layer.weights = reinterpret_cast<const int8_t*>(at);
    at += size_t(layer.outputs) * layer.inputs;
    place.require(std::all_of(layer.biases, layer.biases + layer.outputs,
                              [](int32_t b) { return b >= -kernels::kMaxBias && b <= kernels::kMaxBias; }),
                  Rule::bias_value);
    place.require(symmetric(layer.weights, uint64_t(layer.outputs) * layer.inputs), Rule::weight_range);
  }
  return view;
}

NetworkView read_record(const NetworkRecord& record, const ObjectView& object, const Reading& reading) {
  const auto& [place, payloads, asset] = reading;
  const kernels::PlanesField& planes = object.planes->field;  // every encoding with a network has them
  NetworkView view;
  kernels::NetworkField& field = view.field;
  place.require(record.mlp < asset.mlps.size(), Rule::network_range);
  view.mlp = record.mlp;
  place.require(std::isfinite(record.length_scale) && record.length_scale >= 0, Rule::length_scale);
  place.within(record.features_per_corner, 1, kernels::kMaxFeatures, "features_per_corner",
               Rule::features_range);
  place.within(record.samples, 1, kernels::kMaxSamples, "samples", Rule::samples_range);
  place.require(record.samples % 4 == 0, Rule::samples_multiple);
  field.features_per_corner = record.features_per_corner;
  field.samples = record.samples;
  field.network = asset.mlps[record.mlp].network;
  place.require(
      field.network.layers[0].inputs == kernels::input_count(record.samples, record.features_per_corner),
      Rule::other_inputs);
  place.require((record.forms & ~uint32_t{kNetworkForms}) == 0, Rule::unknown_forms);
  place.require(all_zero(record.reserved), Rule::reserved_not_zero);
  view.coded = record.forms;
  view.length_scale = record.length_scale;
  field.corners = record.corners;
  field.length_scale = record.length_scale * planes.voxels_per_cell;

  // Take both payloads before allocating memory for what they decode to.
  const bool around = (record.forms & kCornersAround) != 0, coded = (record.forms & kCodedFeatures) != 0;
  const UncodedNetwork uncoded(record, planes.mixed_bricks);
  const Bytes corners = payloads.next(record.brick_corners, around ? 0 : uncoded.corners, "corners", place);
  const Bytes features = take_payload(payloads, record.features, coded, uncoded.features, "features", place);
  place.require(record.forms == 0 || uncoded.may_take(corners.size() + features.size()), Rule::decoded_size);

  field.brick_corners = reinterpret_cast<const uint64_t*>(usable(
      corners, around, uncoded.corners, "corners", place, asset.decoded, view.features, [&](std::byte* to) {
        fill_corners(planes, to);
        return true;
      }));
  field.corner_base = reinterpret_cast<const uint32_t*>(field.brick_corners + planes.mixed_bricks);
  check_corners(field, planes.mixed_bricks, place);
  field.features = reinterpret_cast<const int8_t*>(
      usable(features, coded, uncoded.features, "features", place, asset.decoded, view.features,
             [&](std::byte* to) { return decode_features(features, field, to); }));
  place.require(symmetric(field.features, uncoded.features), Rule::feature_range);
  return view;
}

void NetworkView::drop_bytes() {
  features = {};
  field.brick_corners = nullptr;
  field.corner_base = nullptr;
  field.features = nullptr;
  const kernels::Calibration calibration = field.network.calibration;
  field.network = {};
  field.network.calibration = calibration;
}

}  // namespace nif::format
