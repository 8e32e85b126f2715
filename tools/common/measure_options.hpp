// What `nif eval` and `nif bench` both are told: with which rays to measure.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tools/common/options.hpp"

namespace nif::tools {

struct MeasureArguments {
  std::string isa = "auto";
  std::vector<std::string> sets;  ///< for parse_sets()
  uint64_t rays = 1'000'000, seed = 2;
};

/// --set, --rays, --seed and --isa. `sets` says which ray sets are the default.
void add_measure_options(Command command, MeasureArguments& arguments, const std::string& sets);

}  // namespace nif::tools
