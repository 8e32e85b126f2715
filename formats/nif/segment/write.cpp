// Writes `segment` objects and the networks (MLPs) that they share. The order of sections matters:
// features stand before occupancy, so that a vector load at the last feature stays inside the file.
#include <algorithm>

#include "formats/base/status.hpp"
#include "formats/nif/segment/encoding.hpp"
#include "formats/nif/segment/write_coded.hpp"

namespace nif::format {

OutputRange output_range(const Network& network) {
  constexpr int64_t kMostActivation = 127;
  const Layer& last = network.layers.back();
  OutputRange range{last.biases.front(), last.biases.front()};
  for (const int8_t weight : last.weights)
    (weight < 0 ? range.least : range.largest) += weight * kMostActivation;
  return range;
}

void lean(Network& network, int32_t by) {
  network.threshold += by;
  network.layers.back().biases.front() -= by;
}

kernels::SegmentField field_of(const SegmentData& data, const Network& network) {
  kernels::SegmentField field;
  static_cast<kernels::ProofField&>(field) = proof_of(data);
  field.brick_corners = data.brick_corners.data();
  field.corner_base = data.corner_base.data();
  field.features = data.features.data();
  field.corners = data.corners;
  field.features_per_corner = data.features_per_corner;
  field.samples = data.samples;
  field.length_scale = data.length_scale * field.voxels_per_cell;
  field.network.layer_count = uint32_t(std::min<size_t>(network.layers.size(), kernels::kMaxLayers));
  field.network.calibration = network.calibration();
  for (uint32_t l = 0; l < field.network.layer_count; ++l) {
    const Layer& layer = network.layers[l];
    field.network.layers[l] = {layer.inputs, layer.outputs, layer.shift, layer.weights.data(),
                               layer.biases.data()};
  }
  return field;
}

namespace {

void add_network(const Network& network, Section& records, Section& weights) {
  NetworkRecord record{};
  if (network.layers.size() > std::size(record.layers))
    throw Error(Status::internal,
                "an asset's network has " + std::to_string(network.layers.size()) + " layers");
  record.layer_count = uint32_t(network.layers.size());
  record.logit_scale = network.logit_scale;
  record.threshold = network.threshold;
  record.weights = weights.begin_payload();
  for (size_t l = 0; l < network.layers.size(); ++l) {
    const Layer& layer = network.layers[l];
    record.layers[l] = {layer.inputs, layer.outputs, layer.shift};
    weights.append(layer.biases);
    weights.append(layer.weights);
  }
  weights.end_payload(record.weights);
  records.append(&record, 1);
}

}  // namespace

SegmentWriter::SegmentWriter(Sections& sections, const SegmentShared& shared)
    : records_(&sections.add(kSegments)) {
  Section& networks = sections.add(kNetworks);
  Section& weights = sections.add(kWeights);
  for (const Network& network : shared.networks) add_network(network, networks, weights);
  // Features before occupancy, so that a vector load at the last feature stays inside the file.
  features_ = &sections.add(kFeatures);
  occupancy_ = &sections.add(kOccupancy);
  cells_ = &sections.add(kCells);
}

void SegmentWriter::add(const SegmentData& data) {
  SegmentRecord record{};
  record.network = data.network;
  std::copy(data.origin.begin(), data.origin.end(), record.origin);
  record.voxels_per_unit = data.voxels_per_unit;
  std::copy(data.voxels.begin(), data.voxels.end(), record.voxels);
  record.mixed_bricks = uint32_t(data.brick_states.size());
  record.corners = data.corners;
  record.features_per_corner = data.features_per_corner;
  record.samples = data.samples;
  record.length_scale = data.length_scale;
  record.levels = data.levels;
  record.surface_voxels = uint32_t(data.voxel_records.size());
  record.part_count = uint32_t(data.parts.size());

  const CodedPayloads coded = encode_payloads(data);
  record.forms = coded.forms;
  record.occupancy = occupancy_->begin_payload();
  if (coded.forms & kCodedOccupancy) {
    occupancy_->append(coded.occupancy);
  } else {
    occupancy_->append(data.brick_states);
    occupancy_->append(data.brick_corners);
    occupancy_->append(data.corner_base);
    occupancy_->append(data.voxel_base);
    occupancy_->append(data.brick_table);
  }
  occupancy_->end_payload(record.occupancy);
  record.features = features_->begin_payload();
  if (coded.forms & kCodedFeatures)
    features_->append(coded.features);
  else
    features_->append(data.features);
  features_->end_payload(record.features);
  record.cells = cells_->begin_payload();
  if (coded.forms & kCodedCells) {
    cells_->append(coded.cells);
  } else {
    cells_->append(data.voxel_records);
    cells_->append(data.parts);
  }
  cells_->end_payload(record.cells);
  records_->append(&record, 1);
}

SegmentData EncodingOf<kernels::SegmentField>::to_data(const SegmentView& view) {
  const kernels::SegmentField& field = view.field;
  SegmentData data;
  static_cast<ProofData&>(data) = proof_data(field);
  data.network = view.network;
  data.brick_corners.assign(field.brick_corners, field.brick_corners + field.mixed_bricks);
  data.corner_base.assign(field.corner_base, field.corner_base + field.mixed_bricks);
  data.features.assign(field.features, field.features + size_t{field.corners} * field.features_per_corner);
  data.corners = field.corners;
  data.features_per_corner = field.features_per_corner;
  data.samples = field.samples;
  data.length_scale = field.length_scale / field.voxels_per_cell;
  data.coded = view.coded;
  return data;
}

SegmentShared EncodingOf<kernels::SegmentField>::to_shared(const SegmentSharedView& view) {
  SegmentShared shared;
  for (const NetworkView& from : view.networks) {
    Network& network = shared.networks.emplace_back();
    network.logit_scale = from.network.calibration.scale;
    network.threshold = from.network.calibration.threshold;
    for (uint32_t l = 0; l < from.network.layer_count; ++l) {
      const kernels::Network::Layer& layer = from.network.layers[l];
      network.layers.push_back({layer.inputs,
                                layer.outputs,
                                layer.shift,
                                {layer.biases, layer.biases + layer.outputs},
                                {layer.weights, layer.weights + size_t(layer.outputs) * layer.inputs}});
    }
  }
  return shared;
}

}  // namespace nif::format
