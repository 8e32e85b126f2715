// A network that breaks in the middle of its training, by taking the place of the baker's hook.
#pragma once

#include "bake/training_hook.hpp"

namespace nif::test {

/// While it lives, the first network of each training breaks before the steps `from` .. `from` + `steps` - 1.
/// Only one may exist at a time.
class TrainingFault {
 public:
  enum class Kind {
    not_finite,  ///< a weight becomes NaN
    collapse,    ///< neurons far below their range: one answer to all rays, for thousands of steps
  };

  explicit TrainingFault(uint64_t from, uint64_t steps = 1, Kind kind = Kind::not_finite);
  ~TrainingFault();
  TrainingFault(const TrainingFault&) = delete;
  TrainingFault& operator=(const TrainingFault&) = delete;

  void apply(const bake::NetworkInTraining& network) const;

 private:
  const uint64_t from_, steps_;
  const Kind kind_;
};

}  // namespace nif::test
