// An asset as the baker makes it: everything that a .nif file holds, in memory of its own.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "formats/nif/layout.hpp"
#include "kernels/reference/bvh/field.hpp"
#include "kernels/reference/segment/field.hpp"
#include "kernels/reference/spherical/field.hpp"

namespace nif::format {

struct Layer {
  uint32_t inputs = 0, outputs = 0, shift = 0;
  std::vector<int32_t> biases;  ///< [outputs]
  std::vector<int8_t> weights;  ///< [outputs][inputs]
};

struct Network {
  std::vector<Layer> layers;
  float logit_scale = 1;
};

/// The `bvh` encoding; members as in kernels::BvhField.
struct Bvh {
  std::vector<kernels::BvhNode> nodes;
  std::vector<std::array<float, 3>> vertices;
  std::vector<std::array<uint8_t, 3>> triangles;

  /// Of the block that holds it in a file.
  uint64_t bytes() const {
    return nodes.size() * sizeof(nodes[0]) + vertices.size() * sizeof(vertices[0]) +
           triangles.size() * sizeof(triangles[0]);
  }
};

/// Latent vectors of a `spherical` object; each array is [resolution][resolution][features], theta before
/// phi, `distance` is [resolution][features]. Where `half` is set, all values are such that half precision
/// holds.
struct SphericalGrids {
  bool half = false;
  uint32_t outer_resolution = 0, outer_features = 0;
  uint32_t inner_resolution = 0, inner_features = 0;
  uint32_t distance_resolution = 0, distance_features = 0;
  std::vector<float> outer_position, outer_direction, inner_position, inner_direction, distance;

  /// Of the block that holds them in a file.
  uint64_t bytes() const {
    return (half ? 2 : 4) * (outer_position.size() + outer_direction.size() + inner_position.size() +
                             inner_direction.size() + distance.size());
  }
};

struct SphericalLayers {
  uint32_t inputs = 0, width = 0, hidden_layers = 0;
  std::vector<float> weights;  ///< layer by layer, [inputs][outputs] each
};

/// Both networks of one or several `spherical` objects.
struct SphericalNetworks {
  bool half = false;  ///< as with grids
  float slope = 0.01f;
  SphericalLayers outer, inner;

  uint64_t bytes() const { return (half ? 2 : 4) * (outer.weights.size() + inner.weights.size()); }
};

/// What answers primary rays of an object: grids as those of SphericalGrids, and a network with
/// kernels::kPrimaryOutputs outputs.
struct Primary {
  bool half_grids = false, half_network = false;  ///< as with SphericalGrids
  float slope = 0.01f;
  float margin = 0;  ///< as kernels::PrimaryField's
  uint32_t resolution = 0, features = 0;
  std::vector<float> position, direction;
  SphericalLayers network;

  /// Of the block that holds it in a file.
  uint64_t bytes() const {
    return (half_grids ? 2 : 4) * (position.size() + direction.size()) +
           (half_network ? 2 : 4) * network.weights.size();
  }
};

/// One object; what is not of its encoding stays empty. The members of `segment` are those of
/// kernels::SegmentField.
struct Object {
  Encoding encoding = kSegment;
  std::string name;
  uint32_t network = 0;
  std::array<float, 3> aabb_min{}, aabb_max{};
  float bias = 0;
  uint32_t triangles = 0;

  std::array<float, 3> origin{};
  float voxels_per_unit = 0;
  std::array<uint32_t, 3> voxels{};
  std::vector<uint16_t> brick_table;
  std::vector<kernels::BrickStates> brick_states;
  std::vector<uint64_t> brick_corners;
  std::vector<uint32_t> corner_base;
  std::vector<int8_t> features;
  uint32_t corners = 0;
  uint32_t features_per_corner = 0;
  uint32_t samples = 0;
  float length_scale = 0;

  Bvh bvh;

  SphericalGrids grids;  ///< `network` then counts in Asset::spherical_networks

  std::optional<Primary> primary;  ///< of any encoding
};

struct Instance {
  std::string name;
  uint32_t object = 0;
  std::array<float, 12> transform{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};  ///< object to world, row-major 3x4
};

struct Asset {
  std::vector<Object> objects;
  std::vector<Instance> instances;
  std::vector<Network> networks;
  std::vector<SphericalNetworks> spherical_networks;
  std::string metadata;  ///< JSON
};

/// Bricks along one axis that hold voxels + 1 corners.
constexpr uint32_t bricks_for(uint32_t voxels) { return voxels / kernels::kBrickSide + 1; }

/// The kernels' view of an object; valid while both live and are not changed.
kernels::SegmentField field_of(const Object& object, const Network& network);
kernels::BvhField field_of(const Bvh& bvh);
/// The object's bounds must be such as kernels::set_bounds() takes.
kernels::SphericalField spherical_field_of(const Object& object, const SphericalNetworks& networks);
/// Likewise, of an object that has one.
kernels::PrimaryField primary_field_of(const Object& object);

}  // namespace nif::format
