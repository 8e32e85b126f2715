// Lets code from outside watch training. Tests of recovery link their own definition, which breaks a network
// and so shows that training goes back; all other programs get one that does nothing.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace nif::bake {

/// A network just before a step of training.
struct NetworkInTraining {
  size_t number;  ///< index among those that are trained together
  uint64_t step;
  std::span<float> weights, biases;  ///< used by the step; `spherical` networks have no biases
  std::span<float> exact_biases;     ///< before they are quantised
};

/// Called before each step of each training, from the thread that trains.
void before_training_step(const NetworkInTraining& network);

}  // namespace nif::bake
