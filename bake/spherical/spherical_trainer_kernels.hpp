// The inner loops of training a `spherical` field, compiled for each instruction set: the network over one
// group of a mini-batch, and steps of Adam.
//
// As in bake/network/network_trainer_kernels.hpp everything is computed in the same order with fused
// multiply-adds on every target that has them.
#pragma once

#include "bake/network/network_trainer_kernels.hpp"
#include "kernels/reference/spherical/spherical_field.hpp"

namespace nif::bake {

/// Entries of a grid whose weighted mean is a sample's latent vector, and their weights; grids over a
/// distance use the first two.
struct LatentLookup {
  uint32_t entries[4];  ///< counted across all objects
  float weights[4];
};

/// One grid for all objects in training. Each entry has `features` floats of the latent vector, then as many
/// for each of Adam's first and second moments.
struct LatentGrid {
  uint32_t features;
  uint32_t corners;  ///< entries that a sample looks up: 4, or 2
  const float* entries;
};
inline constexpr uint32_t kMaxLatentGrids = 3;

/// Maximum number of targets, for the outputs after the first.
inline constexpr uint32_t kMaxTargets = kernels::kPrimaryOutputs - 1;
/// Index of target `t`, out of `targets`, of a batch's sample: [target][kTrainLanes] for each kTrainLanes
/// samples.
constexpr size_t target_index(size_t sample, uint32_t t, uint32_t targets) {
  return (sample / kTrainLanes * targets + t) * kTrainLanes + sample % kTrainLanes;
}

/// Between the first output's probability and the label.
enum class SphericalLoss : uint8_t { squared, cross_entropy };

struct SphericalModel {
  /// Without biases. The first output is the log-odds that the label is 1; for samples whose label is 1, the
  /// others are compared with targets.
  NetworkShape shape;
  const float* weights;
  float slope;
  SphericalLoss loss;
  uint32_t grid_count;
  LatentGrid grids[kMaxLatentGrids];  ///< their features are the network's inputs, one after the other
  std::array<float, kMaxTargets> target_weights{};  ///< of their squared differences in the loss
};

/// Samples of one group of a mini-batch.
struct SphericalSlice {
  const LatentLookup* lookups[kMaxLatentGrids];  ///< [sample] for each grid
  const uint8_t* labels;                         ///< [sample]: 0 or 1
  const float* targets;     ///< by target_index(); null if there is one output, else aligned to 64 bytes
  float* input_gradients;   ///< receives, for each kTrainLanes samples, [input][kTrainLanes]
  float* weight_gradients;  ///< [weight][kVirtualLanes], added to
  uint8_t* wrong;           ///< [sample] receives 1 if the answer was wrong
  double loss;              ///< receives the sum over the samples
};

/// Floats of scratch that train_spherical needs.
size_t spherical_scratch_floats(const NetworkShape& shape);

/// Loss and gradients of `count` samples, a multiple of kTrainLanes. `scratch` must be aligned to 64 bytes.
void train_spherical(const SphericalModel& model, uint32_t count, float* scratch, SphericalSlice& slice);

/// One step of Adam for `count` parameters in parallel arrays. Gradients are multiplied by `scale`; values
/// stay within +-limit. Returns false if a change was not finite.
bool adam_step(const AdamStep& step, size_t count, const float* gradients, float* values, float* first_moment,
               float* second_moment);

/// Sums all lanes of all groups for weights `begin` to `end`, in a fixed order; clears what it has read.
void sum_lanes(std::span<float* const> groups, size_t begin, size_t end, float* sums);

}  // namespace nif::bake
