// Trains one object's field: features and network together, quantised as the asset will have them.
#pragma once

#include <atomic>
#include <functional>
#include <string_view>

#include "bake/checkpoint.hpp"
#include "bake/network/training_rays.hpp"
#include "formats/nif/network/network_part.hpp"

namespace nif::bake {

/// The network between the inputs and the logit.
struct NetworkOptions {
  uint32_t width = 32;         ///< neurons of each hidden layer, a multiple of 4
  uint32_t hidden_layers = 2;  ///< 1..kernels::kMaxLayers - 1
};

/// How long and how fast to train. Counts, never clocks: a slower machine makes the same bytes.
struct TrainingOptions {
  NetworkOptions network;
  Mix mix{};
  uint64_t rays = 0;            ///< of all training steps
  uint64_t rays_per_round = 0;  ///< fresh rays drawn at a time
  uint32_t passes = 6;          ///< how often each drawn ray is used
  uint32_t batch = 8192;        ///< rays per step; a multiple of kTrainGroups * kTrainLanes
  float feature_rate = 0.01f;   ///< Adam's peak learning rate for features
  float network_rate = 0.006f;  ///< and for weights and biases
  uint64_t seed = 0;
};

struct TrainingProgress {
  uint64_t rays_done, rays_total;
  double loss;   ///< binary cross-entropy, mean over recent open rays
  double error;  ///< share of those answered wrongly
};

struct TrainingResult {
  format::Mlp network;
  std::string failure;  ///< why training failed, as a sentence that names the object; empty on success
  /// How often training went back, because its loss was not finite or all answers were alike.
  uint32_t recoveries = 0;
  std::array<double, kRaySets.size()> error{};  ///< share of wrong answers among each set's latest open rays
};

/// Trains an object with planes and a network (after store_occupancy(), with samples and length_scale set)
/// and stores the features in it. Calls `progress` from the calling thread, several times a second. Training
/// fails if the loss stays non-finite, or all answers alike, after several recoveries, and if there are too
/// few rays to learn from. Throws Error(interrupted) once `cancel` is set. The result does not depend on the
/// number of threads. With a `log`, it stores its state from time to time, and resumes from what is stored.
TrainingResult train(const RaySource& source, format::Object& object, const TrainingOptions& options,
                     const std::function<void(const TrainingProgress&)>& progress,
                     const std::atomic<bool>& cancel, TrainingLog* log = nullptr);

}  // namespace nif::bake
