// A small valid asset from a seed, made without the baker: random voxels, features and networks, several
// objects and instances, some of them of triangles. For tests of the format, the runtime and the fuzzers'
// seeds.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <limits>
#include <string>

#include "formats/nif/asset.hpp"
#include "kernels/reference/segment/query.hpp"
#include "tests/support/random_bvh.hpp"
#include "tests/support/random_spherical.hpp"

namespace nif::test {

struct RandomAssetOptions {
  uint32_t objects = 3;
  uint32_t instances = 4;
  uint32_t max_voxels = 14;  ///< along an axis
  uint32_t bvhs = 0;         ///< objects of the `bvh` encoding, after the others
  uint32_t sphericals =
      0;                   ///< objects of the `spherical` encoding, after those; the first two share networks
  uint32_t primaries = 0;  ///< objects with a field for primary rays, the first so many of all
  uint32_t features = 0;   ///< of each corner; 0: any number
  bool odd_corners = false;  ///< as no baker would: some at the surface have no features, some beside it have
};

inline format::Network random_network(Random& random, uint32_t inputs) {
  format::Network network;
  network.logit_scale = random.between(1e-4f, 1e-2f);
  const uint32_t hidden = random.below(3);
  for (uint32_t l = 0; l <= hidden; ++l) {
    format::Layer layer;
    layer.inputs = inputs;
    layer.outputs = l == hidden ? 1 : 4 * (1 + random.below(4));
    layer.shift = l == hidden ? 0 : 5 + random.below(4);
    for (uint32_t i = 0; i < layer.outputs; ++i) layer.biases.push_back(random.between(-3000, 3000));
    for (uint32_t i = 0; i < layer.outputs * layer.inputs; ++i)
      layer.weights.push_back(int8_t(random.between(-127, 127)));
    inputs = layer.outputs;
    network.layers.push_back(std::move(layer));
  }
  return network;
}

/// Solid balls in a box: voxels inside, outside and between, some of them unknown.
inline void fill_occupancy(Random& random, const RandomAssetOptions& options, format::SegmentData& object) {
  using kernels::VoxelState;
  const uint32_t nx = object.voxels[0], ny = object.voxels[1], nz = object.voxels[2];
  float centre[3];
  for (size_t a = 0; a < 3; ++a) centre[a] = random.unit() * static_cast<float>(object.voxels[a]);
  const float radius = random.between(0.2f, 0.6f) * static_cast<float>(std::max({nx, ny, nz}));
  const auto state = [&](uint32_t x, uint32_t y, uint32_t z) {
    const float dx = static_cast<float>(x) - centre[0], dy = static_cast<float>(y) - centre[1],
                dz = static_cast<float>(z) - centre[2];
    const float distance = dx * dx + dy * dy + dz * dz, r2 = radius * radius;
    if (distance > r2 * 1.5f)
      return (x * 7 + y * 3 + z) % 31 == 0 ? VoxelState::unknown : VoxelState::outside;
    return distance < r2 * 0.5f ? VoxelState::inside : VoxelState::surface;
  };
  const auto is_surface = [&](uint32_t x, uint32_t y, uint32_t z) {
    return x < nx && y < ny && z < nz && state(x, y, z) == VoxelState::surface;
  };
  const uint32_t bricks[3] = {format::bricks_for(nx), format::bricks_for(ny), format::bricks_for(nz)};
  for (uint32_t b = 0; b < bricks[0] * bricks[1] * bricks[2]; ++b) {
    const uint32_t low[3] = {b % bricks[0] * 4, b / bricks[0] % bricks[1] * 4, b / bricks[0] / bricks[1] * 4};
    kernels::BrickStates states{};
    uint64_t corners = 0;
    uint32_t seen = 0;  // a bit for each state
    for (uint32_t bit = 0; bit < 64; ++bit) {
      const uint32_t x = low[0] + (bit & 3), y = low[1] + (bit >> 2 & 3), z = low[2] + (bit >> 4);
      for (uint32_t c = 0; c < 8; ++c)
        if (is_surface(x - (c & 1), y - (c >> 1 & 1), z - (c >> 2))) corners |= uint64_t{1} << bit;
      if (x >= nx || y >= ny || z >= nz) continue;
      const VoxelState s = state(x, y, z);
      seen |= 1u << uint32_t(s);
      if (s == VoxelState::surface || s == VoxelState::unknown) states.surface |= uint64_t{1} << bit;
      if (s == VoxelState::inside || s == VoxelState::unknown) states.aux |= uint64_t{1} << bit;
    }
    if (corners == 0 && std::popcount(seen) <= 1) {
      object.brick_table.push_back(uint16_t(seen == 0 ? 0 : std::countr_zero(seen)));
      continue;
    }
    if (options.odd_corners)
      for (uint32_t n = random.below(8); n > 0; --n) corners ^= uint64_t{1} << random.below(64);
    object.brick_table.push_back(uint16_t(kernels::kFirstMixedBrick + object.brick_states.size()));
    object.brick_states.push_back(states);
    object.brick_corners.push_back(corners);
    object.corner_base.push_back(object.corners);
    object.corners += uint32_t(std::popcount(corners));
  }
}

inline format::Object random_bvh_object(Random& random, const std::string& name) {
  format::Object object;
  object.name = name;
  format::Bvh bvh =
      random_bvh(random, 1 + random.below(60), random.between(-2.0f, 2.0f), random.between(0.5f, 3.0f));
  object.aabb_min = object.aabb_max = bvh.vertices[0];
  for (const auto& p : bvh.vertices)
    for (size_t a = 0; a < 3; ++a) {
      object.aabb_min[a] = std::min(object.aabb_min[a], p[a]);
      object.aabb_max[a] = std::max(object.aabb_max[a], p[a]);
    }
  object.bias = 1e-3f * (object.aabb_max[0] - object.aabb_min[0]);
  object.triangles = uint32_t(bvh.triangles.size());
  object.content = std::move(bvh);
  return object;
}

inline format::Asset random_asset(uint64_t seed, const RandomAssetOptions& options = {}) {
  Random random(seed);
  format::Asset asset;
  for (uint32_t i = 0; i < options.objects; ++i) {
    format::Object object;
    object.name = "object " + std::to_string(i) + (i % 2 ? " \u00e9" : "");
    format::SegmentData segment;
    for (size_t a = 0; a < 3; ++a) segment.voxels[a] = 1 + random.below(options.max_voxels);
    segment.voxels_per_unit = random.between(0.5f, 20.0f);
    for (size_t a = 0; a < 3; ++a) {
      segment.origin[a] = random.between(-5.0f, 5.0f);
      object.aabb_min[a] = segment.origin[a];
      object.aabb_max[a] =
          segment.origin[a] + static_cast<float>(segment.voxels[a]) / segment.voxels_per_unit;
    }
    object.bias = 1e-3f * (object.aabb_max[0] - object.aabb_min[0]);
    // Every other object stands for a mesh so large that kernels may take memory to be faster.
    object.triangles = (i % 2 == 0 ? 100 : 10'000'000) + random.below(1000);
    segment.features_per_corner =
        options.features ? options.features : 1 + random.below(kernels::kMaxFeatures);
    segment.samples = 4 * (1 + random.below(3));
    segment.length_scale = random.between(1.0f, 20.0f);
    fill_occupancy(random, options, segment);
    for (uint32_t f = 0; f < segment.corners * segment.features_per_corner; ++f)
      segment.features.push_back(int8_t(random.between(-127, 127)));
    segment.network = i;
    asset.networks.push_back(
        random_network(random, segment.samples * segment.features_per_corner + kernels::kGlobalInputs));
    object.content = std::move(segment);
    asset.objects.push_back(std::move(object));
  }
  for (uint32_t i = 0; i < options.bvhs; ++i)
    asset.objects.push_back(random_bvh_object(random, "bvh " + std::to_string(i)));
  for (uint32_t i = 0; i < options.sphericals; ++i) {
    format::Object object =
        random_spherical_object(random, "spherical " + std::to_string(i), 2 + options.max_voxels / 4);
    auto& [network, grids] = object.as<format::SphericalData>();
    if (i == 1) {
      grids = asset.objects.back().as<format::SphericalData>().grids;
      for (float& value : grids.outer_position) value = -value;
    } else {
      asset.spherical_networks.push_back(random_networks(random, grids, options.max_voxels > 8 ? 24 : 4));
    }
    network = uint32_t(asset.spherical_networks.size() - 1);
    asset.objects.push_back(std::move(object));
  }
  for (uint32_t i = 0; i < options.instances; ++i) {
    format::Instance instance;
    instance.name = "instance " + std::to_string(i);
    instance.object = random.below(options.objects + options.bvhs + options.sphericals);
    for (size_t k = 0; k < 12; ++k)
      instance.transform[k] = random.between(-0.4f, 0.4f) + (k % 5 == 0 ? 1.0f : 0.0f);
    asset.instances.push_back(std::move(instance));
  }
  for (uint32_t i = 0; i < std::min<uint32_t>(options.primaries, uint32_t(asset.objects.size())); ++i)
    asset.objects[i].primary =
        random_primary(random, 2 + options.max_voxels / 4, options.max_voxels > 8 ? 24 : 4);
  asset.metadata = R"({"schema":"nifkit.test/1","seed":)" + std::to_string(seed) + "}";
  return asset;
}

/// A segment near the object's grid: lines through it, short pieces, along axes, on voxel faces.
inline kernels::Segment random_segment(Random& random, const kernels::SegmentField& field) {
  kernels::Segment segment;
  const bool on_lattice = random.below(4) == 0, along_axis = random.below(8) == 0,
             line = random.below(2) == 0;
  const uint32_t axis = random.below(3);
  for (uint32_t a = 0; a < 3; ++a) {
    float at = random.between(-0.5f, 1.5f) * static_cast<float>(field.voxels[a]);
    if (on_lattice) at = static_cast<float>(static_cast<int32_t>(at));
    segment.origin[a] = field.origin[a] + at / field.voxels_per_unit;
    segment.direction[a] = along_axis ? (a == axis ? 1.0f : 0.0f) : random.between(-1.0f, 1.0f);
  }
  segment.tmin = line ? -std::numeric_limits<float>::infinity() : 0.0f;
  segment.tmax = random.below(2)
                     ? std::numeric_limits<float>::infinity()
                     : random.unit() * static_cast<float>(field.voxels[0]) / field.voxels_per_unit;
  return segment;
}

}  // namespace nif::test
