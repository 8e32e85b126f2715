// Why no accepted network can overflow evaluate_network's 32-bit sums: a layer has at most
// max(kMaxInputs, kMaxWidth) = 296 inputs, each product is at most 127 * 127 in size, |bias| <= 2^26, and the
// rounding term is at most 2^23. 296 * 127 * 127 + 2^26 + 2^23 < 2^27. The last sum, the logit, plus the
// threshold is within 2^27 + 2^27. Features: the eight corner weights of
// a point sum to 2^21, so a sum is at most 127 * 2^21 < 2^28. Indices: there are at most 65533 * 64 corners,
// so corner * features_per_corner < 2^25.
#include <algorithm>
#include <bit>
#include <optional>

#include "formats/nif/proof/read.hpp"
#include "formats/nif/segment/coded_features.hpp"
#include "formats/nif/segment/encoding.hpp"

namespace nif::format {
namespace {

using kernels::kMaxLayers;

static_assert(kernels::kMaxInputs * 127ll * 127 + kernels::kMaxBias + (1ll << kernels::kMaxShift) <
              1ll << 28);
static_assert(kMaxLayers == std::size(NetworkRecord{}.layers));

/// No byte is -128: weights and features are symmetric, -127..127.
bool symmetric(const int8_t* values, uint64_t count) {
  uint32_t found = 0;
  for (uint64_t i = 0; i < count; ++i) found |= uint32_t(values[i] == -128);
  return found == 0;
}

NetworkView read_network(const NetworkRecord& record, Payloads& payloads, const Place& place) {
  NetworkView view;
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

  const std::byte* at = payloads.next(record.weights, view.bytes, "weights", place).data();
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

/// Of the field, corners and features_per_corner are asked.
bool decode_features(Bytes coded, const kernels::SegmentField& field, std::byte* to) {
  RangeDecoder decoder(coded);
  auto* const features = reinterpret_cast<int8_t*>(to);
  code_features(decoder, uint64_t{field.corners} * field.features_per_corner, field.features_per_corner,
                features, features);
  return decoder.complete();
}

/// Checks the corners of `field`, whose occupancy is checked.
std::optional<Rule> fault_of_corners(const kernels::SegmentField& field) {
  uint32_t corners = 0;
  for (uint32_t i = 0; i < field.mixed_bricks; ++i) {
    if (field.corner_base[i] != corners) return Rule::corner_base;
    corners += uint32_t(std::popcount(field.brick_corners[i]));
  }
  if (corners != field.corners) return Rule::corners;
  return std::nullopt;
}

}  // namespace

SegmentReader::SegmentReader(const SectionTable& sections, std::string_view file, SegmentSharedView& shared)
    : file_(file),
      shared_(shared),
      records_(sections[kSegments], "SEGM", file),
      occupancy_(sections[kOccupancy]),
      features_(sections[kFeatures]),
      cells_(sections[kCells]) {
  const Records<NetworkRecord> networks(sections[kNetworks], "NETS", file);
  Payloads weights(sections[kWeights]);
  shared.networks.reserve(networks.count());
  for (uint32_t i = 0; i < networks.count(); ++i)
    shared.networks.push_back(read_network(networks[i], weights, Place{file, "NETS", i}));
  weights.finish("WGTS", file);
}

SegmentView SegmentReader::read(uint32_t index, const Bounds&) {
  const SegmentRecord record = records_[index];
  const Place place{file_, "SEGM", index};
  SegmentView view;
  place.require(record.network < shared_.networks.size(), Rule::network_range);
  view.network = record.network;
  kernels::SegmentField& field = view.field;
  place.require(std::isfinite(record.length_scale) && record.length_scale >= 0, Rule::length_scale);
  place.within(record.features_per_corner, 1, kernels::kMaxFeatures, "features_per_corner",
               Rule::features_range);
  place.within(record.samples, 1, kernels::kMaxSamples, "samples", Rule::samples_range);
  place.require(record.samples % 4 == 0, Rule::samples_multiple);
  field.features_per_corner = record.features_per_corner;
  field.samples = record.samples;
  field.network = shared_.networks[record.network].network;
  place.require(
      field.network.layers[0].inputs == kernels::input_count(record.samples, record.features_per_corner),
      Rule::other_inputs);
  place.require((record.forms & ~uint32_t{kPayloadForms}) == 0, Rule::unknown_forms);
  place.require(record.reserved == 0, Rule::reserved_not_zero);
  place.require((record.forms & kCodedOccupancy) != 0 || (record.forms & kStatedCorners) == 0,
                Rule::corners_not_coded);
  place.require((record.forms & kCodedCells) != 0 || (record.forms & kStatedKinds) == 0,
                Rule::kinds_not_coded);
  view.coded = record.forms & kCodedPayloads;
  read_grid_numbers(record, place, field);
  field.corners = record.corners;
  field.length_scale = record.length_scale * field.voxels_per_cell;

  // All payloads, before there is memory for what they decode to.
  const UncodedBytes uncoded(record);
  const auto next = [&](Payloads& payloads, const Payload& payload, PayloadForm form, uint64_t bytes,
                        const char* name) {
    return take_payload(payloads, payload, record.forms, form, bytes, name, place);
  };
  const Bytes occupancy = next(occupancy_, record.occupancy, kCodedOccupancy, uncoded.occupancy, "occupancy");
  const Bytes cells = next(cells_, record.cells, kCodedCells, uncoded.cells, "cells");
  const Bytes features = next(features_, record.features, kCodedFeatures, uncoded.features, "features");
  place.require((record.forms & kCodedPayloads) == 0 ||
                    uncoded.may_take(occupancy.size() + cells.size() + features.size()),
                Rule::decoded_size);

  const PayloadPlace at{record.forms, place, shared_.decoded};
  const Corners corners = (record.forms & kStatedCorners) != 0 ? Corners::stated : Corners::around;
  const auto arrays = read_occupancy(occupancy, corners, uncoded.occupancy, at, view.occupancy, field);
  field.brick_corners = arrays.brick_corners;
  field.corner_base = arrays.corner_base;
  if (const auto fault = fault_of_corners(field)) place.damaged(*fault);
  read_cells(cells, at, view.cells, field);
  field.features = reinterpret_cast<const int8_t*>(
      at.usable(features, kCodedFeatures, uncoded.features, "features", view.features,
                [&](std::byte* to) { return decode_features(features, field, to); }));
  place.require(symmetric(field.features, uncoded.features), Rule::feature_range);
  return view;
}

void SegmentReader::finish() const {
  occupancy_.finish("OCCU", file_);
  cells_.finish("CELL", file_);
  features_.finish("FEAT", file_);
}

void SegmentView::drop_bytes() {
  occupancy = cells = features = {};
  field.brick_table = nullptr;
  field.brick_states = nullptr;
  field.brick_corners = nullptr;
  field.corner_base = nullptr;
  field.voxel_base = nullptr;
  field.voxel_records = nullptr;
  field.parts = nullptr;
  field.features = nullptr;
  const kernels::Calibration calibration = field.network.calibration;
  field.network = {};
  field.network.calibration = calibration;
}

}  // namespace nif::format
