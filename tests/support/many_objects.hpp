// A crafted asset: as many objects as fit into a file, as small as possible, which share networks as large as
// possible.
#pragma once

#include "tests/support/random_asset.hpp"

namespace nif::test {

/// A third of the objects has each encoding; every tenth has a field for primary rays; each is placed once.
inline format::Asset many_objects(uint32_t count) {
  Random random(1);
  format::Asset asset;
  asset.mlps.resize(1);
  const uint32_t inputs = kernels::input_count(4, 1);
  for (const auto& [in, out] : {std::pair{inputs, kernels::kMaxWidth},
                                {kernels::kMaxWidth, kernels::kMaxWidth},
                                {kernels::kMaxWidth, kernels::kMaxWidth},
                                {kernels::kMaxWidth, 1u}})
    asset.mlps[0].layers.push_back(
        {in, out, 0, std::vector<int32_t>(out), std::vector<int8_t>(size_t(in) * out, 1)});
  asset.spherical_networks.resize(1);
  format::SphericalNetworks& networks = asset.spherical_networks[0];
  networks.half = true;
  networks.outer = {2, kernels::kMaxSphericalWidth, kernels::kMaxSphericalLayers, {}};
  networks.inner = {3, kernels::kMaxSphericalWidth, kernels::kMaxSphericalLayers, {}};
  for (format::SphericalLayers* layers : {&networks.outer, &networks.inner})
    layers->weights.assign(kernels::spherical_weights(layers->inputs, layers->width, layers->hidden_layers),
                           1);

  format::PlanesData planes;
  planes.voxels = {1, 1, 1};
  planes.voxels_per_unit = 1;
  planes.brick_table = {kernels::kBrickInside};
  format::NetworkData network;
  network.features_per_corner = 1;
  network.samples = 4;
  format::SphericalData spherical;
  format::SphericalGrids& grids = spherical.grids;
  grids.half = true;
  grids.outer_resolution = grids.inner_resolution = grids.distance_resolution = 2;
  grids.outer_features = grids.inner_features = grids.distance_features = 1;
  for (auto* values :
       {&grids.outer_position, &grids.outer_direction, &grids.inner_position, &grids.inner_direction})
    values->assign(4, 0);
  grids.distance.assign(2, 0);
  const format::TrianglesData bvh = random_bvh(random, 1);
  format::Primary primary;
  primary.resolution = 2;
  primary.features = 1;
  primary.position.assign(4, 0);
  primary.direction.assign(4, 0);
  primary.network = {2, 4, 1,
                     std::vector<float>(kernels::spherical_weights(2, 4, 1, kernels::kPrimaryOutputs))};

  for (uint32_t i = 0; i < count; ++i) {
    format::Object& object = asset.objects.emplace_back();
    object.aabb_max = {1, 1, 1};
    if (i % 3 == 0) object.planes = planes, object.network = network;
    if (i % 3 == 1) object.spherical = spherical;
    if (i % 3 == 2) object.triangles = bvh;
    if (i % 10 == 0) object.primary = primary;
    format::Instance& instance = asset.instances.emplace_back();
    instance.object = i;
    instance.transform[3] = static_cast<float>(i);
  }
  return asset;
}

}  // namespace nif::test
