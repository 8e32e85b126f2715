// What a step of training is preceded by, unless a test links something else: nothing.
#include "bake/training_hook.hpp"

namespace nif::bake {

[[gnu::weak]] void before_training_step(const NetworkInTraining&) {}

}  // namespace nif::bake
