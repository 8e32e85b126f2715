// Reads `spherical` objects, the pairs of networks (MLPs) that they share, and primary fields. NaN and too
// large values are refused here, in every grid and network, so kernels need no checks.
#include "formats/nif/reader.hpp"
#include "kernels/reference/half.hpp"

namespace nif::format {
namespace {

/// Whether no value is NaN or larger than kernels::kMaxSphericalValue.
bool bounded(const kernels::SphericalValues& values, uint64_t count) {
  constexpr float kMost = kernels::kMaxSphericalValue;
  constexpr uint16_t kMostAsHalf = kernels::to_half(kMost);
  static_assert(kernels::from_half(kMostAsHalf) == kMost);
  uint32_t found = 0;
  if (values.half) {
    const auto* halves = static_cast<const uint16_t*>(values.data);
    for (uint64_t i = 0; i < count; ++i) found |= uint32_t((halves[i] & 0x7fff) > kMostAsHalf);
  } else {
    const auto* floats = static_cast<const float*>(values.data);
    for (uint64_t i = 0; i < count; ++i)
      found |= uint32_t(!(floats[i] <= kMost)) | uint32_t(!(floats[i] >= -kMost));
  }
  return found == 0;
}

uint64_t size_of(const kernels::SphericalValues& values) {
  return values.half ? sizeof(uint16_t) : sizeof(float);
}

/// A network as its record describes it; its weights must still be taken from a payload.
kernels::SphericalNetwork network_of(const SphericalShapeRecord& shape, uint32_t outputs, bool half,
                                     const Place& place) {
  place.within(shape.inputs, 1, kernels::kMaxSphericalInputs, "inputs", Rule::inputs_range);
  place.within(shape.width, 4, kernels::kMaxSphericalWidth, "width", Rule::width_range);
  place.require(shape.width % 4 == 0, Rule::width_multiple);
  place.within(shape.hidden_layers, 1, kernels::kMaxSphericalLayers, "hidden_layers",
               Rule::hidden_layers_range);
  return {{nullptr, half}, shape.inputs, shape.width, shape.hidden_layers, outputs};
}

/// A grid as its record describes it; its values must still be taken from a payload.
kernels::SphericalGrid grid_of(uint32_t resolution, uint32_t features, bool half, const Place& place) {
  place.within(resolution, 2, kernels::kMaxSphericalResolution, "a grid's resolution",
               Rule::resolution_range);
  place.within(features, 1, kernels::kMaxSphericalFeatures, "a grid's number of features",
               Rule::latent_floats_range);
  return {{nullptr, half}, resolution, features};
}
uint64_t values_over_angles(const kernels::SphericalGrid& grid) {
  return uint64_t{grid.resolution} * grid.resolution * grid.features;
}
uint64_t values_over_distance(const kernels::SphericalGrid& grid) {
  return uint64_t{grid.resolution} * grid.features;
}

/// Consecutive values in a payload, all of one precision.
struct Run {
  kernels::SphericalValues& values;
  uint64_t count;
  Rule rule;  ///< broken if a value is out of range
};

uint64_t bytes_of(std::span<const Run> runs) {
  uint64_t bytes = 0;
  for (const Run& run : runs) bytes += run.count * size_of(run.values);
  return bytes;
}

/// Points each run to its values in the payload, which they fill together, in order.
void take(std::span<const Run> runs, Bytes payload, const Place& place) {
  const std::byte* at = payload.data();
  for (const Run& run : runs) {
    run.values.data = at;
    at += run.count * size_of(run.values);
    place.require(bounded(run.values, run.count), run.rule);
  }
}

void check_slope(float slope, const Place& place) {
  place.require(slope >= 0 && slope <= 1, Rule::slope_range);
}

}  // namespace

SphericalNetworksView read_record(const SphericalNetworksRecord& record, const Reading& reading) {
  const Place& place = reading.place;
  SphericalNetworksView view;
  place.within(record.half, 0, 1, "half", Rule::half_range);
  check_slope(record.slope, place);
  place.require(all_zero(record.reserved), Rule::reserved_not_zero);
  view.slope = record.slope;
  view.outer = network_of(record.outer, 1, record.half, place);
  view.inner = network_of(record.inner, 1, record.half, place);
  const Run runs[] = {{view.outer.weights, spherical_weights(view.outer), Rule::weight_value},
                      {view.inner.weights, spherical_weights(view.inner), Rule::weight_value}};
  view.bytes = bytes_of(runs);
  take(runs, reading.payloads.next(record.weights, view.bytes, "weights", place), place);
  return view;
}

SphericalView read_record(const SphericalRecord& record, const ObjectView& object, const Reading& reading) {
  const auto& [place, payloads, asset] = reading;
  SphericalView view;
  kernels::SphericalField& field = view.field;
  place.require(record.network < asset.spherical_networks.size(), Rule::network_range);
  place.require(record.reserved == 0, Rule::reserved_not_zero);
  place.require(kernels::set_bounds(object.aabb_min.data(), object.aabb_max.data(), field),
                Rule::bounds_to_compute);
  const SphericalNetworksView& networks = asset.spherical_networks[record.network];
  view.network = record.network;
  field.outer = networks.outer;
  field.inner = networks.inner;
  field.slope = networks.slope;
  place.within(record.half_grids, 0, 1, "half_grids", Rule::half_range);
  const bool half = record.half_grids;
  field.outer_position = field.outer_direction =
      grid_of(record.outer_resolution, record.outer_features, half, place);
  field.inner_position = field.inner_direction =
      grid_of(record.inner_resolution, record.inner_features, half, place);
  field.distance = grid_of(record.distance_resolution, record.distance_features, half, place);
  place.require(field.outer.inputs == 2 * field.outer_position.features &&
                    field.inner.inputs == 2 * field.inner_position.features + field.distance.features,
                Rule::other_inputs);
  const uint64_t outer = values_over_angles(field.outer_position),
                 inner = values_over_angles(field.inner_position);
  const Run runs[] = {{field.outer_position.values, outer, Rule::latent_value},
                      {field.outer_direction.values, outer, Rule::latent_value},
                      {field.inner_position.values, inner, Rule::latent_value},
                      {field.inner_direction.values, inner, Rule::latent_value},
                      {field.distance.values, values_over_distance(field.distance), Rule::latent_value}};
  view.grid_bytes = bytes_of(runs);
  take(runs, payloads.next(record.grids, view.grid_bytes, "grids", place), place);
  return view;
}

std::optional<PrimaryView> read_record(const PrimaryRecord& record, const ObjectView& object,
                                       const Reading& reading) {
  const Place& place = reading.place;
  PrimaryView view;
  kernels::PrimaryField& field = view.field;
  view.object = record.object;
  place.require(kernels::set_bounds(object.aabb_min.data(), object.aabb_max.data(), field),
                Rule::bounds_to_compute);
  place.within(record.half_grids, 0, 1, "half_grids", Rule::half_range);
  place.within(record.half_network, 0, 1, "half_network", Rule::half_range);
  check_slope(record.slope, place);
  place.require(record.margin >= 0 && record.margin <= 1, Rule::margin_range);
  place.require(all_zero(record.reserved), Rule::reserved_not_zero);
  field.slope = record.slope;
  field.margin = record.margin;
  field.position = field.direction = grid_of(record.resolution, record.features, record.half_grids, place);
  field.network = network_of(record.network, kernels::kPrimaryOutputs, record.half_network, place);
  place.require(field.network.inputs == 2 * field.position.features, Rule::other_inputs);
  const uint64_t latents = values_over_angles(field.position);
  const Run runs[] = {{field.position.values, latents, Rule::latent_value},
                      {field.direction.values, latents, Rule::latent_value},
                      {field.network.weights, spherical_weights(field.network), Rule::weight_value}};
  view.grid_bytes = bytes_of(std::span(runs).first(2));
  view.network_bytes = bytes_of(std::span(runs).subspan(2));
  take(runs, reading.payloads.next(record.values, view.grid_bytes + view.network_bytes, "primary", place),
       place);
  return view;
}

}  // namespace nif::format
