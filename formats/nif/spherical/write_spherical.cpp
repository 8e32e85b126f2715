// Writes `spherical` objects, their pairs of networks (MLPs), and primary fields. Memory always holds floats;
// they become halves in the file if asked for.
#include "formats/nif/asset.hpp"
#include "formats/nif/spherical/primary_section.hpp"
#include "formats/nif/spherical/spherical_part.hpp"
#include "kernels/reference/half.hpp"
#include "kernels/reference/spherical/spherical_query.hpp"

namespace nif::format {
namespace {

kernels::SphericalGrid grid_of(const std::vector<float>& values, uint32_t resolution, uint32_t features) {
  return {{values.data(), false}, resolution, features};
}

kernels::SphericalNetwork network_of(const SphericalLayers& layers, uint32_t outputs) {
  return {{layers.weights.data(), false}, layers.inputs, layers.width, layers.hidden_layers, outputs};
}

std::vector<float> to_floats(const kernels::SphericalValues& values, size_t count) {
  std::vector<float> floats(count);
  for (size_t i = 0; i < count; ++i) floats[i] = kernels::value_of(values, i);
  return floats;
}

/// For a grid over two angles.
std::vector<float> over_angles(const kernels::SphericalGrid& grid) {
  return to_floats(grid.values, size_t(grid.resolution) * grid.resolution * grid.features);
}

SphericalLayers to_layers(const kernels::SphericalNetwork& network) {
  return {network.inputs, network.width, network.hidden_layers,
          to_floats(network.weights, kernels::spherical_weights(network))};
}

SphericalGrids to_grids(const kernels::SphericalField& field) {
  SphericalGrids grids;
  grids.half = field.outer_position.values.half;
  grids.outer_resolution = field.outer_position.resolution;
  grids.outer_features = field.outer_position.features;
  grids.inner_resolution = field.inner_position.resolution;
  grids.inner_features = field.inner_position.features;
  grids.distance_resolution = field.distance.resolution;
  grids.distance_features = field.distance.features;
  grids.outer_position = over_angles(field.outer_position);
  grids.outer_direction = over_angles(field.outer_direction);
  grids.inner_position = over_angles(field.inner_position);
  grids.inner_direction = over_angles(field.inner_direction);
  grids.distance =
      to_floats(field.distance.values, size_t(field.distance.resolution) * field.distance.features);
  return grids;
}

SphericalShapeRecord shape_of(const SphericalLayers& layers) {
  return {layers.inputs, layers.width, layers.hidden_layers};
}

}  // namespace

void Section::append(const Values& values) {
  if (!values.half) return append(values.values);
  if (counting_) {
    size_ += values.values.size() * sizeof(uint16_t);
    return;
  }
  std::vector<uint16_t> halves;
  for (const float value : values.values) halves.push_back(kernels::to_half(value));
  append(halves);
}

kernels::SphericalField field_of(const SphericalGrids& grids, const SphericalNetworks& networks,
                                 const Bounds& bounds) {
  kernels::SphericalField field;
  kernels::set_bounds(bounds.min.data(), bounds.max.data(), field);
  field.outer_position = grid_of(grids.outer_position, grids.outer_resolution, grids.outer_features);
  field.outer_direction = grid_of(grids.outer_direction, grids.outer_resolution, grids.outer_features);
  field.inner_position = grid_of(grids.inner_position, grids.inner_resolution, grids.inner_features);
  field.inner_direction = grid_of(grids.inner_direction, grids.inner_resolution, grids.inner_features);
  field.distance = grid_of(grids.distance, grids.distance_resolution, grids.distance_features);
  field.outer = network_of(networks.outer, 1);
  field.inner = network_of(networks.inner, 1);
  field.slope = networks.slope;
  return field;
}

kernels::PrimaryField field_of(const Primary& primary, const Bounds& bounds) {
  kernels::PrimaryField field;
  kernels::set_bounds(bounds.min.data(), bounds.max.data(), field);
  field.position = grid_of(primary.position, primary.resolution, primary.features);
  field.direction = grid_of(primary.direction, primary.resolution, primary.features);
  field.network = network_of(primary.network, kernels::kPrimaryOutputs);
  field.slope = primary.slope;
  field.margin = primary.margin;
  return field;
}

SphericalNetworksRecord write_record(const SphericalNetworks& networks, Section& payloads) {
  SphericalNetworksRecord record{};
  record.half = networks.half;
  record.slope = networks.slope;
  record.outer = shape_of(networks.outer);
  record.inner = shape_of(networks.inner);
  record.weights = payloads.add_payload(Values{networks.outer.weights, networks.half},
                                        Values{networks.inner.weights, networks.half});
  return record;
}

SphericalRecord write_record(const SphericalData& data, const Object&, Section& payloads) {
  const SphericalGrids& grids = data.grids;
  SphericalRecord record{};
  record.network = data.network;
  record.outer_resolution = uint16_t(grids.outer_resolution);
  record.inner_resolution = uint16_t(grids.inner_resolution);
  record.distance_resolution = uint16_t(grids.distance_resolution);
  record.outer_features = uint8_t(grids.outer_features);
  record.inner_features = uint8_t(grids.inner_features);
  record.distance_features = uint8_t(grids.distance_features);
  record.half_grids = grids.half;
  const auto values = [&](const std::vector<float>& grid) { return Values{grid, grids.half}; };
  record.grids = payloads.add_payload(values(grids.outer_position), values(grids.outer_direction),
                                      values(grids.inner_position), values(grids.inner_direction),
                                      values(grids.distance));
  return record;
}

SphericalData to_data(const SphericalView& view) { return {view.network, to_grids(view.field)}; }

SphericalNetworks to_networks(const SphericalNetworksView& view) {
  return {view.outer.weights.half, view.slope, to_layers(view.outer), to_layers(view.inner)};
}

std::vector<PrimaryRecord> PrimaryRecords::write(const Object& object, uint32_t number, Section& payloads) {
  const Primary& primary = *object.primary;
  PrimaryRecord record{};
  record.object = number;
  record.resolution = uint16_t(primary.resolution);
  record.features = uint8_t(primary.features);
  record.half_grids = primary.half_grids;
  record.half_network = primary.half_network;
  record.slope = primary.slope;
  record.margin = primary.margin;
  record.network = shape_of(primary.network);
  record.values = payloads.add_payload(Values{primary.position, primary.half_grids},
                                       Values{primary.direction, primary.half_grids},
                                       Values{primary.network.weights, primary.half_network});
  return {record};
}

bool PrimaryRecords::has(const Object& object) { return object.primary.has_value(); }

Primary to_primary(const PrimaryView& view) {
  const kernels::PrimaryField& field = view.field;
  return {field.position.values.half,
          field.network.weights.half,
          field.slope,
          field.margin,
          field.position.resolution,
          field.position.features,
          over_angles(field.position),
          over_angles(field.direction),
          to_layers(field.network)};
}

}  // namespace nif::format
