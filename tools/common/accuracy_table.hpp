// Makes the table of errors by ray set that `nif bake` and `nif eval` print.
#pragma once

#include <string>

#include "bake/ground_truth/evaluate.hpp"

namespace nif::tools {

std::string accuracy_table(const bake::SetAccuracies& sets);

/// A block for each set whose answers are not all certain: what happened to rays by their probability.
std::string calibration_table(const bake::SetAccuracies& sets);

}  // namespace nif::tools
