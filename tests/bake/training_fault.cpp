// Takes the place of the baker's own before_training_step(), which does nothing.
#include "tests/bake/training_fault.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

namespace nif::test {
namespace {

const TrainingFault* current_fault = nullptr;

}  // namespace

TrainingFault::TrainingFault(uint64_t from, uint64_t steps, Kind kind)
    : from_(from), steps_(steps), kind_(kind) {
  EXPECT_EQ(current_fault, nullptr);
  current_fault = this;
}

TrainingFault::~TrainingFault() { current_fault = nullptr; }

void TrainingFault::apply(const bake::NetworkInTraining& network) const {
  if (network.number != 0 || network.step < from_ || network.step - from_ >= steps_) return;
  if (kind_ == Kind::not_finite) {
    network.weights[0] = std::numeric_limits<float>::quiet_NaN();
    return;
  }
  constexpr float kFarBelow = -64;
  std::ranges::fill(network.biases, kFarBelow);
  std::ranges::fill(network.exact_biases, kFarBelow);
}

}  // namespace nif::test

void nif::bake::before_training_step(const NetworkInTraining& network) {
  if (test::current_fault) test::current_fault->apply(network);
}
