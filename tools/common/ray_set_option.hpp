// --set: the ray sets to measure.
#pragma once

#include <string>
#include <vector>

#include "bake/oracle/ray_sets.hpp"

namespace nif::tools {

/// The sets that --set names. Throws Error(usage).
std::vector<bake::RaySet> parse_sets(const std::vector<std::string>& names);

}  // namespace nif::tools
