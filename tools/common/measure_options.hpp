// What `nif eval` and `nif bench` both are told: with which rays to measure.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tools/common/shared_options.hpp"

namespace nif::tools {

struct MeasureArguments : RuntimeArguments {
  std::vector<std::string> sets;  ///< for parse_sets()
  uint64_t rays = 1'000'000, seed = 2;
  std::string fallback;  ///< "embree", or none
};

/// --set, --rays, --seed, --fallback, and those of the runtime. `sets` says which ray sets are the default.
void add_measure_options(Command command, MeasureArguments& arguments, const std::string& sets);

}  // namespace nif::tools
