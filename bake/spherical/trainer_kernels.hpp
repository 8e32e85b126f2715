// The inner loops of training a `spherical` field, compiled for each instruction set: the network over one
// group of a mini-batch, and steps of Adam.
//
// As in bake/network/trainer_kernels.hpp everything is computed in the same order with fused multiply-adds on
// every target that has them.
#pragma once

#include "bake/network/trainer_kernels.hpp"
#include "kernels/reference/spherical/field.hpp"

namespace nif::bake {

/// Entries of a grid that a sample's latent vector is a mean of, and their weights; those over a distance use
/// the first two.
struct LatentLookup {
  uint32_t entries[4];  ///< counted through all objects
  float weights[4];
};

/// One grid of all objects in training. Of each entry there are `features` floats of the latent vector, then
/// as many each of Adam's first and second moment.
struct LatentGrid {
  uint32_t features;
  uint32_t corners;  ///< entries that a sample looks up: 4, or 2
  const float* entries;
};
inline constexpr uint32_t kMaxLatentGrids = 3;

/// Targets of the outputs beyond the first, at most.
inline constexpr uint32_t kMaxTargets = kernels::kPrimaryOutputs - 1;
/// Where target `t` of a batch's sample stands among `targets` of them: [target][kTrainLanes] for each
/// kTrainLanes samples.
constexpr size_t target_index(size_t sample, uint32_t t, uint32_t targets) {
  return (sample / kTrainLanes * targets + t) * kTrainLanes + sample % kTrainLanes;
}

/// Between the probability that the first output stands for and the label.
enum class SphericalLoss : uint8_t { squared, cross_entropy };

struct SphericalModel {
  /// Without biases. The first output is the log-odds of the label being 1; of samples for which it is, the
  /// others are held against targets.
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
  const LatentLookup* lookups[kMaxLatentGrids];  ///< [sample] of each grid
  const uint8_t* labels;                         ///< [sample]: 0 or 1
  const float* targets;     ///< by target_index(); null where there is one output, else aligned to 64 bytes
  float* input_gradients;   ///< receives, for each kTrainLanes samples, [input][kTrainLanes]
  float* weight_gradients;  ///< [weight][kVirtualLanes], added to
  uint8_t* wrong;           ///< [sample] receives 1 where the answer was wrong
  double loss;              ///< receives the sum over the samples
};

/// Floats of scratch that train_spherical needs.
size_t spherical_scratch_floats(const NetworkShape& shape);

/// Loss and gradients of `count` samples, a multiple of kTrainLanes. `scratch` must be aligned to 64 bytes.
void train_spherical(const SphericalModel& model, uint32_t count, float* scratch, SphericalSlice& slice);

/// One step of Adam for `count` parameters in arrays side by side. Their gradients are multiplied by `scale`;
/// values stay within +-limit. False where a change was not finite.
bool adam_step(const AdamStep& step, size_t count, const float* gradients, float* values, float* first_moment,
               float* second_moment);

/// Sums of all lanes of all groups for weights `begin` to `end`, in a fixed order; clears what it has read.
void sum_lanes(std::span<float* const> groups, size_t begin, size_t end, float* sums);

}  // namespace nif::bake
