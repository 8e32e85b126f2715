// The memory of one object in the `spherical` encoding: latent vectors in grids over spherical coordinates,
// and two small networks in floating point.
//
// After Fujieda, Kao and Harada, "Neural Intersection Function" (HPG 2023, arXiv 2306.07191). As in
// kernels/reference/network/network_field.hpp nothing here owns anything. docs/format.md describes layout and
// meaning.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>

namespace nif::kernels {

inline constexpr uint32_t kMaxSphericalResolution = 2048;  ///< latent vectors along one axis of a grid
inline constexpr uint32_t kMaxSphericalFeatures = 8;       ///< floats of a latent vector
inline constexpr uint32_t kMaxSphericalWidth = 256;        ///< neurons of a hidden layer, a multiple of 4
inline constexpr uint32_t kMaxSphericalLayers = 3;         ///< hidden layers
inline constexpr uint32_t kMaxSphericalInputs = 3 * kMaxSphericalFeatures;
/// Latent vectors and weights have at most this magnitude. A layer then grows its inputs by at most 256 *
/// 4096 = 2^20, and four of them 2^12 to 2^92: no sum overflows, and no answer can be NaN.
inline constexpr float kMaxSphericalValue = 4096;
/// Coordinates of the AABB and of ray origins have at most this magnitude, and the AABB's longest side is at
/// least kMinSphericalSide: neither squares nor quotients overflow.
inline constexpr float kMaxSphericalCoordinate = 0x1p60f, kMinSphericalSide = 0x1p-60f;

/// Logits are stored as integers: the network's output times 2^16, rounded down.
inline constexpr float kSphericalLogitUnit = 65536, kSphericalLogitScale = 1 / kSphericalLogitUnit;
inline constexpr float kMaxSphericalOutput = 32767;

/// Floats of either precision as a file stores them.
struct SphericalValues {
  const void* data = nullptr;  ///< float, or IEEE 754 half precision
  bool half = false;
};

/// Latent vectors: [resolution][resolution][features] (theta, then phi) for a grid over two coordinates, or
/// [resolution][features] for a grid over a distance.
struct SphericalGrid {
  SphericalValues values;
  uint32_t resolution = 0, features = 0;
};

/// A multilayer perceptron without biases: hidden layers of equal width with leaky ReLU, then linear outputs.
struct SphericalNetwork {
  SphericalValues weights;  ///< layer by layer, [inputs][outputs] each
  uint32_t inputs = 0, width = 0, hidden_layers = 0, outputs = 1;
};
constexpr size_t spherical_weights(uint32_t inputs, uint32_t width, uint32_t hidden_layers,
                                   uint32_t outputs = 1) {
  return size_t(width) * inputs + size_t(width) * width * (hidden_layers - 1) + size_t(width) * outputs;
}
constexpr size_t spherical_weights(const SphericalNetwork& network) {
  return spherical_weights(network.inputs, network.width, network.hidden_layers, network.outputs);
}

/// The AABB relative to which an object's rays are described, and what follows from it.
struct SphericalBounds {
  float low[3] = {}, high[3] = {};  ///< the AABB, a closed set
  float centre[3] = {};
  float distance_scale = 0;  ///< 1 / half of the AABB's diagonal
  float margin = 0;          ///< the AABB grows by this before a ray is said to miss it
  float extent = 0;          ///< largest coordinate of the AABB
  float reach_scale = 0;     ///< kCertainReach limits distances times this
};

/// One object in the `spherical` encoding (docs/encodings/spherical.md).
struct SphericalField : SphericalBounds {
  SphericalGrid outer_position, outer_direction;            ///< same resolution and features
  SphericalGrid inner_position, inner_direction, distance;  ///< the first two likewise
  SphericalNetwork outer, inner;
  float slope = 0;  ///< of the leaky ReLU below 0; 0 to 1
};

/// Outputs of a network for primary rays: the log-odds of a hit; the distance from the ray's entry into the
/// AABB to the hit, divided by the AABB's diagonal; the surface's normal on the ray's side, in object space.
inline constexpr uint32_t kPrimaryOutputs = 5;

/// Answers primary rays of one object (docs/encodings/spherical.md).
struct PrimaryField : SphericalBounds {
  SphericalGrid position, direction;  ///< same resolution and features
  SphericalNetwork network;           ///< of kPrimaryOutputs
  float slope = 0;                    ///< as in SphericalField
  /// Secondary rays start this far before a hit, along the ray, as a fraction of the AABB's diagonal: depths
  /// are not exact, and a ray that starts behind the surface sees nothing. 0 to 1.
  float margin = 0;
};

/// The AABB grows by this fraction of its diagonal: how far stays_certain() lets a ray move on its way to
/// object space, with kSphericalUnits to the diagonal.
inline constexpr float kSphericalMargin = 0x1p-14f, kSphericalUnits = 64;

/// Sets everything that follows from the AABB. Returns false if the AABB cannot be computed with.
inline bool set_bounds(const float low[3], const float high[3], SphericalBounds& bounds) {
  double square = 0, longest = 0;
  bounds.extent = 0;
  for (int a = 0; a < 3; ++a) {
    const double side = double(high[a]) - double(low[a]);
    const double farthest = std::fmax(std::fabs(double(low[a])), std::fabs(double(high[a])));
    if (!(side >= 0) || !(farthest <= double(kMaxSphericalCoordinate))) return false;
    bounds.low[a] = low[a];
    bounds.high[a] = high[a];
    bounds.centre[a] = static_cast<float>((double(low[a]) + double(high[a])) / 2);
    bounds.extent = std::fmax(bounds.extent, static_cast<float>(farthest));
    square += side * side;
    longest = std::fmax(longest, side);
  }
  if (longest < double(kMinSphericalSide)) return false;
  const double diagonal = std::sqrt(square);
  bounds.distance_scale = static_cast<float>(2 / diagonal);
  bounds.margin = kSphericalMargin * static_cast<float>(diagonal);
  bounds.reach_scale = static_cast<float>(double(kSphericalUnits) / diagonal);
  return true;
}

}  // namespace nif::kernels
