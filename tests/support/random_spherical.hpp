// Makes a `spherical` object without the baker: random latent vectors and networks; and rays to query it
// with.
#pragma once

#include <limits>

#include "formats/nif/asset.hpp"
#include "kernels/reference/half.hpp"
#include "kernels/reference/spherical/primary.hpp"
#include "tests/support/test_random.hpp"

namespace nif::test {

/// Values that both precisions can hold.
inline std::vector<float> random_halves(Random& random, size_t count, float reach) {
  std::vector<float> values(count);
  for (float& value : values) value = kernels::from_half(kernels::to_half(random.between(-reach, reach)));
  return values;
}

inline format::SphericalLayers random_layers(Random& random, uint32_t inputs, uint32_t max_width,
                                             uint32_t outputs = 1) {
  format::SphericalLayers layers{inputs, 4 * (1 + random.below(max_width / 4)), 1 + random.below(3), {}};
  layers.weights = random_halves(
      random, kernels::spherical_weights(inputs, layers.width, layers.hidden_layers, outputs), 0.7f);
  return layers;
}

/// Networks for the object's grids.
inline format::SphericalNetworks random_networks(Random& random, const format::SphericalGrids& grids,
                                                 uint32_t max_width) {
  format::SphericalNetworks networks;
  networks.half = random.below(2) == 0;
  networks.slope = random.below(4) == 0 ? random.unit() : 0.01f;
  networks.outer = random_layers(random, 2 * grids.outer_features, max_width);
  networks.inner = random_layers(random, 2 * grids.inner_features + grids.distance_features, max_width);
  return networks;
}

/// Grids of at most max_resolution along an axis, 2 or more.
inline format::SphericalGrids random_grids(Random& random, uint32_t max_resolution) {
  format::SphericalGrids grids;
  const uint32_t most_features = max_resolution > 4 ? kernels::kMaxSphericalFeatures : 2;
  const auto resolution = [&] { return 2 + random.below(max_resolution - 1); };
  grids.half = random.below(2) == 0;
  grids.outer_resolution = resolution();
  grids.inner_resolution = resolution();
  grids.distance_resolution = resolution();
  grids.outer_features = 1 + random.below(most_features);
  grids.inner_features = 1 + random.below(most_features);
  grids.distance_features = 1 + random.below(most_features);
  const size_t outer = size_t(grids.outer_resolution) * grids.outer_resolution * grids.outer_features,
               inner = size_t(grids.inner_resolution) * grids.inner_resolution * grids.inner_features;
  grids.outer_position = random_halves(random, outer, 1);
  grids.outer_direction = random_halves(random, outer, 1);
  grids.inner_position = random_halves(random, inner, 1);
  grids.inner_direction = random_halves(random, inner, 1);
  grids.distance = random_halves(random, size_t(grids.distance_resolution) * grids.distance_features, 1);
  return grids;
}

/// Likewise; for an object of any encoding.
inline format::Primary random_primary(Random& random, uint32_t max_resolution, uint32_t max_width) {
  format::Primary primary;
  primary.half_grids = random.below(2) == 0;
  primary.half_network = random.below(2) == 0;
  primary.margin = random.below(2) == 0 ? 0.0f : 0.1f * random.unit();
  primary.resolution = 2 + random.below(max_resolution - 1);
  primary.features = 1 + random.below(max_resolution > 4 ? kernels::kMaxSphericalFeatures : 2);
  const size_t latents = size_t(primary.resolution) * primary.resolution * primary.features;
  primary.position = random_halves(random, latents, 1);
  primary.direction = random_halves(random, latents, 1);
  primary.network = random_layers(random, 2 * primary.features, max_width, kernels::kPrimaryOutputs);
  return primary;
}

/// Everything except its network.
inline format::Object random_spherical_object(Random& random, const std::string& name,
                                              uint32_t max_resolution) {
  format::Object object;
  object.name = name;
  const float size = random.below(3) == 0 ? 100.0f : 1.0f;
  for (size_t a = 0; a < 3; ++a) {
    object.aabb_min[a] = random.between(-3.0f, 3.0f);
    object.aabb_max[a] = object.aabb_min[a] + (random.below(8) == 0 ? 0 : size * random.between(0.1f, 2.0f));
  }
  object.aabb_max[1] = object.aabb_min[1] + size;
  object.bias = 1e-3f * size;
  object.triangle_count = 100 + random.below(1000);
  object.spherical = {0, random_grids(random, max_resolution)};
  return object;
}

/// From far away, from inside, from faces and edges of the AABB, along axes, with parts that are zero,
/// infinite, NaN or out of order.
inline kernels::Segment random_segment(Random& random, const kernels::SphericalBounds& field) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  const uint32_t kind = random.below(8);
  const float distance = kind == 0 ? 1e4f : kind == 1 ? 30.0f : kind < 5 ? 0.9f : 0.2f;
  kernels::Segment segment{{}, {}, 0, kInfinity};
  for (uint32_t a = 0; a < 3; ++a) {
    const float half = 0.5f * (field.high[a] - field.low[a]), all = 1 / field.distance_scale;
    const float target = field.centre[a] + half * random.between(-1.0f, 1.0f);
    segment.origin[a] = field.centre[a] + all * distance * random.between(-1.0f, 1.0f);
    segment.direction[a] = random.below(8) ? target - segment.origin[a] : random.between(-1.0f, 1.0f);
    if (random.below(8) == 0) segment.origin[a] = random.below(2) ? field.low[a] : field.high[a];
    if (random.below(16) == 0) segment.origin[a] = field.centre[a];
    if (random.below(16) == 0) segment.direction[a] = random.below(2) ? 0.0f : -0.0f;
  }
  if (random.below(4) == 0) segment.tmin = random.between(-2.0f, 2.0f);
  if (random.below(4) == 0) segment.tmax = random.below(2) ? 1.0f : random.between(-2.0f, 2.0f);
  if (random.below(16) == 0) segment.tmin = -kInfinity;
  if (random.below(64) == 0) {
    constexpr float kOdd[] = {
        std::numeric_limits<float>::quiet_NaN(), kInfinity, -kInfinity, 0.0f, 3e38f, 1e-45f, 1e-30f};
    float* const parts[] = {&segment.origin[0], &segment.direction[1], &segment.direction[2], &segment.tmin,
                            &segment.tmax};
    *parts[random.below(5)] = kOdd[random.below(7)];
  }
  return segment;
}

}  // namespace nif::test
