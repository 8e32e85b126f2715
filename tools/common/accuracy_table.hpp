// Makes the table of errors by ray set that `nif bake` and `nif eval` print.
#pragma once

#include <string>

#include "bake/ground_truth/evaluate.hpp"

namespace nif::tools {

std::string accuracy_table(const bake::SetAccuracies& sets);

}  // namespace nif::tools
