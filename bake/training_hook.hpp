// A place where training can be watched from outside. Tests of recovery link a definition of their own, which
// breaks a network and so shows that training goes back; everyone else gets one that does nothing.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace nif::bake {

/// A network that is about to train for a step.
struct NetworkInTraining {
  size_t number;  ///< among those that are trained together
  uint64_t step;
  std::span<float> weights, biases;  ///< with which the step runs; `spherical` networks have no biases
  std::span<float> exact_biases;     ///< before they are quantised
};

/// Called before each step of each training, from the thread that trains.
void before_training_step(const NetworkInTraining& network);

}  // namespace nif::bake
