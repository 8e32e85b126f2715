// The inner loops of training, compiled for each instruction set: one group of a mini-batch, and one step of
// Adam.
//
// Everything is computed in the same order with fused multiply-adds on every target that has them (AVX2 and
// later), so that a bake gives the same bytes on all of those.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "kernels/reference/network/network_field.hpp"

namespace nif::bake {

inline constexpr uint32_t kTrainLanes = 64;  ///< rays that go through the network together
inline constexpr uint32_t kVirtualLanes =
    16;  ///< lanes of the weight gradients, whatever the hardware's width

/// The network's layers as offsets into one array of weights and one of biases.
struct NetworkShape {
  uint32_t layer_count = 0;
  struct Layer {
    uint32_t inputs, outputs;
    uint32_t weights, biases;  ///< offset of the layer's first
  };
  std::array<Layer, kernels::kMaxLayers> layers{};
  uint32_t weights = 0, biases = 0;  ///< in total
  uint32_t widest = 0;               ///< of all inputs and outputs
};

/// Parameters with the values of the quantised network, in float: features k / 127, weights k / 2^shift.
struct TrainingModel {
  NetworkShape shape;
  uint32_t samples, features_per_corner;
  const float* features;  ///< [corners][features_per_corner]
  const float* weights;
  const float* biases;
  float gain;  ///< logit = gain times the last layer's output
  const std::array<uint32_t, 8>* cell_corners;
};

/// A point as in kernels::SamplePoint, without its voxel.
struct TrainingPoint {
  uint8_t fraction[3];
  uint8_t height;
};

/// Consecutive training rays, as in TrainingRays.
struct TrainingSlice {
  const uint32_t* cells;
  const TrainingPoint* points;
  const std::array<uint8_t, kernels::kGlobalInputs>* globals;
  const uint8_t* visible;
};

/// Sums of a group. Sizes: features as the model's, weights and biases times kVirtualLanes.
struct GroupGradients {
  float* features;
  float* weights;
  float* biases;
  double loss;     ///< sum of binary cross-entropies
  uint8_t* wrong;  ///< [rays of the slice]: 1 if the answer was wrong
};

/// Floats of scratch that train_slice needs.
size_t train_scratch_floats(const NetworkShape& shape);

/// Adds the gradients of `count` rays (a multiple of kTrainLanes). `scratch` must be aligned to 64 bytes.
void train_slice(const TrainingModel& model, const TrainingSlice& slice, uint32_t count, float* scratch,
                 GroupGradients& gradients);

/// Adam (Kingma and Ba 2015) with the gradient of `groups` arrays, which are summed in order, scaled by
/// `scale`, and cleared.
struct AdamStep {
  float learning_rate, beta1, beta2, epsilon;
  float correction1, correction2;  ///< 1 / (1 - beta^step)
  float scale;
  float limit;    ///< parameters stay in [-limit, limit]
  float quantum;  ///< steps of the quantised copy
};
/// Returns false if a change was not finite. Parameters do not show that: clamping turns NaN into a limit.
bool adam_update(const AdamStep& step, size_t begin, size_t end, std::span<float* const> groups,
                 float* master, float* first_moment, float* second_moment, float* quantised);

/// Name of the instruction set in use.
const char* trainer_target();

}  // namespace nif::bake
