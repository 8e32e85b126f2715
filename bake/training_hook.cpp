// The default hook before each step of training, which does nothing. A test may link another one.
#include "bake/training_hook.hpp"

namespace nif::bake {

[[gnu::weak]] void before_training_step(const NetworkInTraining&) {}

}  // namespace nif::bake
