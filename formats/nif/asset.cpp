// Conversions between an asset that owns its memory, a file's views, and the kernels' view of an object.
#include "formats/nif/asset.hpp"

#include <algorithm>

#include "formats/nif/writer.hpp"
#include "kernels/reference/spherical/query.hpp"

namespace nif::format {

kernels::SegmentField field_of(const Object& object, const Network& network) {
  kernels::SegmentField field;
  for (size_t a = 0; a < 3; ++a) {
    field.origin[a] = object.origin[a];
    field.voxels[a] = object.voxels[a];
    field.bricks[a] = bricks_for(object.voxels[a]);
  }
  field.voxels_per_unit = object.voxels_per_unit;
  field.brick_table = object.brick_table.data();
  field.brick_states = object.brick_states.data();
  field.brick_corners = object.brick_corners.data();
  field.corner_base = object.corner_base.data();
  field.mixed_bricks = uint32_t(object.brick_states.size());
  field.features = object.features.data();
  field.corners = object.corners;
  field.features_per_corner = object.features_per_corner;
  field.samples = object.samples;
  field.length_scale = object.length_scale;
  field.network.layer_count = uint32_t(std::min<size_t>(network.layers.size(), kernels::kMaxLayers));
  field.network.logit_scale = network.logit_scale;
  for (uint32_t l = 0; l < field.network.layer_count; ++l) {
    const Layer& layer = network.layers[l];
    field.network.layers[l] = {layer.inputs, layer.outputs, layer.shift, layer.weights.data(),
                               layer.biases.data()};
  }
  return field;
}

kernels::BvhField field_of(const Bvh& bvh) {
  kernels::BvhField field;
  field.nodes = bvh.nodes.data();
  field.vertices = reinterpret_cast<const float(*)[3]>(bvh.vertices.data());
  field.triangles = reinterpret_cast<const uint8_t(*)[3]>(bvh.triangles.data());
  field.node_count = uint32_t(bvh.nodes.size());
  field.vertex_count = uint32_t(bvh.vertices.size());
  field.triangle_count = uint32_t(bvh.triangles.size());
  if (!bvh.nodes.empty()) field.extent = kernels::bvh_extent(bvh.nodes.front());
  return field;
}

namespace {

kernels::SphericalGrid grid_of(const std::vector<float>& values, uint32_t resolution, uint32_t features) {
  return {{values.data(), false}, resolution, features};
}

kernels::SphericalNetwork network_of(const SphericalLayers& layers, uint32_t outputs) {
  return {{layers.weights.data(), false}, layers.inputs, layers.width, layers.hidden_layers, outputs};
}

}  // namespace

kernels::SphericalField spherical_field_of(const Object& object, const SphericalNetworks& networks) {
  kernels::SphericalField field;
  kernels::set_bounds(object.aabb_min.data(), object.aabb_max.data(), field);
  const SphericalGrids& grids = object.grids;
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

kernels::PrimaryField primary_field_of(const Object& object) {
  kernels::PrimaryField field;
  kernels::set_bounds(object.aabb_min.data(), object.aabb_max.data(), field);
  const Primary& primary = *object.primary;
  field.position = grid_of(primary.position, primary.resolution, primary.features);
  field.direction = grid_of(primary.direction, primary.resolution, primary.features);
  field.network = network_of(primary.network, kernels::kPrimaryOutputs);
  field.slope = primary.slope;
  field.margin = primary.margin;
  return field;
}

namespace {

Bvh to_bvh(const kernels::BvhField& field) {
  Bvh bvh;
  bvh.nodes.assign(field.nodes, field.nodes + field.node_count);
  for (uint32_t v = 0; v < field.vertex_count; ++v) bvh.vertices.push_back(std::to_array(field.vertices[v]));
  for (uint32_t t = 0; t < field.triangle_count; ++t)
    bvh.triangles.push_back(std::to_array(field.triangles[t]));
  return bvh;
}

std::vector<float> to_floats(const kernels::SphericalValues& values, size_t count) {
  std::vector<float> floats(count);
  for (size_t i = 0; i < count; ++i) floats[i] = kernels::value_of(values, i);
  return floats;
}

/// Of a grid over two angles.
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

Primary to_primary(const kernels::PrimaryField& field) {
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

}  // namespace

Asset to_asset(const AssetView& view) {
  Asset asset;
  asset.metadata = view.metadata;
  for (const NetworkView& from : view.networks) {
    Network& network = asset.networks.emplace_back();
    network.logit_scale = from.network.logit_scale;
    for (uint32_t l = 0; l < from.network.layer_count; ++l) {
      const kernels::Network::Layer& layer = from.network.layers[l];
      network.layers.push_back({layer.inputs,
                                layer.outputs,
                                layer.shift,
                                {layer.biases, layer.biases + layer.outputs},
                                {layer.weights, layer.weights + size_t(layer.outputs) * layer.inputs}});
    }
  }
  for (const SphericalNetworksView& from : view.spherical_networks)
    asset.spherical_networks.push_back(
        {from.outer.weights.half, from.slope, to_layers(from.outer), to_layers(from.inner)});
  for (const ObjectView& from : view.objects) {
    const kernels::SegmentField& field = from.field;
    Object& object = asset.objects.emplace_back();
    object.encoding = from.encoding;
    object.name = from.name;
    object.network = from.network;
    object.aabb_min = from.aabb_min;
    object.aabb_max = from.aabb_max;
    object.bias = from.bias;
    object.triangles = from.triangles;
    if (from.encoding == kBvh) {
      object.bvh = to_bvh(from.bvh);
      continue;
    }
    if (from.encoding == kSpherical) {
      object.grids = to_grids(*from.spherical);
      continue;
    }
    std::copy_n(field.origin, 3, object.origin.begin());
    object.voxels_per_unit = field.voxels_per_unit;
    std::copy_n(field.voxels, 3, object.voxels.begin());
    const size_t mixed = field.mixed_bricks;
    const size_t bricks = size_t(field.bricks[0]) * field.bricks[1] * field.bricks[2];
    object.brick_table.assign(field.brick_table, field.brick_table + bricks);
    object.brick_states.assign(field.brick_states, field.brick_states + mixed);
    object.brick_corners.assign(field.brick_corners, field.brick_corners + mixed);
    object.corner_base.assign(field.corner_base, field.corner_base + mixed);
    object.features.assign(field.features, field.features + from.feature_bytes);
    object.corners = field.corners;
    object.features_per_corner = field.features_per_corner;
    object.samples = field.samples;
    object.length_scale = field.length_scale;
  }
  for (const PrimaryView& from : view.primaries) asset.objects[from.object].primary = to_primary(from.field);
  for (const InstanceView& from : view.instances)
    asset.instances.push_back({std::string(from.name), from.object, from.transform});
  return asset;
}

}  // namespace nif::format
