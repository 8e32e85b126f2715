// The options of both `nif eval` and `nif bench`: which rays to measure with.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tools/common/shared_options.hpp"

namespace nif::tools {

struct MeasureArguments : RuntimeArguments {
  std::vector<std::string> sets;  ///< for parse_sets()
  uint64_t rays = 1'000'000, seed = 2;
  std::string fallback;  ///< "embree", or empty
};

/// Adds --set, --rays, --seed, --fallback, and the runtime's options. `sets` describes the default ray sets.
void add_measure_options(Command command, MeasureArguments& arguments, const std::string& sets);

}  // namespace nif::tools
