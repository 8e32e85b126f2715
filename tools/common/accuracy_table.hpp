// The table of accuracy by ray set that `nif bake` and `nif eval` print for people.
#pragma once

#include <string>

#include "bake/oracle/evaluate.hpp"

namespace nif::tools {

std::string accuracy_table(const bake::SetAccuracies& sets);

}  // namespace nif::tools
