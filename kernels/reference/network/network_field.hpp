// The network part of an object, as plain pointers into a loaded asset. It needs planes: features sit at
// corners of their voxels.
//
// Nothing here owns anything. The asset reader (formats/nif) fills these from a file, the baker from its own
// arrays; every kernel (reference, CPU, GPU) reads them. docs/format.md describes layout and meaning.
#pragma once

#include <cstdint>

#include "kernels/reference/planes/planes_field.hpp"
#include "kernels/reference/ray.hpp"

namespace nif::kernels {

inline constexpr uint32_t kMaxFeatures = 8;   ///< features per corner
inline constexpr uint32_t kMaxSamples = 32;   ///< points placed along one segment
inline constexpr uint32_t kMaxLayers = 4;     ///< hidden layers + the output layer
inline constexpr uint32_t kMaxWidth = 128;    ///< neurons of a hidden layer
inline constexpr uint32_t kGlobalInputs = 8;  ///< inputs that are not features: direction, lengths, flags
/// Features and heights of all points, and the global inputs.
inline constexpr uint32_t kMaxInputs = (kMaxFeatures + 1) * kMaxSamples + kGlobalInputs;
constexpr uint32_t input_count(uint32_t samples, uint32_t features_per_corner) {
  return samples * (features_per_corner + 1) + kGlobalInputs;
}
inline constexpr int32_t kMaxBias = 1 << 26;  ///< |bias|; leaves room for 32-bit sums of the largest layer
inline constexpr int32_t kMaxThreshold = 2 * kMaxBias;  ///< |threshold|: larger than any output
inline constexpr uint32_t kMaxShift = 24;

/// A multilayer perceptron in integers: activations 0..127, weights -127..127, 32-bit sums.
/// Layer l: y = clamp((W x + b + round) >> shift, 0, 127); the last layer's single sum is the logit.
struct Network {
  struct Layer {
    uint32_t inputs;        ///< columns of W, a multiple of 4
    uint32_t outputs;       ///< rows of W
    uint32_t shift;         ///< rescaling of the sums; unused in the last layer
    const int8_t* weights;  ///< row-major [outputs][inputs]
    const int32_t* biases;  ///< [outputs]
  };
  uint32_t layer_count = 0;
  Layer layers[kMaxLayers] = {};
  Calibration calibration;  ///< its threshold is already subtracted from the last layer's bias
};

/// The network part of an object: features at corners of its planes' voxels, and the network that reads them.
struct NetworkField {
  const uint64_t* brick_corners = nullptr;  ///< [mixed brick]: which corners have features
  const uint32_t* corner_base = nullptr;    ///< [mixed brick]: index of the brick's first corner
  const int8_t* features = nullptr;         ///< [corners][features_per_corner], -127..127
  uint32_t corners = 0;
  uint32_t features_per_corner = 0;  ///< F
  uint32_t samples = 0;              ///< K, a multiple of 4
  float length_scale = 0;            ///< input units per finest cell of open length

  Network network;
};

/// One object in the `segment` encoding (docs/encodings/segment.md).
struct SegmentField : PlanesField, NetworkField {};

}  // namespace nif::kernels
