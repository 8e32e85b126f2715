// Writes features, and the networks (MLPs) that objects share. Corners take no bytes if they are those around
// surface voxels, because a reader finds them again.
#include <algorithm>
#include <bit>

#include "formats/base/status.hpp"
#include "formats/nif/asset.hpp"
#include "formats/nif/coded_payloads.hpp"
#include "formats/nif/network/coded_features.hpp"
#include "formats/nif/network/network_corners.hpp"
#include "formats/nif/planes/check_planes.hpp"

namespace nif::format {

OutputRange output_range(const Mlp& mlp) {
  constexpr int64_t kMostActivation = 127;
  const Layer& last = mlp.layers.back();
  OutputRange range{last.biases.front(), last.biases.front()};
  for (const int8_t weight : last.weights)
    (weight < 0 ? range.least : range.largest) += weight * kMostActivation;
  return range;
}

void move_threshold(Mlp& mlp, int32_t by) {
  mlp.threshold += by;
  mlp.layers.back().biases.front() -= by;
}

kernels::NetworkField field_of(const NetworkData& data, const Mlp& mlp, const kernels::PlanesField& planes) {
  kernels::NetworkField field;
  field.brick_corners = data.brick_corners.data();
  field.corner_base = data.corner_base.data();
  field.features = data.features.data();
  field.corners = data.corners;
  field.features_per_corner = data.features_per_corner;
  field.samples = data.samples;
  field.length_scale = data.length_scale * planes.voxels_per_cell;
  field.network.layer_count = uint32_t(std::min<size_t>(mlp.layers.size(), kernels::kMaxLayers));
  field.network.calibration = mlp.calibration();
  for (uint32_t l = 0; l < field.network.layer_count; ++l) {
    const Layer& layer = mlp.layers[l];
    field.network.layers[l] = {layer.inputs, layer.outputs, layer.shift, layer.weights.data(),
                               layer.biases.data()};
  }
  return field;
}

NetworkData to_data(const NetworkView& view, const kernels::PlanesField& planes) {
  const kernels::NetworkField& field = view.field;
  NetworkData data;
  data.mlp = view.mlp;
  data.brick_corners.assign(field.brick_corners, field.brick_corners + planes.mixed_bricks);
  data.corner_base.assign(field.corner_base, field.corner_base + planes.mixed_bricks);
  data.features.assign(field.features, field.features + size_t{field.corners} * field.features_per_corner);
  data.corners = field.corners;
  data.features_per_corner = field.features_per_corner;
  data.samples = field.samples;
  data.length_scale = view.length_scale;
  data.coded = view.coded;
  return data;
}

Mlp to_mlp(const MlpView& view) {
  Mlp mlp;
  mlp.logit_scale = view.network.calibration.scale;
  mlp.threshold = view.network.calibration.threshold;
  for (uint32_t l = 0; l < view.network.layer_count; ++l) {
    const kernels::Network::Layer& layer = view.network.layers[l];
    mlp.layers.push_back({layer.inputs,
                          layer.outputs,
                          layer.shift,
                          {layer.biases, layer.biases + layer.outputs},
                          {layer.weights, layer.weights + size_t(layer.outputs) * layer.inputs}});
  }
  return mlp;
}

namespace {

/// Whether a reader finds these corners by itself.
bool are_around(const PlanesData& planes, const NetworkData& data) {
  const size_t mixed = planes.brick_states.size();
  if (data.brick_corners.size() != mixed || data.corner_base.size() != mixed || !in_order(planes))
    return false;
  const kernels::PlanesField field = field_of(planes);
  bool same = true;
  uint32_t count = 0;
  for_each_brick(field, [&](uint16_t entry, const BrickAt& at) {
    if (entry < kernels::kFirstMixedBrick) return;
    const uint32_t i = entry - kernels::kFirstMixedBrick;
    same = same && data.brick_corners[i] == corners_around(field, at) && data.corner_base[i] == count;
    count += uint32_t(std::popcount(data.brick_corners[i]));
  });
  return same;
}

Coded encode_features(const NetworkData& data) {
  std::vector<int8_t> same(data.features.size());
  RangeEncoder encoder;
  code_features(encoder, same.size(), data.features_per_corner, data.features.data(), same.data());
  return if_smaller(encoder.finish(), same.size());
}

/// Codes what `data.coded` names if the reader accepts it and it becomes smaller. A file stores everything
/// else uncoded, so that data which a reader refuses is still refused.
struct CodedNetwork {
  uint32_t forms = 0;  ///< NetworkForm
  Coded features;

  CodedNetwork(const NetworkData& data, const PlanesData& planes) {
    if (data.coded == 0) return;
    const UncodedNetwork uncoded(data, uint32_t(planes.brick_states.size()));
    uint64_t bytes = uncoded.corners + uncoded.features;
    if ((data.coded & kCornersAround) && are_around(planes, data))
      forms |= kCornersAround, bytes -= uncoded.corners;
    if ((data.coded & kCodedFeatures) && data.features_per_corner >= 1 &&
        data.features_per_corner <= kernels::kMaxFeatures && data.features.size() == uncoded.features)
      features = encode_features(data);
    if (!features.empty()) forms |= kCodedFeatures, bytes -= uncoded.features - features.size();
    if (!uncoded.may_take(bytes)) forms = 0;
  }
};

}  // namespace

MlpRecord write_record(const Mlp& mlp, Section& payloads) {
  MlpRecord record{};
  if (mlp.layers.size() > std::size(record.layers))
    throw Error(Status::internal, "an asset's network has " + std::to_string(mlp.layers.size()) + " layers");
  record.layer_count = uint32_t(mlp.layers.size());
  record.logit_scale = mlp.logit_scale;
  record.threshold = mlp.threshold;
  const Layer none;
  const Layer* all[std::size(record.layers)] = {&none, &none, &none, &none};
  for (size_t l = 0; l < mlp.layers.size(); ++l) {
    const Layer& layer = *(all[l] = &mlp.layers[l]);
    record.layers[l] = {layer.inputs, layer.outputs, layer.shift};
  }
  const auto& [a, b, c, d] = all;
  record.weights = payloads.add_payload(a->biases, a->weights, b->biases, b->weights, c->biases, c->weights,
                                        d->biases, d->weights);
  return record;
}

NetworkRecord write_record(const NetworkData& data, const Object& object, Section& payloads) {
  const PlanesData none;
  const CodedNetwork coded(data, object.planes ? *object.planes : none);
  NetworkRecord record{};
  record.mlp = data.mlp;
  record.corners = data.corners;
  record.features_per_corner = data.features_per_corner;
  record.samples = data.samples;
  record.length_scale = data.length_scale;
  record.forms = coded.forms;
  record.brick_corners = coded.forms & kCornersAround
                             ? payloads.add_payload()
                             : payloads.add_payload(data.brick_corners, data.corner_base);
  record.features = coded.forms & kCodedFeatures ? payloads.add_payload(coded.features)
                                                 : payloads.add_payload(data.features);
  return record;
}

}  // namespace nif::format
